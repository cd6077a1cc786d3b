"""A skin pressed by a sphere, in columns, and what reaches its sensor: what `/v1/frf` and `/v1/d33` take and answer."""

from typing import ClassVar, Literal

from pydantic import Field

from service.schemas.columns import (
    AnswerInColumns,
    ColumnsRequest,
    FindingModel,
    NonNegative,
    Numbers,
    NumbersPerRow,
    Positive,
    Signed,
)
from underskin.surrogate.sigma_table import ContactName

FIELDS = ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio", "indenter_radius_mm", "preload_n")
ADOPTED_COLUMNS = ("offset_x_mm", "offset_y_mm", "dynamic_force_n", "dwell_s", "load_cycles")


class PressedSkinColumns(ColumnsRequest):
    """A skin pressed by a sphere."""

    constants: ClassVar[frozenset[str]] = frozenset({"model", "contact", "skin_id", "sensor", "units_checked"})

    thickness_mm: Positive = Field(description="Thickness h of the layer over the sensors [mm].")
    youngs_modulus_mpa: Positive = Field(description="Young's modulus E of the layer [MPa].")
    sensor_radius_mm: Positive = Field(description="Radius rT of a sensor [mm].")
    poisson_ratio: NonNegative = Field(
        default=0.5, description="Poisson's ratio ν, 0 to 0.5 [-]. Rows other than 0.5 are out_of_domain."
    )
    indenter_radius_mm: Positive = Field(description="Radius R of the sphere [mm].")
    preload_n: Positive = Field(description="Static force F [N].")
    model: Literal["paper", "adopted"] = Field(
        default="paper",
        description="`paper`: the base model, its contact by `contact`, flat FRF. `adopted`: the model adopted for "
        "`skin_id`.",
    )
    contact: ContactName = Field(
        default="paper",
        description="`paper`: Hertz radius on a half space, whose pressure the bonded layer bears as a dead load, with "
        "finite strain. `solved`: a sphere in frictionless contact with that layer itself, with finite strain. "
        "Left out with model adopted: the diagnosis decided.",
    )
    skin_id: str | None = Field(default=None, description="The skin whose adopted model is meant.")
    sensor: str | None = Field(
        default=None, description="The sensor pressed, the same in all rows; with an adopted model that needs it."
    )
    offset_x_mm: Signed | None = Field(
        default=None, description="The sphere's place from the sensor's centre, along x; with an adopted model [mm]."
    )
    offset_y_mm: Signed | None = Field(
        default=None, description="The sphere's place from the sensor's centre, along y; with an adopted model [mm]."
    )
    dynamic_force_n: Positive | None = Field(
        default=None, description="Amplitude of the oscillating force; with an adopted model that needs it [N]."
    )
    dwell_s: NonNegative | None = Field(
        default=None, description="Time the preload has been held; with an adopted model that needs it [s]."
    )
    load_cycles: NonNegative | None = Field(
        default=None, description="Load cycles the skin has seen; with an adopted model that needs it [-]."
    )
    units_checked: bool = Field(
        default=False, description="Accept magnitudes that look like a slip of units (2.5 m, 16 Pa)."
    )


class PressedSkinAnswer(AnswerInColumns):
    """What reaches the sensor, row by row."""

    model_id: str | None = Field(default=None, description="The adopted model that answered; only with that model.")
    contact: ContactName | None = Field(
        default=None, description="As asked; left out with an adopted model, whose diagnosis decided."
    )
    contact_radius_mm: list[float | None] = Field(
        description="Contact radius a: Hertz' radius, or that of the solved contact; null with an adopted model, whose "
        "contact may be another [mm]."
    )
    a_over_h: list[float | None] = Field(description="a/h; null with an adopted model [-].")
    rt_over_h: list[float | None] = Field(description="rT/h [-].")
    load_parameter: list[float | None] = Field(description="L = F/(R² E); null with an adopted model [-].")
    sigma: list[float | None] = Field(
        description="σ; of an adopted model the one that FRF = d33 · (3/2) (rT/h)² σ asks for on the plateau [-]."
    )
    rel_error: list[float | None] = Field(
        description="Bound on σ's relative error; of an adopted model its relative standard uncertainty within the "
        "range of the campaign that was diagnosed [-]."
    )
    mean_stress_mpa: list[float | None] = Field(
        description="Static mean stress on the sensor, 3Fσ/(2πh²), positive in compression; null with an adopted "
        "model [MPa]."
    )


