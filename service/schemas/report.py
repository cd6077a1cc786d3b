"""`report/1`, the result of a diagnosis, as OpenAPI describes it; `underskin.diagnosis.reporting` writes it.

Reports are answered as they were kept and not validated again; tests hold them to these models. A field with a default
is left out of reports that it says nothing of. Numbers that are not finite are null.
"""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from underskin.findings.codes import FindingCode

RecordingKind = Literal["frf", "indentation", "compression"]
Verdict = Literal["no_mismatch", "explained", "ambiguous", "unexplained", "insufficient_data"]
Origin = Literal["skin", "rig", "chain"]


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


class Scope(BaseModel):
    """Where a mechanism acts, of several campaigns or skins."""

    campaigns: list[str] | None = Field(default=None, description="Names of the campaigns.")
    sensors: list[str] | None = Field(default=None, description="Ids of the sensors.")
    skins: list[str] | None = Field(default=None, description="Ids of the skins.")
    since: str | None = Field(default=None, description="The date from which on it is there.")


class RelativeLevel(BaseModel):
    """The interval of a d33 to compare it with other sensors and campaigns, as wide as by the leading answer alone."""

    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")


class SensorLevel(BaseModel):
    """d33 of one sensor in one of several campaigns, over all answers by known mechanisms."""

    campaign: str = Field(description="Name of the campaign.")
    sensor: str = Field(description="Id of the sensor.")
    unit: str = Field(description="Of the three numbers.")
    value: float | None = Field(description="Its estimate.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")
    relative: RelativeLevel | None = Field(default=None, description="To compare sensors and campaigns.")


class CampaignLevel(BaseModel):
    """d33 of the array in one of several campaigns, over the sensors that these share and over all answers by known
    mechanisms."""

    campaign: str = Field(description="Name of the campaign.")
    unit: str = Field(description="Of the three numbers.")
    value: float | None = Field(description="Its estimate.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")
    relative: RelativeLevel | None = Field(default=None, description="To compare campaigns.")


class SkinValue(BaseModel):
    """A quantity of one skin of a fleet."""

    skin: str = Field(description="Id of the skin.")
    value: float | None = Field(description="Its estimate.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")


class KindParameter(BaseModel):
    """A parameter as one kind of recording alone tells it."""

    kind: RecordingKind = Field(description="The kind.")
    parameter: str = Field(description="Name of the parameter.", examples=["youngs_modulus"])
    unit: str = Field(description="Of the three numbers; - for none.")
    value: float | None = Field(description="Its estimate.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")


class Contradiction(BaseModel):
    """Kinds of recordings that are not of one material."""

    parameter: str = Field(description="What they disagree on.")
    kinds: list[RecordingKind] = Field(description="The kinds.")
    statement: str = Field(description="The same in words.")


class Departure(BaseModel):
    """A skin that departs from its fleet."""

    skin: str = Field(description="Id of the skin.")
    value: float | None = Field(description="Its own value.")
    probability: float = Field(description="Probability that it departs in this, 0 to 1.")


class Population(BaseModel):
    """One quantity over the skins of a fleet."""

    parameter: str = Field(description="Name of the quantity.", examples=["thickness"])
    unit: str = Field(description="Of all numbers; - for none.")
    mean: float | None = Field(description="Mean of the skins that do not depart.")
    sd: float | None = Field(description="Their standard deviation.")
    departures: list[Departure] = Field(description="Skins that depart in this quantity.")
    skins: list[SkinValue] = Field(description="One entry a skin.")


class LocatedAxis(BaseModel):
    """Whether the misfit depends on one axis, such as the preload."""

    axis: str = Field(description="A field of the campaign or of its `conditions`.", examples=["preload_n"])
    p_value: float | None = Field(
        description="Probability of so strong a dependence where there is none, over all axes; null where undecidable."
    )
    share_percent: float = Field(description="Share of the misfit that goes with this axis [%].")
    undecidable: str | None = Field(default=None, description="Why it cannot be decided.")


