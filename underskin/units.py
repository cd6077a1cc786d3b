"""Lab units at the boundary, SI inside: the only place of conversion.

A boundary field carries its unit in its name (`thickness_mm`). `LAB` lists every such field with its unit, its
factor to SI and the range of magnitudes that are likely in a piezoelectric skin's lab. `checked` rejects values that
are not finite, not positive, or of unlikely magnitude, and guesses the intended unit.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underskin.errors import UNITS_CHECKED, ErrorCode, InvalidInput, Requirement
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.sentences import UnitGuess

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Array = NDArray[Any]  # float64 or complex128
Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class LabField:
    """A field in lab units: SI value = number × `to_si`; `likely` bounds the number's magnitude."""

    name: str
    unit: str
    to_si: float
    likely: tuple[float, float] | None = None
    signed: bool = False


LAB: dict[str, LabField] = {
    field.name: field
    for field in (
        LabField("thickness_mm", "mm", 1e-3, (0.01, 100.0)),
        LabField("youngs_modulus_mpa", "MPa", 1e6, (1e-3, 1e4)),
        LabField("sensor_radius_mm", "mm", 1e-3, (0.01, 100.0)),
        LabField("indenter_radius_mm", "mm", 1e-3, (0.05, 1000.0)),
        LabField("width_mm", "mm", 1e-3, (0.1, 10000.0)),
        LabField("length_mm", "mm", 1e-3, (0.1, 10000.0)),
        LabField("sample_height_mm", "mm", 1e-3, (0.1, 1000.0)),
        LabField("sample_diameter_mm", "mm", 1e-3, (0.1, 1000.0)),
        LabField("displacement_mm", "mm", 1e-3, signed=True),
        LabField("force_n", "N", 1.0, signed=True),
        LabField("charge_pc", "pC", 1e-12, signed=True),
        LabField("preload_n", "N", 1.0, (1e-3, 1e3)),
        LabField("d33_pc_per_n", "pC/N", 1e-12, (1e-2, 1e4), signed=True),
        LabField("frf_pc_per_n", "pC/N", 1e-12, (1e-4, 1e5), signed=True),
        LabField("frf_uncertainty_pc_per_n", "pC/N", 1e-12),
        LabField("frequency_hz", "Hz", 1.0),
        LabField("contact_radius_mm", "mm", 1e-3),
        LabField("mean_stress_mpa", "MPa", 1e6),
        LabField("d33_uncertainty_pc_per_n", "pC/N", 1e-12),
        LabField("dynamic_force_n", "N", 1.0),
        LabField("time_s", "s", 1.0),
        LabField("dwell_s", "s", 1.0),
        LabField("sample_rate_hz", "Hz", 1.0),
        LabField("frf_re_pc_per_n", "pC/N", 1e-12, signed=True),
        LabField("frf_im_pc_per_n", "pC/N", 1e-12, signed=True),
        LabField("x_mm", "mm", 1e-3, signed=True),
        LabField("y_mm", "mm", 1e-3, signed=True),
        LabField("charge_error_pc", "pC", 1e-12),
        LabField("normal_force_n", "N", 1.0, (1e-3, 1e3)),
        LabField("pressure_mpa", "MPa", 1e6, (1e-5, 100.0)),
        LabField("sigma_zz_mpa", "MPa", 1e6, signed=True),
        LabField("r_mm", "mm", 1e-3),
        LabField("depth_mm", "mm", 1e-3),
    )
}

GRAM_FORCE = 9.80665e-3  # N
POUND_FORCE = 4.4482216152605  # N
FORCES = {"mN": 1e-3, "µN": 1e-6, "kN": 1e3, "gf": GRAM_FORCE, "kgf": 1e3 * GRAM_FORCE, "lbf": POUND_FORCE}
_SAME_FORCE = 1.2  # largest ratio of two statements of one force
_FINER = {"mm": ("µm", "nm"), "N": ("mN", "µN", "nN", "pN")}  # each a thousandth of the one before
_LEAST_READABLE = 0.1  # of an axis' unit, below which its numbers are hard to read
_NEIGHBOURS = {
    "mm": {1e-3: "µm", 1e-6: "nm", 1e3: "m"},
    "MPa": {1e-3: "kPa", 1e-6: "Pa", 1e3: "GPa"},
    "N": {1e-3: "mN", 1e-6: "µN", 1e3: "kN"},
    "pC/N": {
        1e-3: "fC/N",
        1e3: "nC/N",
        1e6: "µC/N",
        1e12: "C/N",
        1 / GRAM_FORCE: "pC/gf",
        1e-3 / GRAM_FORCE: "pC/kgf",
        1 / POUND_FORCE: "pC/lbf",
    },
}
_AS_NEAR = 0.5  # decades: another unit that would make a number about as usual


def to_si(name: str, value: ArrayLike) -> Floats:
    """The SI value of a field given in lab units."""
    return np.asarray(value, dtype=float) * LAB[name].to_si


def to_lab(name: str, value: ArrayLike) -> Floats:
    """The lab-unit value of a field given in SI."""
    return np.asarray(value, dtype=float) / LAB[name].to_si


def readable_unit(name: str, largest: float) -> tuple[str, float]:
    """The unit in which values up to `largest` (lab unit) of a length or force are readable, and its number per lab
    unit.

    For 2e-5 N it is ("µN", 1e6). Zero is shown in the lab unit.
    """
    unit, count = LAB[name].unit, 1.0
    for finer in _FINER[unit]:
        if largest == 0 or largest * count >= _LEAST_READABLE:
            break
        unit, count = finer, 1e3 * count
    return unit, count


