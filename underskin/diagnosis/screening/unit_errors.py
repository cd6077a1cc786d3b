"""Slips of units among the recordings: a force in kN, a sphere in m, a frequency in kHz, beside the others'.

A value that is alone is left out with its recording. Forces that contradict each other in all recordings are named.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underskin.recordings.campaign import FrfRecording
from underskin.recordings.finding import Finding
from underskin.recordings.frf.estimation import lines_of

_SLIP, _WITHIN = 1000.0, 3.0  # a value is back among the others, within this factor, once the slip is undone
_ALONE = 0.25  # of the recordings at most, or one of three
_FEW = 4  # recordings below which the others must agree, each within the same factor
_FAINT = 5e-4  # dynamic force over preload


@dataclass(frozen=True)
class _Field:
    """A field whose values can be held against each other, and the units that its slips come from."""

    name: str
    of: Callable[[FrfRecording], float]
    too_large: str
    too_small: str


_FIELDS = (
    _Field("preload_n", lambda entry: entry.preload_n, "mN", "kN"),
    _Field("dynamic_force_n", lambda entry: entry.dynamic_force_n, "mN", "kN"),
    _Field("indenter_radius_mm", lambda entry: entry.indenter_radius_mm, "µm", "m"),
    _Field("frequency_hz", lambda entry: float(np.median(lines_of(entry).frequency)), "mHz", "kHz"),
)


def lone_slips(entries: Sequence[FrfRecording], found: list[Finding]) -> NDArray[np.bool_]:
    """Which recordings have a value about 1000 × off all others; each is named."""
    off = np.zeros(len(entries), dtype=bool)
    if not entries:
        return off
    for field in _FIELDS:
        values = np.array([field.of(entry) for entry in entries])
        usual = float(np.median(values))
        for factor, unit, word in ((_SLIP, field.too_large, "large"), (1 / _SLIP, field.too_small, "small")):
            far = values / usual > _SLIP / 30 if factor > 1 else values / usual < 30 / _SLIP
            if not far.any() or far.sum() > max(_ALONE * len(entries), 1.0) or len(entries) < 3:
                continue
            others = values[~far]
            if len(entries) < _FEW and others.max() > _WITHIN * others.min():
                continue
            meant = values / factor
            back = far & (meant > others.min() / _WITHIN) & (meant < others.max() * _WITHIN)
            for number in np.flatnonzero(back & ~off).tolist():
                text = f"{values[number]:g} looks 1000 × too {word} beside the others: was it given in {unit}? Left out"
                found.append(Finding("units_off_by_1000", entries[number].id, field.name, text))
            off |= back
    return off


def loose_sphere(entries: Sequence[FrfRecording]) -> list[Finding]:
    """A dynamic force that reaches the preload in all recordings, so that the sphere would leave the skin."""
    if any(entry.dynamic_force_n < entry.preload_n for entry in entries):
        return []
    text = (
        "the dynamic force reaches the preload in all recordings, so the sphere would leave the skin: was it given in "
        "mN, or the preload in kN?"
    )
    return [Finding("units_off_by_1000", "", "dynamic_force_n", text)]


def faint_oscillation(entries: Sequence[FrfRecording]) -> list[Finding]:
    """A dynamic force that is hardly there, as one in kN would be; only the laws of large amplitudes use it."""
    ratio = max(entry.dynamic_force_n / entry.preload_n for entry in entries)
    if ratio > _FAINT:
        return []
    text = (
        f"it is at most {ratio:.1g} of the preload: it looks 1000 × too small; was it given in kN, or the preload in "
        "mN?"
    )
    return [Finding("units_off_by_1000", "", "dynamic_force_n", text)]
