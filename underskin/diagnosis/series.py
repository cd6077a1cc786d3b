"""Recordings given as time series, as the lines that a diagnosis uses.

The force itself contradicts slips of units that an FRF hides: its mean is the preload, unless a coupling took it away,
and what shakes it the dynamic force, about: its peak for sines and blows, √2 times its deviation for sines and noise.
Drift (a preload that relaxes) is no shaking: the straight line through each eighth of the record is taken off.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import detrend

from underskin.diagnosis.finding import Finding
from underskin.diagnosis.series_lines import Choice, telling
from underskin.errors import InvalidInput
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf_estimation import lines_of
from underskin.units import Floats, to_lab

_SLIP, _WITHIN = 1000.0, 30.0
_CLEAR = 3.0  # standard deviations that a force's mean must be from 0 to be a preload, not what a coupling left
_ALONE = 0.25  # of the recordings at most
_PARTS = 8  # of a record, of which drift is taken off; its analysis has blocks of that length
_MANY = 0.1  # of the lines
_GIVEN_AS = {"frequency_hz": "sample_rate_hz", "frf_re_pc_per_n": "charge_pc"}


@dataclass(frozen=True)
class _Slip:
    """The `field` that is 1000 × off by what the force itself says, how that is said, and in which unit it may be."""

    field: str
    statement: str
    unit: str


def as_lines(
    entries: Sequence[FrfRecording], found: list[Finding], *, units_checked: bool
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings as FRFs, without those that are off by themselves, each named in `found`; and what is said where
    the forces of many contradict what is declared of them. With `units_checked` it is said and nothing left out."""
    off = {entry.id: slip for entry in entries if (slip := _slip(entry)) is not None}
    many = len(off) > max(1.0, _ALONE * len(entries))
    if many and not units_checked:
        return [], _told(off, entries)
    if many or units_checked:
        found += _told(off, entries)
    else:
        found += [
            Finding("units_off_by_1000", name, slip.field, f"{slip.statement} Left out") for name, slip in off.items()
        ]
        entries = [entry for entry in entries if entry.id not in off]
    kept, choices = [], {}
    for entry in entries:
        if entry.sample_rate_hz is None:
            kept.append(entry)
        elif (estimated := _estimated(entry, found)) is not None:
            kept.append(estimated[0])
            choices[entry.id] = estimated[1]
    found += [*_left_out(choices), *_mains(choices)]
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


def _told(off: dict[str, _Slip], entries: Sequence[FrfRecording]) -> list[Finding]:
    """Once where it is the same of all recordings, else of each."""
    slips = list(off.values())
    if len(off) == len(entries) > 1 and len({(slip.field, slip.unit) for slip in slips}) == 1:
        text = f"in all recordings, as in {next(iter(off))}: {slips[0].statement}"
        return [Finding("units_off_by_1000", "", slips[0].field, text)]
    return [Finding("units_off_by_1000", name, slip.field, slip.statement) for name, slip in off.items()]


def _slip(entry: FrfRecording) -> _Slip | None:
    """What is 1000 × off by what the force itself says."""
    if entry.force_n is None:
        return None
    mean, scatter = float(np.mean(entry.force_n)), float(np.std(entry.force_n))
    shaken = _shaking(entry.force_n) / entry.dynamic_force_n
    agrees = any(_near(one, 1.0) for one in shaken)
    nearest = shaken[int(np.argmin(np.abs(np.log(np.maximum(shaken, 1e-300)))))] * entry.dynamic_force_n
    pressed = abs(mean) / entry.preload_n if abs(mean) > _CLEAR * scatter else None
    for factor, own, other in ((_SLIP, "mN", "kN"), (1 / _SLIP, "kN", "mN")):
        word, opposite = ("large", "small") if factor > 1 else ("small", "large")
        off = any(_near(one, factor) for one in shaken)
        if off and (not agrees if pressed is None else _near(pressed, factor)):
            text = f"it is shaken by {nearest:.3g} N, where dynamic_force_n is {entry.dynamic_force_n:g}"
            return _Slip("force_n", f"{text}: it looks 1000 × too {word}; was it given in {own}?", own)
        if off and not agrees and pressed is not None and _near(pressed, 1.0):
            text = f"{entry.dynamic_force_n:g} N looks 1000 × too {opposite} beside the recorded force"
            return _Slip("dynamic_force_n", f"{text}: was it given in {other}?", other)
        if agrees and pressed is not None and _near(pressed, factor):
            text = f"{entry.preload_n:g} N looks 1000 × too {opposite} beside the recorded force's mean of {mean:.3g} N"
            return _Slip("preload_n", f"{text}: was it given in {other}?", other)
    return None


def _shaking(force: Floats) -> Floats:
    """√2 times the deviation of a force less its drift, and its peak [N]."""
    parts = np.arange(0, len(force), max(len(force) // _PARTS, _PARTS))
    oscillation = detrend(force, bp=parts)
    return np.array([np.sqrt(2.0) * np.std(oscillation), np.max(np.abs(oscillation))])


def _near(ratio: float, factor: float) -> bool:
    return factor / _WITHIN < ratio < factor * _WITHIN


def _estimated(entry: FrfRecording, found: list[Finding]) -> tuple[FrfRecording, Choice] | None:
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
    choice = telling(entry, measured)
    chosen = choice.lines
    if not chosen:
        text = "charge follows force at no frequency: left out"
        found.append(Finding("no_response", entry.id, "charge_pc", text))
        return None
    values = to_lab("frf_pc_per_n", measured.values[chosen].real), to_lab("frf_pc_per_n", measured.values[chosen].imag)
    estimated = replace(
        entry,
        frequency_hz=measured.frequency[chosen],
        frf_re_pc_per_n=values[0],
        frf_im_pc_per_n=values[1],
        coherence=None if measured.coherence is None else measured.coherence[chosen],
        sample_rate_hz=None,
        force_n=None,
        charge_pc=None,
    )
    return estimated, choice


def _left_out(choices: dict[str, Choice]) -> list[Finding]:
    """How many lines are left out because the force has little power there, where they are many."""
    measured, faint, beside = (
        sum(getattr(choice, name) for choice in choices.values()) for name in ("measured", "faint", "beside")
    )
    if faint <= _MANY * measured:
        return []
    text = f"{faint} of {measured} lines of {len(choices)} recordings are left out: the force has little power there"
    shared = f", and {beside} that share their noise with the next one" if beside else ""
    return [Finding("lines_left_out", "", "force_n", f"{text} and charge does not follow it{shared}")]


def _mains(choices: dict[str, Choice]) -> list[Finding]:
    """Where charge stands out at the mains' multiples and force does not, used or left out there."""
    found = []
    for mains in sorted({choice.mains for choice in choices.values() if choice.mains}):
        names = [name for name, choice in choices.items() if choice.mains == mains]
        text = f"in {len(names)} of {len(choices)} recordings the charge stands out at {mains:g} Hz or a multiple of it"
        place = names[0] if len(names) == 1 else ""
        found.append(Finding("mains_in_charge", place, "charge_pc", f"{text}, and the force does not: mains pickup?"))
    return found
