"""Wrong units among the recordings: a force in kN, a sphere in m or a frequency in kHz where others are not.

A recording with a single such value is left out. A dynamic force that is far too small in all recordings is a finding.
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.slips.comparison import LEAST_RECORDINGS
from underskin.findings.codes import Lack, Lacking, Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.models.composition import D33
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.plausibility import OF_PVDF
from underskin.units import Floats, Mask, unit_guess

SLIP = 1000.0  # between neighbouring units
MOST_SHARE = 0.25  # of the recordings; more are no slip of single ones
_WIDTH = np.log(12.0)  # of ln 1000: values that are meant to be equal differ by less
_FAINT = 5e-4  # dynamic force over preload: instruments resolve no less
_D33 = "d33_pc_per_n"
_LIKELY_D33 = (0.3, 1000.0)  # pC/N; polymers have 5 to 40, ceramics up to some hundred
_FIELDS = {  # the units that make values too large, and too small
    "preload_n": ("mN", "kN"),
    "dynamic_force_n": ("mN", "kN"),
    "indenter_radius_mm": ("µm", "m"),
    "frequency_hz": ("mHz", "kHz"),
}


def off_by_1000(values: Floats) -> Floats:
    """1 for each value that is about 1000 times those of the others, −1 where it is a thousandth, else 0; a value that
    is NaN or 0 is unknown. More than a quarter of all, but for one, are no slip."""
    known = values > 0
    if known.sum() < LEAST_RECORDINGS:
        return np.zeros(len(values))
    usual = float(np.median(values[known]))
    slip = np.log(np.where(known, values, usual) / usual)
    off = np.where(np.abs(np.abs(slip) - np.log(SLIP)) < _WIDTH, np.sign(slip), 0.0)
    return off if np.count_nonzero(off) <= max(MOST_SHARE * len(values), 1.0) else np.zeros(len(values))


def single_unit_errors(recordings: Sequence[FrfRecording]) -> tuple[Mask, list[Finding]]:
    """Which recordings have a value off all others by a factor of about 1000, and the findings on them."""
    wrong: Mask = np.zeros(len(recordings), dtype=bool)
    findings = []
    for name, (too_large, too_small) in _FIELDS.items():
        values = np.array([_value(recording, name) for recording in recordings])
        off = off_by_1000(values)
        for index in np.flatnonzero((off != 0) & ~wrong).tolist():
            unit = too_large if off[index] > 0 else too_small
            arguments = {"value": float(values[index]), "too_large": bool(off[index] > 0), "given_in": unit}
            findings.append(Finding(Reason.BESIDE_OTHERS, recordings[index].id, name, arguments))
        wrong |= off != 0
    return wrong, findings


def _value(recording: FrfRecording, name: str) -> float:
    frequency = name == "frequency_hz"
    return float(np.median(lines_of(recording).frequency)) if frequency else float(getattr(recording, name))


def faint_oscillation(recordings: Sequence[FrfRecording]) -> list[Finding]:
    """The finding on a negligible dynamic force, as one given in kN; only laws of large amplitudes use it."""
    ratio = max(recording.dynamic_force_n / recording.preload_n for recording in recordings)
    if ratio > _FAINT:
        return []
    return [Finding(Reason.DYNAMIC_FORCE_SMALL, "", "dynamic_force_n", {"ratio": ratio})]


def levels_off_by_1000(recordings: Sequence[FrfRecording], ratio: Floats) -> tuple[Mask, list[Finding], Lacking | None]:
    """Which recordings' levels are about 1000 × off all others, and the findings on them; of two that are, or that have
    opposite signs, neither can be told to be wrong, and nothing can be concluded.

    `ratio` (recordings,) is that to the base model (`comparison`), NaN where it is not informative.
    """
    size = np.abs(ratio)
    if len(recordings) == 2 and (size > 0).all():
        of_two = float(size.max() / size.min())
        contradiction = None
        if np.prod(ratio) < 0:
            contradiction = Finding(Reason.TWO_SIGNS, "", "frf_re_pc_per_n")
        elif abs(np.log(of_two / SLIP)) < _WIDTH:
            contradiction = Finding(Reason.TWO_RESPONSES, "", "frf_re_pc_per_n", {"ratio": of_two})
        if contradiction is not None:
            return np.ones(2, dtype=bool), [contradiction], Lacking(Lack.TWO_RECORDINGS_CONTRADICT)
    off = off_by_1000(size)
    findings = [
        Finding(
            Reason.RESPONSE_BESIDE_OTHERS, recordings[index].id, "frf_re_pc_per_n", {"too_large": bool(off[index] > 0)}
        )
        for index in np.flatnonzero(off).tolist()
    ]
    return off != 0, findings, None


def unlikely_d33(ratio: Floats, declared: float | None) -> list[Finding]:
    """The finding on a d33 that no sensor has, or that is off the declared one by a factor of 1000."""
    d33 = float(np.nanmedian(np.abs(ratio))) * D33.from_fit(D33.start) if np.isfinite(ratio).any() else 0.0
    if d33 <= 0:
        return []
    low, high = _LIKELY_D33
    if declared:
        low, high = abs(declared) / SLIP * np.exp(_WIDTH), abs(declared) * SLIP / np.exp(_WIDTH)
    if low <= d33 <= high:
        return []
    usual = (low, high) if declared else OF_PVDF
    guess = unit_guess(_D33, d33, usual)
    slip = None if guess.units else str(guess)
    arguments = {"d33_pc_per_n": d33, "declared_pc_per_n": declared, "units": guess.units, "slip": slip}
    return [Finding(Reason.D33_NEEDED, "", "frf_re_pc_per_n", arguments)]
