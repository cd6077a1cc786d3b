"""d33 from measured FRF, in columns."""

from typing import ClassVar

from pydantic import Field

from service.schemas.columns import NonNegative, Numbers, NumbersPerRow, Signed
from service.schemas.columns_answer import FindingModel
from service.schemas.pressed_skin import PressedSkinAnswer, PressedSkinColumns


class D33Columns(PressedSkinColumns):
    """The skin, the sphere and the measured FRF: plateau values, or lines with a band to average over."""

    json_only: ClassVar[frozenset[str]] = frozenset({"frequency_hz", "band_hz", "frf_re_pc_per_n", "frf_im_pc_per_n"})

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