class Location(BaseModel):
    """Where recordings and the paper's model differ."""

    axes: list[LocatedAxis] = Field(description="One entry an axis that was looked at.")
    region: dict[str, list[float | str | None]] = Field(
        description="The smallest region that holds most of the misfit: by axis its ends, or words."
    )
    effect_percent: float | None = Field(description="By how much the charge differs there [%].")
    effect_interval_percent: list[float | None] | None = Field(
        default=None, description="Its 95 % interval, low and high [%]."
    )
    statement: str = Field(description="The same in words.")


class ReportMechanism(BaseModel):
    """A mechanism that the recordings ask for."""

    name: str = Field(description="Its name in the catalogue.", examples=["contact_resonance"])
    origin: Origin | None = Field(
        default=None, alias="of", description="What it belongs to: the skin, the rig or the measuring chain."
    )
    probability: float = Field(description="Posterior that it is there, 0 to 1.")
    parameters: list[Parameter] = Field(description="How strong it is.")
    explains_percent: float | None = Field(
        description="Share of the misfit beyond noise that comes back without it [%]; null where that says nothing."
    )
    scope: Scope | None = Field(default=None, description="Of several campaigns or skins: where it acts.")
    statement: str | None = Field(default=None, description="What is to be known of it, in words.")


class PresentGroup(BaseModel):
    """Mechanisms that these recordings cannot tell apart."""

    mechanisms: list[str] = Field(description="Their names.")
    probability: float = Field(description="Posterior that at least one of them is there, 0 to 1.")


class Alternative(BaseModel):
    """Another answer than the one that leads."""

    mechanisms: list[str] = Field(description="Names, or `nothing_missing`, or `none_of_these`.")
    probability: float = Field(description="Its posterior, 0 to 1.")
    why_not: str = Field(description="What speaks against it, in words.")


class NotIdentifiable(BaseModel):
    """A mechanism that these recordings cannot tell from something else."""

    mechanism: str = Field(description="Its name.")
    confounded_with: str = Field(description="What it looks like here: another mechanism, `d33` or `noise`.")
    reason: str = Field(description="Why, in words.")


class ReportFinding(BaseModel):
    """Something that looks wrong in the data, or limits the answer."""

    code: FindingCode = Field(description="The kind of finding; docs/findings.md explains each.")
    recording: str = Field(description="Id of the recording; empty for the whole campaign.")
    field: str = Field(description="The field that it is about.")
    statement: str = Field(description="The finding in words.")


class Idealised(BaseModel):
    """A law without a free parameter, with even odds beside its absence."""

    name: str = Field(description="Its name.")
    probability: float = Field(description="Posterior that it is there, summed over the answers.")
    effect_percent: float | None = Field(description="What it changes of the response, root mean square [%].")


class Remainder(BaseModel):
    """What an explanation of curves leaves beyond the noise."""

    percent: float = Field(description="Its size in percent of the largest force [%].")
    over_noise: float = Field(description="Its size over a sample's noise [-].")
    axis: str = Field(description="The axis along which it was looked for.", examples=["displacement_mm"])
    statement: str = Field(description="The same in words, with the place where it is largest.")


class Power(BaseModel):
    """What the campaign could have seen of a mechanism."""

    mechanism: str = Field(description="Its name.")
    smallest_visible_percent: float | None = Field(
        description="The smallest change of the charge by which it would have been named [%]."
    )


class RelativeInterval(BaseModel):
    """A 95 % interval for comparisons."""

    low: float = Field(description="Its lower end.")
    high: float = Field(description="Its upper end.")


class ReportD33(BaseModel):
    """d33, averaged over the answers that remain, with their probabilities."""

    name: Literal["d33"] | None = Field(default=None, description="What it is.")
    unit: str | None = Field(default=None, description="Of the three numbers.", examples=["pC/N"])
    value: float | None = Field(default=None, description="Its median.")
    low: float | None = Field(default=None, description="Lower end of its 95 % interval, tolerances included.")
    high: float | None = Field(default=None, description="Upper end of its 95 % interval, tolerances included.")
    relative: RelativeInterval | None = Field(
        default=None,
        description="The same without what the declared values may be off by: to compare sensors or dates.",
    )
    quotable: bool = Field(description="Whether one answer stands, fits to the noise, and nothing hidden moves d33.")
    why_not: str | None = Field(
        default=None, description="Why it is not to be quoted, as d33 of several campaigns never is."
    )
    per_sensor: list[SensorLevel] | None = Field(
        default=None, description="Of several campaigns: one entry a campaign and sensor."
    )
    per_campaign: list[CampaignLevel] | None = Field(
        default=None, description="Of several campaigns: the array's, over the sensors that they share."
    )
    per_skin: list[SkinValue] | None = Field(default=None, description="Of a fleet: one entry a skin.")


