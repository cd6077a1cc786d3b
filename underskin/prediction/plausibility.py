"""Findings on an implausible d33 from measured values: impossible magnitudes and reversed signs.

The d33 is answered all the same: a wrong gain or unit changes every value alike, and the fit cannot detect it.
"""

from collections.abc import Iterator

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.sentences import ImplausibleD33
from underskin.units import LAB, Floats, Mask, unit_guess, unusual

_LEAST_D33, _MOST_D33 = 0.05, 1000.0  # pC/N: range of all reported sensors of skins
OF_PVDF = 1.0, 100.0  # pC/N: PVDF and its copolymers have 10 to 40


def of_array(reason: Reason, d33: float, *, units_checked: bool) -> list[Finding]:
    """A finding, for this reason, on an implausible d33 of an array [pC/N]."""
    implausible = implausibility(d33, units_checked=units_checked)
    units = unit_guess("d33_pc_per_n", d33, OF_PVDF).units if implausible is ImplausibleD33.NOT_PVDF else ()
    arguments = {"d33_pc_per_n": d33, "kind": implausible, "units": units}
    return [] if implausible is None else [Finding(reason, "", "d33_pc_per_n", arguments)]


def implausibility(d33: float, *, units_checked: bool = False) -> ImplausibleD33 | None:
    """Why PVDF cannot have a d33 [pC/N]; None of one that it may have, and where the units of another are checked."""
    implausible = next((implausible for implausible, rows in _implausible_rows(np.array(d33)).items() if rows), None)
    if implausible is not None or units_checked or OF_PVDF[0] <= d33 <= OF_PVDF[1]:
        return implausible
    return ImplausibleD33.NOT_PVDF


def of_rows(frf: Floats, d33: Floats) -> list[Finding]:
    """Findings on measured FRF and the resulting d33 (rows,) [pC/N]: the first row of each kind.

    A row with a finding on its FRF has none on its d33.
    """
    likely = LAB["frf_pc_per_n"].likely
    assert likely is not None
    usual = (np.abs(frf) >= likely[0]) & (np.abs(frf) <= likely[1])
    return [*unusual("frf_pc_per_n", frf), *_first(np.where(usual, d33, np.nan))]


def _first(d33: Floats) -> Iterator[Finding]:
    for implausible, rows in _implausible_rows(d33).items():
        if rows.any():
            first = int(np.argmax(rows))
            arguments = {"d33_pc_per_n": float(d33.flat[first]), "kind": implausible, "more": int(rows.sum()) - 1}
            yield Finding(Reason.D33_OF_ROW, "", "d33_pc_per_n", arguments, index=first if d33.ndim else None)


def _implausible_rows(d33: Floats) -> dict[ImplausibleD33, Mask]:
    """Which entries [pC/N] are doubtful; none where there is no value (NaN)."""
    size = np.abs(d33)
    return {
        ImplausibleD33.TOO_LARGE: size > _MOST_D33,
        ImplausibleD33.TOO_SMALL: size < _LEAST_D33,
        ImplausibleD33.NEGATIVE: d33 < 0,
    }
