"""Recordings given as time series, as the lines that a diagnosis uses.

The force itself contradicts slips of units that an FRF hides: its mean is the preload, unless a coupling took it away,
and √2 times its deviation is the dynamic force, about, whatever the excitation.
Lines where the force has little power (beside the excited band, between the lines of a periodic sweep) say next to
nothing, and their noise is unlike that of the others: lines with a relative standard uncertainty √((1 − γ²)/(2nγ²))
above a fifth, or five times that of the best, are left out. Neighbouring lines of tapered blocks share their noise (a
Hann window's by 4/9), two apart hardly (1/36): none is kept beside another.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.finding import Finding
from underskin.errors import InvalidInput
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf_estimation import Frf, lines_of
from underskin.units import to_lab

_SLIP, _WITHIN = 1000.0, 30.0
_CLEAR = 3.0  # standard deviations that a force's mean must be from 0 to be a preload, not what a coupling left
_ALONE = 0.25  # of the recordings at most
_UNSURE, _BESIDE_BEST, _BEST = 0.2, 5.0, 0.1  # the best: this quantile
_LEAST_LINES = 8  # so that of a record of few lines all are kept
_GIVEN_AS = {"frequency_hz": "sample_rate_hz", "frf_re_pc_per_n": "charge_pc"}


def as_lines(entries: Sequence[FrfRecording], found: list[Finding]) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings as FRFs, without those that are off by themselves, each named in `found`; and what is said where
    the forces of many contradict what is declared of them."""
    off = {entry.id: slip for entry in entries if (slip := _slip(entry)) is not None}
    if len(off) > max(1.0, _ALONE * len(entries)):
        return [], [Finding("units_off_by_1000", "", *next(iter(off.values())))]
    kept = []
    for entry in entries:
        if entry.id in off:
            field, text = off[entry.id]
            found.append(Finding("units_off_by_1000", entry.id, field, f"{text} Left out"))
        elif entry.sample_rate_hz is None:
            kept.append(entry)
        elif (estimated := _estimated(entry, found)) is not None:
            kept.append(estimated)
    return kept, []


def as_given(entries: Sequence[FrfRecording], found: Sequence[Finding]) -> list[Finding]:
    """The findings with the fields that a recording was given by: a time series has no frequencies of its own."""
    series = {entry.id for entry in entries if entry.sample_rate_hz is not None}
    if len(series) == len(entries):
        series.add("")
    return [
        replace(entry, field=_GIVEN_AS.get(entry.field, entry.field)) if entry.recording in series else entry
        for entry in found
    ]


def _slip(entry: FrfRecording) -> tuple[str, str] | None:
    """Which field is 1000 × off by what the force itself says, and how that is said."""
    if entry.force_n is None:
        return None
    mean, scatter = float(np.mean(entry.force_n)), float(np.std(entry.force_n))
    shaken = np.sqrt(2.0) * scatter / entry.dynamic_force_n
    pressed = abs(mean) / entry.preload_n if abs(mean) > _CLEAR * scatter else None
    for factor, own, other in ((_SLIP, "mN", "kN"), (1 / _SLIP, "kN", "mN")):
        word = "large" if factor > 1 else "small"
        if _near(shaken, factor) and (pressed is None or _near(pressed, factor)):
            text = f"it is shaken by {np.sqrt(2.0) * scatter:.3g} N, where dynamic_force_n is {entry.dynamic_force_n:g}"
            return "force_n", f"{text}: it looks 1000 × too {word}; was it given in {own}?"
        opposite = "small" if factor > 1 else "large"
        if _near(shaken, factor) and pressed is not None and _near(pressed, 1.0):
            text = f"{entry.dynamic_force_n:g} N looks 1000 × too {opposite} beside the recorded force"
            return "dynamic_force_n", f"{text}: was it given in {other}?"
        if _near(shaken, 1.0) and pressed is not None and _near(pressed, factor):
            text = f"{entry.preload_n:g} N looks 1000 × too {opposite} beside the recorded force's mean of {mean:.3g} N"
            return "preload_n", f"{text}: was it given in {other}?"
    return None


def _near(ratio: float, factor: float) -> bool:
    return factor / _WITHIN < ratio < factor * _WITHIN


def _estimated(entry: FrfRecording, found: list[Finding]) -> FrfRecording | None:
    """The recording with the lines of its time series that say something; None where there are none."""
    try:
        measured = lines_of(entry)
    except InvalidInput as refusal:
        found.append(Finding("series_not_usable", entry.id, refusal.field, f"{refusal}: left out"))
        return None
    if measured.found:
        first, more = measured.found[0], len(measured.found) - 1
        text = f"{first.statement}{f'; {more} more like it' if more else ''}: those parts were left out"
        found.append(Finding("damaged_samples", entry.id, first.channel, text))
    chosen = _telling(measured)
    if not chosen:
        text = "charge follows force at no frequency: left out"
        found.append(Finding("no_response", entry.id, "charge_pc", text))
        return None
    values = to_lab("frf_pc_per_n", measured.values[chosen].real), to_lab("frf_pc_per_n", measured.values[chosen].imag)
    return replace(
        entry,
        frequency_hz=measured.frequency[chosen],
        frf_re_pc_per_n=values[0],
        frf_im_pc_per_n=values[1],
        coherence=None if measured.coherence is None else measured.coherence[chosen],
        sample_rate_hz=None,
        force_n=None,
        charge_pc=None,
    )


def _telling(measured: Frf) -> list[int]:
    """The lines that are known well enough, none beside another where the record is one of blocks."""
    uncertainty = measured.relative_uncertainty
    lines = range(len(measured.frequency))
    if uncertainty is None or np.isnan(uncertainty).any():
        return list(lines)
    most = min(_UNSURE, _BESIDE_BEST * float(np.quantile(uncertainty, _BEST)))
    sure = [line for line in lines if uncertainty[line] <= most]
    spacing = float(np.diff(measured.frequency, prepend=0.0).min())
    if len(sure) < _LEAST_LINES or not np.allclose(np.diff(measured.frequency), spacing):
        return sure
    kept: list[int] = []
    for line in sure:
        if not kept or line > kept[-1] + 1:
            kept.append(line)
    return kept
