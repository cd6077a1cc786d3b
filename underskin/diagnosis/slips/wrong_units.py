"""Wrong units among the recordings: a force in kN, a sphere in m, a frequency in kHz, a charge in nC.

Values that are meant alike differ by ln 1 ± 1 from the median of all, and those in a neighbouring unit by ln 1000 more
or less. Recordings with such a value are left out.
"""

from collections.abc import Iterator, Sequence
from math import log

import numpy as np

from underskin.diagnosis.slips.comparison import LEAST_RECORDINGS
from underskin.diagnosis.slips.levels import Alternative
from underskin.diagnosis.slips.table import GAIN, Screened
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.models.composition import D33
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.plausibility import OF_PVDF
from underskin.units import Floats, unit_guess

SLIP = 1000.0  # between neighbouring units
MOST_SHARE = 0.25  # of the recordings; more are no slip of single ones
_FAINT = 5e-4  # dynamic force over preload: instruments resolve no less
_RESPONSE = "frf_re_pc_per_n"
_LIKELY_D33 = (0.3, 1000.0)  # pC/N; polymers have 5 to 40, ceramics up to some hundred
_FIELDS = {  # the units that make values too large, and too small
    "preload_n": ("mN", "kN"),
    "dynamic_force_n": ("mN", "kN"),
    "indenter_radius_mm": ("µm", "m"),
    "frequency_hz": ("mHz", "kHz"),
}


def wrong_values(screened: Screened) -> Iterator[Alternative]:
    """For each field the recordings whose value is off all others by a factor of about 1000."""
    for name, (too_large, too_small) in _FIELDS.items():
        values = np.array([_value(recording, name) for recording in screened.recordings])
        off, nats = _off_by_1000(values)
        findings = []
        for index in np.flatnonzero(off).tolist():
            units = {"too_large": bool(off[index] > 0), "given_in": too_large if off[index] > 0 else too_small}
            arguments = {"value": float(values[index]), **units}
            findings.append(Finding(Reason.BESIDE_OTHERS, screened.recordings[index].id, name, arguments))
        yield from _left_out(screened, off, nats, findings)


def wrong_responses(screened: Screened) -> Iterator[Alternative]:
    """The recordings whose level is off that of all others by a factor of about 1000."""
    off, nats = _off_by_1000(np.abs(screened.comparison.ratio))
    findings = [
        Finding(
            Reason.RESPONSE_BESIDE_OTHERS, screened.recordings[index].id, _RESPONSE, {"too_large": bool(off[index] > 0)}
        )
        for index in np.flatnonzero(off).tolist()
    ]
    yield from _left_out(screened, off, nats, findings)


def _left_out(screened: Screened, off: Floats, nats: Floats, findings: list[Finding]) -> Iterator[Alternative]:
    """The alternative that these recordings are off, each at the cost of choosing it."""
    if findings:
        choices, gain = np.count_nonzero(off) * log(len(off)), float(nats[off != 0].sum())
        yield Alternative(-choices, gain, undo=screened.without(off != 0, *findings))


def _off_by_1000(values: Floats) -> tuple[Floats, Floats]:
    """1 for each value that is about 1000 times those of the others, −1 where it is a thousandth, else 0, and the gain
    of ln evidence by it; a value that is NaN or 0 is unknown. More than a quarter of all, but for one, are no slip."""
    known = values > 0
    if known.sum() < LEAST_RECORDINGS:
        return np.zeros(len(values)), np.zeros(len(values))
    usual = float(np.median(values[known]))
    slip = np.log(np.where(known, values, usual) / usual)
    nats = log(SLIP) * (np.abs(slip) - log(SLIP) / 2)
    nearest = np.round(slip / log(SLIP))
    off = np.where((np.abs(nearest) == 1) & (nats > GAIN + log(len(values))), nearest, 0.0)
    few = np.count_nonzero(off) <= max(MOST_SHARE * len(values), 1.0)
    return few * off, nats


def _value(recording: FrfRecording, name: str) -> float:
    frequency = name == "frequency_hz"
    return float(np.median(lines_of(recording).frequency)) if frequency else float(getattr(recording, name))


def faint_oscillation(recordings: Sequence[FrfRecording]) -> list[Finding]:
    """The finding on a negligible dynamic force, as one given in kN; only laws of large amplitudes use it."""
    ratio = max(recording.dynamic_force_n / recording.preload_n for recording in recordings)
    return [] if ratio > _FAINT else [Finding(Reason.DYNAMIC_FORCE_SMALL, "", "dynamic_force_n", {"ratio": ratio})]


def contradicting(ratio: Floats) -> Finding | None:
    """The finding on two recordings with opposite signs, or levels about 1000 apart: neither can be told to be wrong.

    `ratio` (recordings,) is that to the base model (`comparison`), NaN where it is not informative.
    """
    size = np.abs(ratio)
    if len(ratio) != 2 or not (size > 0).all():
        return None
    if np.prod(ratio) < 0:
        return Finding(Reason.TWO_SIGNS, "", _RESPONSE)
    of_two = float(size.max() / size.min())
    return (
        Finding(Reason.TWO_RESPONSES, "", _RESPONSE, {"ratio": of_two}) if round(log(of_two) / log(SLIP)) == 1 else None
    )


def unlikely_d33(ratio: Floats, declared: float | None) -> list[Finding]:
    """The finding on a d33 that no sensor has, or that is off the declared one by a factor of 1000."""
    d33 = float(np.nanmedian(np.abs(ratio))) * D33.from_fit(D33.start) if np.isfinite(ratio).any() else 0.0
    if d33 <= 0:
        return []
    low, high = _LIKELY_D33
    if declared:
        low, high = abs(declared) / SLIP**0.5, abs(declared) * SLIP**0.5  # nearer to it than to another unit
    if low <= d33 <= high:
        return []
    guess = unit_guess("d33_pc_per_n", d33, (low, high) if declared else OF_PVDF)
    slip = None if guess.units else str(guess)
    arguments = {"d33_pc_per_n": d33, "declared_pc_per_n": declared, "units": guess.units, "slip": slip}
    return [Finding(Reason.D33_NEEDED, "", _RESPONSE, arguments)]
