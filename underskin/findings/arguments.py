"""Arguments of findings that are more than a number or a name."""

from dataclasses import dataclass
from enum import StrEnum


@dataclass(frozen=True)
class UnitGuess:
    """The slip of units that brings an unusual magnitude back to what is usual.

    `size` in the field's `unit` becomes each of `meant`, a value in that unit, if it was given in the unit beside the
    value; or the only one, without a unit, if it is off by ten to the power of `off_by`. Without any no slip explains
    it; a size of 0 is a measured value of 0.
    """

    size: float
    unit: str
    meant: tuple[tuple[float, str], ...] = ()
    off_by: int = 0


class ImplausibleD33(StrEnum):
    """Why a d33 is implausible."""

    TOO_LARGE = "too_large"
    TOO_SMALL = "too_small"
    NEGATIVE = "negative"
    NOT_PVDF = "not_pvdf"


class DefectKind(StrEnum):
    """What is wrong with a run of samples."""

    OVERLOAD = "overload"
    HELD_SAMPLES = "held_samples"
    JUMP = "jump"