class FrfColumns(PressedSkinColumns):
    """The skin, the sphere and d33, in columns."""

    lists: ClassVar[frozenset[str]] = frozenset({"frequency_hz"})

    d33_pc_per_n: Signed = Field(description="Piezoelectric coefficient d33 of the sensor [pC/N], not 0.")
    frequency_hz: Numbers | None = Field(
        default=None,
        min_length=1,
        description="Frequencies of the spectra, the same for all rows [Hz]. The paper's model is flat and real; an "
        "adopted one that depends on frequency needs them.",
    )


class FrfAnswer(PressedSkinAnswer):
    """The FRF in columns."""

    frf_pc_per_n: list[float | None] = Field(
        description="FRF on the plateau, charge over force; of an adopted model without its dynamics [pC/N]."
    )
    frequency_hz: list[float] | None = Field(default=None, description="As asked, if it was [Hz].")
    frf_re_pc_per_n: list[list[float | None]] | None = Field(
        default=None, description="Real part, rows × frequencies; only with `frequency_hz` [pC/N]."
    )
    frf_im_pc_per_n: list[list[float | None]] | None = Field(
        default=None, description="Imaginary part (e^(+iωt)), rows × frequencies; only with `frequency_hz` [pC/N]."
    )


class D33Columns(PressedSkinColumns):
    """The skin, the sphere and the measured FRF: plateau values, or lines with a band to average over."""

    lists: ClassVar[frozenset[str]] = frozenset({"frequency_hz", "band_hz", "frf_re_pc_per_n", "frf_im_pc_per_n"})

    frf_pc_per_n: Signed | None = Field(
        default=None, description="Measured FRF on the plateau, real part [pC/N]; or give lines."
    )
    frf_uncertainty_pc_per_n: NonNegative | None = Field(
        default=None,
        description="Standard uncertainty of the plateau [pC/N]. Left out: unknown, so that d33's is null; for lines "
        "the standard error of their mean, which does not see the gain error that lines of one recording share.",
    )
    frequency_hz: Numbers | None = Field(
        default=None, min_length=1, description="Frequencies of the lines, the same for all rows [Hz]."
    )
    frf_re_pc_per_n: NumbersPerRow | None = Field(
        default=None, min_length=1, description="Real part of the FRF, rows × lines [pC/N]."
    )
    frf_im_pc_per_n: NumbersPerRow | None = Field(
        default=None,
        min_length=1,
        description="Imaginary part, rows × lines [pC/N]; its mean is answered, and used only with an adopted model "
        "that depends on frequency.",
    )
    band_hz: Numbers | None = Field(
        default=None, min_length=2, max_length=2, description="Lowest and highest frequency averaged over [Hz]."
    )


class D33Answer(PressedSkinAnswer):
    """d33 in columns."""

    frf_pc_per_n: list[float | None] = Field(
        description="The plateau that was inverted; of an adopted model what a plateau would show [pC/N]."
    )
    frf_uncertainty_pc_per_n: list[float | None] = Field(description="Its standard uncertainty [pC/N].")
    frf_im_pc_per_n: list[float | None] | None = Field(
        default=None, description="Mean imaginary part over the band, where given [pC/N]."
    )
    d33_pc_per_n: list[float | None] = Field(description="d33 = FRF / ((3/2) (rT/h)² σ) [pC/N].")
    d33_uncertainty_pc_per_n: list[float | None] = Field(
        description="Standard uncertainty: the FRF's and the table's, in quadrature; null without the FRF's [pC/N]."
    )
    findings: list[FindingModel] = Field(
        description="Measured values that look wrong, such as C/N taken for pC/N, and a d33 that no sensors have; "
        "they are used all the same."
    )
