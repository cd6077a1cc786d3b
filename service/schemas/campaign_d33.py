"""What is answered on the d33 of a campaign."""

from typing import Literal

from pydantic import BaseModel, Field

# Raised whenever the fields below, or the figures that underskin.inversion and underskin.recordings put into them,
# change: what an earlier version kept is then computed anew.
ANSWER_VERSION = 8


class D33Value(BaseModel):
    """d33 with its uncertainty."""

    d33_pc_per_n: float | None = Field(description="d33 [pC/N]; null where no recording can be used.")
    d33_uncertainty_pc_per_n: float | None = Field(description="Its standard uncertainty [pC/N].")
    d33_low_pc_per_n: float | None = Field(description="Lower end of its 95 % interval [pC/N].")
    d33_high_pc_per_n: float | None = Field(description="Upper end of its 95 % interval [pC/N].")


class Scatter(BaseModel):
    """A scatter that the recordings show."""

    value: float = Field(description="Its estimate.")
    low: float = Field(description="Lower end of its 95 % interval.")
    high: float = Field(description="Upper end of its 95 % interval.")


class Band(BaseModel):
    """The lines that were averaged."""

    low_hz: float = Field(description="From here [Hz].")
    high_hz: float = Field(description="To here, included [Hz].")
    reason: str = Field(description="Why this band.")
    chosen_by_user: bool = Field(description="Whether the request named it.")
    left_out_hz: list[float] = Field(description="Lines inside it that were not averaged, such as mains pick-up [Hz].")


class SensorFlag(BaseModel):
    """Why a sensor is marked."""

    code: str = Field(description="What, in one word.", examples=["weak"])
    reason: str = Field(description="What shows it.")


class SensorD33(D33Value):
    """d33 of one sensor, over all indenters and preloads."""

    sensor: str = Field(description="Its id.")
    flags: list[SensorFlag] = Field(description="Why it is marked; empty where it is not.")


class CellD33(D33Value):
    """d33 of one sensor under one indenter and preload."""

    sensor: str = Field(description="Its id.")
    indenter_radius_mm: float = Field(description="Radius of the sphere [mm].")
    preload_n: float = Field(description="Static force [N].")
    recordings: int = Field(description="How many recordings it comes from.")


class LeftOut(BaseModel):
    """Something that the figures do without."""

    recording: str | None = Field(description="The recording; null for a sensor, which the reason names.")
    reason: str = Field(description="Why.")


class Modulus(BaseModel):
    """What a recording of kind `compression` or `indentation` says of the elastomer."""

    recording: str = Field(description="The recording.")
    kind: Literal["compression", "indentation"] = Field(description="Its kind.")
    youngs_modulus_mpa: float = Field(description="Young's modulus of the elastomer [MPa].")
    youngs_modulus_uncertainty_mpa: float = Field(
        description="Its standard uncertainty [MPa] by noise and curvature alone, not friction, size or calibration."
    )
    statement: str = Field(description="Where the curve is straight, or how well Hertz' law fits it.")


class D33(BaseModel):
    """d33 of a campaign's sensors, and the modulus of its elastomer where that was recorded."""

    campaign_id: str = Field(description="The campaign.")
    table_sha256: str = Field(description="SHA-256 of the table of σ.")
    model: Literal["paper", "adopted"] = Field(default="paper", description="The model that the figures rest on.")
    model_id: str | None = Field(default=None, description="Which adopted model.")
    model_percent: float | None = Field(
        default=None,
        description="Standard deviation of all d33 together by an adopted model's parameters; not in intervals.",
    )
    status: Literal["ok", "none"] = Field(description="`none`: it has no d33; `reason` says why.")
    reason: str | None = Field(description="Why there is none.")
    band: Band | None = Field(description="The lines that were averaged.")
    array: D33Value | None = Field(
        description="d33 of the array, mean of the sensors that are not flagged as unfit; its uncertainty and interval "
        "include `declared_percent`."
    )
    array_relative: D33Value | None = Field(
        description="The same without `declared_percent`: to compare it with its sensors and with other dates."
    )
    array_solved: D33Value | None = Field(
        default=None,
        description="`array` in contact with the layer itself, where it differs from the paper's by more than 1 %; "
        "null elsewhere, and under an adopted model, whose diagnosis decided.",
    )
    sensor_spread_percent: Scatter | None = Field(description="Standard deviation of d33 over the sensors.")
    gain_scatter_percent: Scatter | None = Field(description="Standard deviation of a recording's gain.")
    position_scatter_mm: Scatter | None = Field(
        description="Standard deviation of the sphere's position, each axis [mm]."
    )
    declared_percent: float | None = Field(
        description="Standard deviation of all d33 together by the skin's `tolerances`; in the interval of `array`, "
        "not in those of sensors and cells, which are relative to each other."
    )
    sensors: list[SensorD33] = Field(description="One entry a sensor that was recorded.")
    cells: list[CellD33] = Field(description="One entry a sensor, indenter and preload that was recorded.")
    moduli: list[Modulus] = Field(description="One entry a recording of the elastomer alone.")
    findings: list[str] = Field(
        description="What looked wrong and was used all the same, such as C/N taken for pC/N or a time still to come."
    )
    left_out: list[LeftOut] = Field(description="What the figures do without.")