def checked(name: str, value: ArrayLike, *, units_checked: bool = False) -> Floats:
    """The SI value of a declared field in lab units, with every entry checked.

    Parameters
    ----------
    name : str
        A field of `LAB`.
    value : array_like
        In the field's lab unit.
    units_checked : bool
        Accept unlikely magnitudes.

    Returns
    -------
    ndarray
        SI, of the shape of `value`.

    Raises
    ------
    InvalidInput
        At the first entry that is not finite, is zero, is negative (unless the field may be: d33 has a sign), or has an
        unlikely magnitude.
    """
    field = LAB[name]
    values = np.asarray(value, dtype=float)
    size = np.abs(values) if field.signed else values
    positive = "finite and not zero" if field.signed else "finite and greater than 0"
    good = np.isfinite(values) & (size > 0)
    _refuse(name, values, ~good, f"must be {positive} ({field.unit})", ErrorCode.OUT_OF_RANGE)
    if field.likely is not None and not units_checked:
        low, high = field.likely
        unlikely = (size < low) | (size > high)
        if unlikely.any():
            first = float(size.flat[int(np.argmax(unlikely))])
            _refuse(name, values, unlikely, _likely_range(field, first), ErrorCode.UNLIKELY_MAGNITUDE)
    return values * field.to_si


def non_negative(name: str, values: Floats) -> Floats:
    """`values`; raises InvalidInput at the first row that is not finite or below 0."""
    good = np.isfinite(values) & (values >= 0)
    _refuse(name, values, ~good, "must be finite and at least 0", ErrorCode.OUT_OF_RANGE)
    return values


def finite(name: str, values: Floats) -> Floats:
    """`values`; raises InvalidInput at the first row that is not finite."""
    _refuse(name, values, ~np.isfinite(values), "must be finite", ErrorCode.NOT_FINITE)
    return values


def unusual(name: str, value: ArrayLike) -> list[Finding]:
    """The first element of a measured field whose magnitude suggests a wrong unit or a dead sensor, if any.

    Measured values are never rejected for their magnitude, unlike declared ones (`checked`).
    """
    field = LAB[name]
    values = np.asarray(value, dtype=float)
    assert field.likely is not None, f"{name} has no likely range"
    size = np.abs(values)
    unlikely = (size < field.likely[0]) | (size > field.likely[1])
    if not unlikely.any():
        return []
    first = int(np.argmax(unlikely))
    number = float(values.flat[first])
    more = int(unlikely.sum()) - 1
    arguments = {"value": number, "unit": field.unit, "guess": unit_guess(name, abs(number)), "more": more}
    return [Finding(Reason.UNUSUAL_MAGNITUDE, "", name, arguments, index=first if values.ndim else None)]


def _refuse(name: str, values: Floats, bad: Mask, allowed: str, code: ErrorCode) -> None:
    if bad.any():
        first = int(np.argmax(bad))
        row = int(np.unravel_index(first, values.shape)[0]) if values.ndim else None
        raise InvalidInput(name, float(values.flat[first]), allowed, index=row, code=code)


def _likely_range(field: LabField, size: float) -> Requirement:
    """The allowed range, and the unit that was probably intended."""
    assert field.likely is not None
    low, high = field.likely
    text = f"must be {low:g} to {high:g} {field.unit} in magnitude"
    return Requirement(text, UNITS_CHECKED, f"; {unit_guess(field.name, size)}")


def unit_guess(name: str, size: float, usual: tuple[float, float] | None = None) -> UnitGuess:
    """The wrong units that would explain a magnitude of a field outside its likely range, or a narrower one: those
    that bring it nearest to the (geometric) middle of the range."""
    field = LAB[name]
    low, high = usual or field.likely or (0.0, np.inf)
    if size == 0:
        return UnitGuess(size, field.unit)
    candidates = [
        (size * factor, unit) for factor, unit in _NEIGHBOURS[field.unit].items() if low <= size * factor <= high
    ]
    if candidates:
        return UnitGuess(size, field.unit, meant=_nearest(candidates, np.sqrt(low * high)))
    for power in (3, 6, 9, 12, -3, -6, -9, -12):
        if low <= size * 10.0**power <= high:
            return UnitGuess(size, field.unit, meant=((size * 10.0**power, ""),), off_by=-power)
    return UnitGuess(size, field.unit)


def force_unit(recorded_n: float, stated_n: float) -> UnitGuess | None:
    """The unit, other than N, in which a recorded force is the stated one; None where there is none."""
    ratios = {unit: abs(np.log(abs(recorded_n) * factor / stated_n)) for unit, factor in FORCES.items() if recorded_n}
    unit = min(ratios, key=ratios.__getitem__, default=None)
    if unit is None or ratios[unit] > np.log(_SAME_FORCE):
        return None
    return UnitGuess(recorded_n, "N", meant=((recorded_n * FORCES[unit], unit),))


def _nearest(candidates: Sequence[tuple[float, str]], middle: float) -> tuple[tuple[float, str], ...]:
    """The readings whose values lie nearest to the middle of a range, and those about as near."""
    off = [abs(float(np.log10(value / middle))) for value, _ in candidates]
    order = np.argsort(off, kind="stable").tolist()
    return tuple(candidates[index] for index in order if off[index] <= min(off) + _AS_NEAR)
