"""d33 of a campaign's sensors, and the modulus of its elastomer. Written by scripts/client_documents.py."""

from dataclasses import dataclass
from typing import Literal

from underskin.client.documents.document import Document


@dataclass(frozen=True, eq=False, kw_only=True)
class Band(Document):
    """The lines that were averaged."""

    low_hz: float
    """From here [Hz]."""

    high_hz: float
    """To here, included [Hz]."""

    reason: str
    """Why this band."""

    chosen_by_user: bool
    """Whether the request named it."""

    left_out_hz: tuple[float, ...]
    """Lines inside it that were not averaged, such as mains pick-up [Hz]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CellD33(Document):
    """d33 of one sensor under one indenter and preload."""

    d33_pc_per_n: float | None
    """d33 [pC/N]; null where no recording can be used."""

    d33_uncertainty_pc_per_n: float | None
    """Its standard uncertainty [pC/N]."""

    d33_low_pc_per_n: float | None
    """Lower end of its 95 % interval [pC/N]."""

    d33_high_pc_per_n: float | None
    """Upper end of its 95 % interval [pC/N]."""

    sensor: str
    """Its id."""

    indenter_radius_mm: float
    """Radius of the sphere [mm]."""

    preload_n: float
    """Static force [N]."""

    recordings: int
    """How many recordings it comes from."""


@dataclass(frozen=True, eq=False, kw_only=True)
class D33Value(Document):
    """d33 with its uncertainty."""

    d33_pc_per_n: float | None
    """d33 [pC/N]; null where no recording can be used."""

    d33_uncertainty_pc_per_n: float | None
    """Its standard uncertainty [pC/N]."""

    d33_low_pc_per_n: float | None
    """Lower end of its 95 % interval [pC/N]."""

    d33_high_pc_per_n: float | None
    """Upper end of its 95 % interval [pC/N]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Scatter(Document):
    """A scatter that the recordings show."""

    value: float
    """Its estimate."""

    low: float
    """Lower end of its 95 % interval."""

    high: float
    """Upper end of its 95 % interval."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SensorFlag(Document):
    """Something that makes a sensor stand out."""

    code: str
    """What, in one word."""

    reason: str
    """What shows it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SensorD33(Document):
    """d33 of one sensor, over all indenters and preloads."""

    d33_pc_per_n: float | None
    """d33 [pC/N]; null where no recording can be used."""

    d33_uncertainty_pc_per_n: float | None
    """Its standard uncertainty [pC/N]."""

    d33_low_pc_per_n: float | None
    """Lower end of its 95 % interval [pC/N]."""

    d33_high_pc_per_n: float | None
    """Upper end of its 95 % interval [pC/N]."""

    sensor: str
    """Its id."""

    flags: tuple[SensorFlag, ...]
    """Where it stands out."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Modulus(Document):
    """What a recording of kind `compression` or `indentation` says of the elastomer."""

    recording: str
    """The recording."""

    kind: Literal["compression", "indentation"]
    """Its kind."""

    youngs_modulus_mpa: float
    """Young's modulus of the elastomer [MPa]."""

    youngs_modulus_uncertainty_mpa: float
    """Its standard uncertainty [MPa] by noise and curvature alone, not friction, size or calibration."""

    statement: str
    """Where the curve is straight, or how well Hertz' law fits it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LeftOut(Document):
    """Something that the figures do without."""

    recording: str | None
    """The recording; null where the reason names what is meant."""

    reason: str
    """Why."""


@dataclass(frozen=True, eq=False, kw_only=True)
class D33(Document):
    """d33 of a campaign's sensors, and the modulus of its elastomer where that was recorded."""

    campaign_id: str
    """The campaign."""

    table_sha256: str
    """SHA-256 of the table of σ."""

    model: Literal["paper", "adopted"] | None
    """The model that the figures rest on."""

    model_id: str | None
    """Which adopted model."""

    model_percent: float | None
    """Standard deviation of all d33 together by an adopted model's parameters; not in intervals."""

    status: Literal["ok", "none"]
    """`none`: no d33 can be told from it; `reason` says why."""

    reason: str | None
    """Why there is none."""

    band: Band | None
    """The lines that were averaged."""

    array: D33Value | None
    """d33 of the array, mean of the sensors that are not flagged as unfit; its uncertainty and interval include
    `declared_percent`."""

    array_relative: D33Value | None
    """The same without `declared_percent`: to compare it with its sensors and with other dates."""

    array_solved: D33Value | None
    """`array` in contact with the layer itself, where it differs from the paper's by more than 1 %; null elsewhere,
    and under an adopted model, whose diagnosis decided."""

    sensor_spread_percent: Scatter | None
    """Standard deviation of d33 over the sensors."""

    gain_scatter_percent: Scatter | None
    """Standard deviation of a recording's gain."""

    position_scatter_mm: Scatter | None
    """Standard deviation of the sphere's position, each axis [mm]."""

    declared_percent: float | None
    """Standard deviation of all d33 together by the skin's `tolerances`; in the interval of `array`, not in those
    of sensors and cells, which are relative to each other."""

    sensors: tuple[SensorD33, ...]
    """One entry a sensor that was recorded."""

    cells: tuple[CellD33, ...]
    """One entry a sensor, indenter and preload that was recorded."""

    moduli: tuple[Modulus, ...]
    """One entry a recording of the elastomer alone."""

    findings: tuple[str, ...]
    """What looked wrong and was used all the same, such as C/N taken for pC/N or a time still to come."""

    left_out: tuple[LeftOut, ...]
    """What the figures do without."""
