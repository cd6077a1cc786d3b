"""Wrong units among the recordings: a force in kN, a sphere in m or a frequency in kHz where others are not.

A recording with a single such value is left out. A dynamic force that is far too small in all recordings is a finding.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.units import Mask

_SLIP, _WITHIN = 1000.0, 3.0  # a corrected value must be within this factor of the others
_MOST_SHARE = 0.25  # of the recordings at most, or one of three
_FEW = 4  # recordings below which the others must agree within the same factor
_FAINT = 5e-4  # dynamic force over preload


@dataclass(frozen=True)
class _Field:
    """A field whose values are compared between recordings, and the units that cause its errors."""

    name: str
    of: Callable[[FrfRecording], float]
    too_large: str
    too_small: str


_FIELDS = (
    _Field("preload_n", lambda recording: recording.preload_n, "mN", "kN"),
    _Field("dynamic_force_n", lambda recording: recording.dynamic_force_n, "mN", "kN"),
    _Field("indenter_radius_mm", lambda recording: recording.indenter_radius_mm, "µm", "m"),
    _Field("frequency_hz", lambda recording: float(np.median(lines_of(recording).frequency)), "mHz", "kHz"),
)


def single_unit_errors(recordings: Sequence[FrfRecording]) -> tuple[Mask, list[Finding]]:
    """Which recordings have a value off all others by a factor of about 1000, and the findings on them."""
    off = np.zeros(len(recordings), dtype=bool)
    findings: list[Finding] = []
    if not recordings:
        return off, findings
    for field in _FIELDS:
        values = np.array([field.of(recording) for recording in recordings])
        usual = float(np.median(values))
        for factor, unit in ((_SLIP, field.too_large), (1 / _SLIP, field.too_small)):
            far = values / usual > _SLIP / 30 if factor > 1 else values / usual < 30 / _SLIP
            if not far.any() or far.sum() > max(_MOST_SHARE * len(recordings), 1.0) or len(recordings) < 3:
                continue
            others = values[~far]
            if len(recordings) < _FEW and others.max() > _WITHIN * others.min():
                continue
            corrected = values / factor
            plausible = far & (corrected > others.min() / _WITHIN) & (corrected < others.max() * _WITHIN)
            for index in np.flatnonzero(plausible & ~off).tolist():
                arguments = {"value": float(values[index]), "too_large": factor > 1, "given_in": unit}
                findings.append(Finding(Reason.BESIDE_OTHERS, recordings[index].id, field.name, arguments))
            off |= plausible
    return off, findings


def faint_oscillation(recordings: Sequence[FrfRecording]) -> list[Finding]:
    """The finding on a negligible dynamic force, as one given in kN; only laws of large amplitudes use it."""
    ratio = max(recording.dynamic_force_n / recording.preload_n for recording in recordings)
    if ratio > _FAINT:
        return []
    return [Finding(Reason.DYNAMIC_FORCE_SMALL, "", "dynamic_force_n", {"ratio": ratio})]