class PlannedRecording(BaseModel):
    """A recording to make next; beside these, any axis of the campaign may be stated."""

    model_config = ConfigDict(extra="allow")

    sensor: str = Field(description="Id of the sensor to press.")
    indenter_radius_mm: float = Field(description="Radius of the sphere [mm].")
    preload_n: float = Field(description="Static force [N].")
    dynamic_force_n: float = Field(description="Peak amplitude of the oscillating force [N].")
    position_mm: list[float] | None = Field(default=None, description="Place of the sphere, x and y [mm].")
    dwell_s: float | None = Field(default=None, description="How long to hold the preload before [s].")
    load_cycles: float | None = Field(default=None, description="Load cycles that the skin has seen [-].")
    repeats: int = Field(description="How often to record this.")


class NextExperiment(BaseModel):
    """The recordings that would best tell what is still open apart."""

    recordings: list[PlannedRecording] = Field(description="In this order; empty where none would help.")
    separates: list[list[str]] = Field(description="The sets of mechanisms that they tell apart.")
    probability_of_deciding: float = Field(description="Probability that they settle it, 0 to 1.")
    without_it: float = Field(description="Probability that the leader is right without them, 0 to 1.")
    minutes: float = Field(description="How long they take [min].")
    statement: str = Field(description="The same in words.")


class Report(BaseModel):
    """The result of a diagnosis (`report/1`)."""

    document: Literal["report/1"] = Field(alias="schema", description="The format.")
    campaign: str = Field(description="Name of the campaign; of several, what they are called together.")
    campaigns: list[str] | None = Field(default=None, description="Of several: the names of all.")
    verdict: Verdict = Field(description="What the probabilities say; docs/diagnosis.md explains each.")
    probability: float = Field(description="Posterior of the stated answer, 0 to 1.")
    headline: str | None = Field(default=None, description="The result with its number in at most 20 words.")
    statement: str = Field(description="The result in up to three sentences.")
    location: Location = Field(description="Where recordings and the paper's model differ.")
    mechanisms: list[ReportMechanism] = Field(description="The set of mechanisms that leads.")
    presence: list[PresentGroup] = Field(description="Groups of mechanisms, the most probable first.")
    unnamed: UnnamedLaw | None = Field(description="Of `unexplained`: the law that describes the misfit best.")
    alternatives: list[Alternative] = Field(description="Other answers, the most probable first.")
    idealised: list[Idealised] | None = Field(
        default=None, description="Laws without a free parameter that declared facts say and the base model leaves out."
    )
    not_identifiable: list[NotIdentifiable] = Field(description="What these recordings cannot tell.")
    findings: list[ReportFinding] = Field(description="What looks wrong in the data, or limits the answer.")
    fit: Fit | None = Field(description="How much better the recordings are described; null of several campaigns.")
    remainder: Remainder | None = Field(
        default=None, description="Of curves: what the explanation leaves beyond the noise; null where nothing does."
    )
    power: list[Power] = Field(description="What the campaign could have seen.")
    d33: ReportD33 | None = Field(description="d33 of the sensors; null of curves and where nothing can be concluded.")
    by_kind: list[KindParameter] | None = Field(
        default=None, description="Of several kinds of recordings: what each alone tells."
    )
    contradictions: list[Contradiction] | None = Field(
        default=None, description="Of several kinds of recordings: where they contradict one another."
    )
    population: list[Population] | None = Field(default=None, description="Of a fleet: each quantity over its skins.")
    next_experiment: NextExperiment | None = Field(description="What to record next; null where all is decided.")
    provenance: Provenance = Field(description="What it was made with.")
