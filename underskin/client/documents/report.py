"""The report of a diagnosis (`report/1`). Written by scripts/client_documents.py."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from underskin.client.documents.document import Document
from underskin.client.documents.report_fit import Fit, Parameter, Provenance, UnnamedLaw
from underskin.client.documents.report_several import (
    CampaignLevel,
    Contradiction,
    KindParameter,
    Population,
    Scope,
    SensorLevel,
    SkinValue,
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Alternative(Document):
    """Another answer than the one that leads."""

    mechanisms: tuple[str, ...]
    """Names, or `nothing_missing`, or `none_of_these`."""

    probability: float
    """Its posterior, 0 to 1."""

    why_not: str
    """What speaks against it, in words."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Idealised(Document):
    """A law without a free parameter, with even odds beside its absence."""

    name: str
    """Its name."""

    probability: float
    """Posterior that it is there, summed over the answers."""

    effect_percent: float | None
    """What it changes of the response, root mean square [%]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LocatedAxis(Document):
    """Whether the misfit depends on one axis, such as the preload."""

    axis: str
    """A field of the campaign or of its `conditions`."""

    p_value: float | None
    """Probability of so strong a dependence where there is none, over all axes; null where undecidable."""

    share_percent: float
    """Share of the misfit that goes with this axis [%]."""

    undecidable: str | None
    """Why it cannot be decided."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Location(Document):
    """Where recordings and the paper's model differ."""

    axes: tuple[LocatedAxis, ...]
    """One entry an axis that was looked at."""

    region: Mapping[str, tuple[float | str | None, ...]]
    """The smallest region that holds most of the misfit: by axis its ends, or words."""

    effect_percent: float | None
    """By how much the charge differs there [%]."""

    effect_interval_percent: tuple[float | None, ...] | None
    """Its 95 % interval, low and high [%]."""

    statement: str
    """The same in words."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlannedRecording(Document):
    """A recording to make next; beside these, any axis of the campaign may be stated."""

    sensor: str
    """Id of the sensor to press."""

    indenter_radius_mm: float
    """Radius of the sphere [mm]."""

    preload_n: float
    """Static force [N]."""

    dynamic_force_n: float
    """Peak amplitude of the oscillating force [N]."""

    position_mm: tuple[float, ...] | None
    """Place of the sphere, x and y [mm]."""

    dwell_s: float | None
    """How long to hold the preload before [s]."""

    load_cycles: float | None
    """Load cycles that the skin has seen [-]."""

    repeats: int
    """How often to record this."""


@dataclass(frozen=True, eq=False, kw_only=True)
class NextExperiment(Document):
    """The recordings that would best tell what is still open apart."""

    recordings: tuple[PlannedRecording, ...]
    """In this order; empty where none would help."""

    separates: tuple[tuple[str, ...], ...]
    """The sets of mechanisms that they tell apart."""

    probability_of_deciding: float
    """Probability that they settle it, 0 to 1."""

    without_it: float
    """Probability that the leader is right without them, 0 to 1."""

    minutes: float
    """How long they take [min]."""

    statement: str
    """The same in words."""


@dataclass(frozen=True, eq=False, kw_only=True)
class NotIdentifiable(Document):
    """A mechanism that these recordings cannot tell from something else."""

    mechanism: str
    """Its name."""

    confounded_with: str
    """What it looks like here: another mechanism, `d33` or `noise`."""

    reason: str
    """Why, in words."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Power(Document):
    """What the campaign could have seen of a mechanism."""

    mechanism: str
    """Its name."""

    smallest_visible_percent: float | None
    """The smallest change of the charge by which it would have been named [%]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PresentGroup(Document):
    """Mechanisms that these recordings cannot tell apart."""

    mechanisms: tuple[str, ...]
    """Their names."""

    probability: float
    """Posterior that at least one of them is there, 0 to 1."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RelativeInterval(Document):
    """A 95 % interval for comparisons."""

    low: float
    """Its lower end."""

    high: float
    """Its upper end."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ReportMechanism(Document):
    """A mechanism that the recordings ask for."""

    name: str
    """Its name in the catalogue."""

    probability: float
    """Posterior that it is there, 0 to 1."""

    parameters: tuple[Parameter, ...]
    """How strong it is."""

    explains_percent: float | None
    """Share of the misfit beyond noise that comes back without it [%]; null where that says nothing."""

    scope: Scope | None
    """Of several campaigns or skins: where it acts."""

    statement: str | None
    """What is to be known of it, in words."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ReportFinding(Document):
    """Something that looks wrong in the data, or limits the answer."""

    code: str
    """The kind of finding; docs/findings.md explains each."""

    recording: str
    """Id of the recording; empty for the whole campaign."""

    field: str
    """The field that it is about."""

    statement: str
    """The finding in words."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ReportD33(Document):
    """d33, averaged over the answers that remain, with their probabilities."""

    name: Literal["d33"] | None
    """What it is."""

    unit: str | None
    """Of the three numbers."""

    value: float | None
    """Its median."""

    low: float | None
    """Lower end of its 95 % interval, tolerances included."""

    high: float | None
    """Upper end of its 95 % interval, tolerances included."""

    relative: RelativeInterval | None
    """The same without what the declared values may be off by: to compare sensors or dates."""

    quotable: bool
    """Whether one answer stands, fits to the noise, and nothing hidden moves d33."""

    per_sensor: tuple[SensorLevel, ...] | None
    """Of several campaigns: one entry a campaign and sensor."""

    per_campaign: tuple[CampaignLevel, ...] | None
    """Of several campaigns: the array's, over the sensors that they share."""

    per_skin: tuple[SkinValue, ...] | None
    """Of a fleet: one entry a skin."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Report(Document):
    """The result of a diagnosis (`report/1`)."""

    schema: Literal["report/1"]
    """The format."""

    campaign: str
    """Name of the campaign; of several, what they are called together."""

    campaigns: tuple[str, ...] | None
    """Of several: the names of all."""

    verdict: Literal["no_mismatch", "explained", "ambiguous", "unexplained", "insufficient_data"]
    """What the probabilities say; docs/diagnosis.md explains each."""

    probability: float
    """Posterior of the stated answer, 0 to 1."""

    statement: str
    """The result in up to three sentences."""

    location: Location
    """Where recordings and the paper's model differ."""

    mechanisms: tuple[ReportMechanism, ...]
    """The set of mechanisms that leads."""

    presence: tuple[PresentGroup, ...]
    """Groups of mechanisms, the most probable first."""

    unnamed: UnnamedLaw | None
    """Of `unexplained`: the law that describes the misfit best."""

    alternatives: tuple[Alternative, ...]
    """Other answers, the most probable first."""

    idealised: tuple[Idealised, ...] | None
    """Laws without a free parameter that declared facts say and the base model leaves out."""

    not_identifiable: tuple[NotIdentifiable, ...]
    """What these recordings cannot tell."""

    findings: tuple[ReportFinding, ...]
    """What looks wrong in the data, or limits the answer."""

    fit: Fit | None
    """How much better the recordings are described; null of several campaigns."""

    power: tuple[Power, ...]
    """What the campaign could have seen."""

    d33: ReportD33 | None
    """d33 of the sensors; null of curves and where nothing can be told."""

    by_kind: tuple[KindParameter, ...] | None
    """Of several kinds of recordings: what each alone tells."""

    contradictions: tuple[Contradiction, ...] | None
    """Of several kinds of recordings: where they contradict one another."""

    population: tuple[Population, ...] | None
    """Of a fleet: each quantity over its skins."""

    next_experiment: NextExperiment | None
    """What to record next; null where all is decided."""

    provenance: Provenance
    """What it was made with."""
