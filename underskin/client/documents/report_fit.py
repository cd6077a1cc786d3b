"""What a report says in numbers of its fit. Written by scripts/client_documents.py."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from underskin.client.documents.document import Document


@dataclass(frozen=True, eq=False, kw_only=True)
class AdoptableLaw(Document):
    """The law as an adopted model uses it."""

    law: str
    """Its name in the grammar of laws."""

    parameters: Mapping[str, float]
    """By name, in more digits."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Alike(Document):
    """Answers that predict these recordings alike."""

    probability: float
    """Of all of them together, 0 to 1."""

    rivals: tuple[tuple[str, ...], ...]
    """Their mechanisms."""

    differ_percent: float | None
    """By how much their predictions differ at most [%]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CoursePoint(Document):
    """A point of a course that has no form."""

    at: float | str | None
    """Where on the axis: a number, or a word."""

    change: float | None
    """The change there: relative, of a force in N, of a place in mm."""

    low: float | None
    """Lower end of its 95 % interval."""

    high: float | None
    """Upper end of its 95 % interval."""


@dataclass(frozen=True, eq=False, kw_only=True)
class EachVerdict(Document):
    """The verdict of one campaign or one skin alone."""

    campaign: str | None
    """Name of the campaign."""

    skin: str | None
    """Id of the skin."""

    verdict: str
    """Its own verdict."""

    probability: float
    """Of what its own report states, 0 to 1."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Parameter(Document):
    """A fitted parameter with its 95 % interval."""

    name: str
    """Its name."""

    unit: str
    """Of the three numbers; - for none."""

    value: float | None
    """Its most probable value."""

    low: float | None
    """Lower end of its 95 % interval."""

    high: float | None
    """Upper end of its 95 % interval."""

    at_bound: Literal["low", "high"] | None
    """The end of its search that the value lies at or beyond: it is no result then."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FitScore(Document):
    """How well the recordings are described."""

    rmse_percent: float | None
    """100 √(Σ|measured − model|² / Σ|measured|²) [%]; of indentations by least squares."""

    correlated_rmse_percent: float | None
    """Of curves: the same by the fit that knows that errors are correlated [%]."""

    least_squares_modulus_mpa: float | None
    """Of indentations: Young's modulus by least squares [MPa]."""

    heldout_rmse_percent: float | None
    """The same on recordings that were held out [%]."""

    log_score: float | None
    """Mean logarithm of the density of a held-out recording."""

    youngs_modulus: Parameter | None
    """Of curves: Young's modulus."""


@dataclass(frozen=True, eq=False, kw_only=True)
class HeldOutGroup(Document):
    """A group of recordings that was predicted from the others."""

    group: str
    """Which recordings, such as the highest preload."""

    chosen: tuple[str, ...]
    """The mechanisms chosen without it."""

    before_rmse_percent: float | None
    """Error of the paper's model on it [%]."""

    after_rmse_percent: float | None
    """Error with these mechanisms on it [%]."""

    noise_floor_percent: float | None
    """Error that noise alone makes [%]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FittedNoise(Document):
    """The noise that the fit found."""

    gain_percent: float | None
    """Standard deviation of a recording's gain [%]."""

    position_mm: float | None
    """Standard deviation of the sphere's position, each axis [mm]."""

    line_level: float | None
    """Noise of a line over what its coherence says [-]."""

    smooth_percent: float | None
    """Standard deviation of an error that is smooth over lines [%]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit(Document):
    """How much better the recordings are described."""

    before: FitScore
    """By the paper's model."""

    after: FitScore
    """With what was found."""

    mechanisms: tuple[str, ...]
    """The mechanisms of `after`."""

    noise_floor_percent: float | None
    """Error that noise alone makes of a new recording [%]."""

    groups: tuple[HeldOutGroup, ...]
    """The groups held out."""

    noise: FittedNoise
    """The noise."""


@dataclass(frozen=True, eq=False, kw_only=True)
class HeldOutErrors(Document):
    """Errors on recordings that were held out."""

    before: float | None
    """By the paper's model [%]."""

    after: float | None
    """With the law [%]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SetsTried(Document):
    """How many sets of mechanisms were looked at."""

    tried: int
    """Begun."""

    fitted: int
    """Fitted to the end."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Provenance(Document):
    """What the report was made with: the same input, versions and tables give the same report."""

    underskin: str
    """Version of underskin."""

    numpy: str
    """Version of NumPy."""

    scipy: str
    """Version of SciPy."""

    tables: Mapping[str, str]
    """SHA-256 of each table."""

    seed: int
    """Of the random numbers."""

    mechanisms: Mapping[str, str] | None
    """Mechanisms that are not underskin's own, with their package or file."""

    without: tuple[str, ...] | None
    """Mechanisms that were left out of the catalogue."""

    unnamed: AdoptableLaw | None
    """Of `unexplained`: the law."""

    alike: Alike | None
    """Of `ambiguous`: answers that predict alike."""

    sets_of_mechanisms: SetsTried | None
    """How far the search went."""

    each: tuple[EachVerdict, ...] | None
    """Of several: the verdict of each alone."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RivalLaw(Document):
    """Another law that would describe the same misfit."""

    acts_on: str
    """What it changes."""

    axis: str
    """What it depends on."""

    form: str
    """How."""

    probability: float
    """Its share of all laws, 0 to 1."""


@dataclass(frozen=True, eq=False, kw_only=True)
class UnnamedLaw(Document):
    """A law that no mechanism of the catalogue describes."""

    acts_on: str
    """What it changes."""

    axis: str
    """What it depends on."""

    form: str
    """How."""

    expression: str
    """The law as a formula."""

    parameters: tuple[Parameter, ...]
    """Its numbers."""

    probability: float
    """Its share of all laws, 0 to 1; the report's is that of any law."""

    rivals: tuple[RivalLaw, ...]
    """Others, the most probable first."""

    heldout_rmse_percent: HeldOutErrors
    """What it is worth on recordings that were held out [%]."""

    range: Mapping[str, tuple[float | str | None, ...]]
    """Where it holds: ends of the axis, or words."""

    course: tuple[CoursePoint, ...] | None
    """Of the form `free`: the course itself."""
