"""What a `report/1` says in numbers of its fit: parameters with intervals, errors before and after, the noise."""

from typing import Literal

from pydantic import BaseModel, Field


class Parameter(BaseModel):
    """A fitted parameter with its 95 % interval."""

    name: str = Field(description="Its name.", examples=["tip_mass"])
    unit: str = Field(description="Of the three numbers; - for none.", examples=["g"])
    value: float | None = Field(description="Its most probable value.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")
    at_bound: Literal["low", "high"] | None = Field(
        default=None, description="The end of its search that the value lies at or beyond: it is no result then."
    )


class FitScore(BaseModel):
    """How well the recordings are described."""

    rmse_percent: float | None = Field(
        description="100 √(Σ|measured − model|² / Σ|measured|²) [%]; of indentations by least squares."
    )
    correlated_rmse_percent: float | None = Field(
        default=None, description="Of curves: the same by the fit that knows that errors are correlated [%]."
    )
    least_squares_modulus_mpa: float | None = Field(
        default=None, description="Of indentations: Young's modulus by least squares [MPa]."
    )
    heldout_rmse_percent: float | None = Field(description="The same on recordings that were held out [%].")
    log_score: float | None = Field(description="Mean logarithm of the density of a held-out recording.")
    youngs_modulus: Parameter | None = Field(default=None, description="Of curves: Young's modulus.")


class HeldOutGroup(BaseModel):
    """A group of recordings that was predicted from the others."""

    group: str = Field(description="Which recordings, such as the highest preload.")
    chosen: list[str] = Field(description="The mechanisms chosen without it.")
    before_rmse_percent: float | None = Field(description="Error of the paper's model on it [%].")
    after_rmse_percent: float | None = Field(description="Error with these mechanisms on it [%].")
    noise_floor_percent: float | None = Field(description="Error that noise alone makes [%].")


class FittedNoise(BaseModel):
    """The noise that the fit found."""

    gain_percent: float | None = Field(description="Standard deviation of a recording's gain [%].")
    position_mm: float | None = Field(description="Standard deviation of the sphere's position, each axis [mm].")
    line_level: float | None = Field(description="Noise of a line over what its coherence says [-].")
    smooth_percent: float | None = Field(description="Standard deviation of an error that is smooth over lines [%].")


class Fit(BaseModel):
    """How much better the recordings are described."""

    before: FitScore = Field(description="By the paper's model.")
    after: FitScore = Field(description="With what was found.")
    mechanisms: list[str] = Field(description="The mechanisms of `after`.")
    noise_floor_percent: float | None = Field(description="Error that noise alone makes of a new recording [%].")
    groups: list[HeldOutGroup] = Field(description="The groups held out.")
    noise: FittedNoise = Field(description="The noise.")


class RivalLaw(BaseModel):
    """Another law that would describe the same misfit."""

    acts_on: str = Field(description="What it changes.")
    axis: str = Field(description="What it depends on.")
    form: str = Field(description="How.")
    probability: float = Field(description="Its share of all laws, 0 to 1.")


class HeldOutErrors(BaseModel):
    """Errors on recordings that were held out."""

    before: float | None = Field(description="By the paper's model [%].")
    after: float | None = Field(description="With the law [%].")


class CoursePoint(BaseModel):
    """A point of a course that has no form."""

    at: float | str | None = Field(description="Where on the axis: a number, or a word.")
    change: float | None = Field(description="The change there: relative, of a force in N, of a place in mm.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")


class UnnamedLaw(BaseModel):
    """A law that no mechanism of the catalogue describes."""

    acts_on: str = Field(description="What it changes.", examples=["modulus"])
    axis: str = Field(description="What it depends on.", examples=["time_of_day"])
    form: str = Field(description="How.", examples=["periodic"])
    expression: str = Field(description="The law as a formula.")
    parameters: list[Parameter] = Field(description="Its numbers.")
    probability: float = Field(description="Its share of all laws, 0 to 1; the report's is that of any law.")
    rivals: list[RivalLaw] = Field(description="Others, the most probable first.")
    heldout_rmse_percent: HeldOutErrors = Field(description="What it is worth on recordings that were held out [%].")
    range: dict[str, list[float | str | None]] = Field(description="Where it holds: ends of the axis, or words.")
    course: list[CoursePoint] | None = Field(default=None, description="Of the form `free`: the course itself.")


class AdoptableLaw(BaseModel):
    """The law as an adopted model uses it."""

    law: str = Field(description="Its name in the grammar of laws.")
    parameters: dict[str, float] = Field(description="By name, in more digits.")


class Alike(BaseModel):
    """Answers that predict these recordings alike."""

    probability: float = Field(description="Of all of them together, 0 to 1.")
    rivals: list[list[str]] = Field(description="Their mechanisms.")
    differ_percent: float | None = Field(description="By how much their predictions differ at most [%].")


class SetsTried(BaseModel):
    """How many sets of mechanisms were looked at."""

    tried: int = Field(description="Begun.")
    fitted: int = Field(description="Fitted to the end.")


class EachVerdict(BaseModel):
    """The verdict of one campaign or one skin alone."""

    campaign: str | None = Field(default=None, description="Name of the campaign.")
    skin: str | None = Field(default=None, description="Id of the skin.")
    verdict: str = Field(description="Its own verdict.")
    probability: float = Field(description="Of what its own report states, 0 to 1.")


class Provenance(BaseModel):
    """What the report was made with: the same input, versions and tables give the same report."""

    underskin: str = Field(description="Version of underskin.")
    numpy: str = Field(description="Version of NumPy.")
    scipy: str = Field(description="Version of SciPy.")
    tables: dict[str, str] = Field(description="SHA-256 of each table.")
    seed: int = Field(description="Of the random numbers.")
    mechanisms: dict[str, str] | None = Field(
        default=None, description="Mechanisms that are not underskin's own, with their package or file."
    )
    without: list[str] | None = Field(default=None, description="Mechanisms that were left out of the catalogue.")
    unnamed: AdoptableLaw | None = Field(default=None, description="Of `unexplained`: the law.")
    alike: Alike | None = Field(default=None, description="Of `ambiguous`: answers that predict alike.")
    sets_of_mechanisms: SetsTried | None = Field(default=None, description="How far the search went.")
    each: list[EachVerdict] | None = Field(default=None, description="Of several: the verdict of each alone.")
