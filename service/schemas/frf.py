"""FRF in columns."""

from typing import ClassVar

from pydantic import Field

from service.schemas.columns import Numbers, Signed
from service.schemas.pressed_skin import PressedSkinAnswer, PressedSkinColumns


class FrfColumns(PressedSkinColumns):
    """The skin, the sphere and d33, in columns."""

    json_only: ClassVar[frozenset[str]] = frozenset({"frequency_hz"})

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
