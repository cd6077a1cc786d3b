"""What looks wrong in a d33 that was found from measured values, in words: a size that no sensors have, a sign turned.

It is answered all the same: a gain or a unit that was taken wrongly moves every value alike, and the fit sees nothing.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from underskin.units import LAB, Finding, Floats, findings

_LEAST_D33, _MOST_D33 = 0.05, 1000.0  # pC/N: beyond these no skin's sensors have been
_OF_PVDF = 1.0, 100.0  # pC/N: PVDF and its copolymers have 10 to 40


def of_array(d33: float) -> Iterator[str]:
    """Of an array's d33 [pC/N]."""
    said = implausible(d33)
    if said is not None:
        yield f"d33 of the array is {d33:.3g} pC/N, {said}"


def implausible(d33: float) -> str | None:
    """What is to be said of a d33 [pC/N] that PVDF cannot have; None of one that it may have."""
    said = next((words for words, found in _slips(np.array(d33)).items() if found), None)
    if said is not None or _OF_PVDF[0] <= d33 <= _OF_PVDF[1]:
        return said
    return "which PVDF cannot have: it and its copolymers have 10 to 40"


def of_rows(frf: Floats, d33: Floats) -> list[Finding]:
    """Of measured FRF and the d33 that they mean, a row each [pC/N]: the first row of each slip.

    A row whose FRF is named already is not named for its d33 as well.
    """
    likely = LAB["frf_pc_per_n"].likely
    assert likely is not None
    usual = (np.abs(frf) >= likely[0]) & (np.abs(frf) <= likely[1])
    return [*findings("frf_pc_per_n", frf), *_first(np.where(usual, d33, np.nan))]


def _first(d33: Floats) -> Iterator[Finding]:
    for words, found in _slips(d33).items():
        if found.any():
            first, count = int(np.argmax(found)), int(found.sum())
            others = f" ({count - 1} more rows like it)" if count > 1 else ""
            statement = f"d33 is {d33.flat[first]:.3g} pC/N, {words}{others}"
            yield Finding("d33_pc_per_n", first if d33.ndim else None, statement)


def _slips(d33: Floats) -> dict[str, NDArray[np.bool_]]:
    """Which entries [pC/N] each slip would explain; none where there is no value (NaN)."""
    size = np.abs(d33)
    return {
        "more than sensors have: was mV/pC meant, not mV/nC, or N, not mN, or fC, not pC?": size > _MOST_D33,
        "less than sensors have: was mV/nC meant, not mV/pC, or mN, not N, or nC, not pC?": size < _LEAST_D33,
        "negative: is the sign of charge or force turned?": d33 < 0,
    }
