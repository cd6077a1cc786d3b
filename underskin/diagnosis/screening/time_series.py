"""Recordings given as time series, as the lines that a diagnosis uses."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from underskin.diagnosis.screening.select_lines import Choice, telling
from underskin.diagnosis.screening.time_series_units import Slip, slip_of
from underskin.errors import InvalidInput
from underskin.formatting import significant
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.finding import Finding
from underskin.recordings.frf.estimation import lines_of
from underskin.units import Floats, to_lab

_ALONE = 0.25  # of the recordings at most
_MANY = 0.1  # of the lines
_GIVEN_AS = {"frequency_hz": "sample_rate_hz", "frf_re_pc_per_n": "charge_pc"}


@dataclass(frozen=True)
class Estimated:
    """The recordings as FRFs; what is said where the forces of many contradict what is declared of them; and by their
    id how `uneven` the noise of the lines is."""

    entries: list[FrfRecording]
    doubtful: list[Finding]
    uneven: dict[str, Floats] = field(default_factory=dict)


def as_lines(entries: Sequence[FrfRecording], found: list[Finding], *, units_checked: bool) -> Estimated:
    """The recordings as FRFs, without those that are off by themselves, each named in `found`. With `units_checked`
    contradictions are said and nothing is left out."""
    off = {entry.id: slip for entry in entries if (slip := slip_of(entry)) is not None}
    many = len(off) > max(1.0, _ALONE * len(entries))
    if many and not units_checked:
        return Estimated([], _told(off, entries))
    if many or units_checked:
        found += _told(off, entries)
    else:
        found += [Finding(slip.code, name, slip.field, f"{slip.statement} Left out") for name, slip in off.items()]
        entries = [entry for entry in entries if entry.id not in off]
    kept, choices, uneven = [], {}, {}
    for entry in entries:
        if entry.sample_rate_hz is None:
            kept.append(entry)
        elif (estimated := _estimated(entry, found)) is not None:
            kept.append(estimated[0])
            choices[entry.id] = choice = estimated[1]
            if choice.uneven is not None:
                uneven[entry.id] = choice.uneven
    found += [*_left_out(choices), *_once(choices), *_mains(choices)]
    return Estimated(kept, [], uneven)


def as_given(entries: Sequence[FrfRecording], found: Sequence[Finding]) -> list[Finding]:
    """The findings with the fields that a recording was given by: a time series has no frequencies of its own."""
    series = {entry.id for entry in entries if entry.sample_rate_hz is not None}
    if len(series) == len(entries):
        series.add("")
    return [
        replace(entry, field=_GIVEN_AS.get(entry.field, entry.field)) if entry.recording in series else entry
        for entry in found
    ]


def _told(off: dict[str, Slip], entries: Sequence[FrfRecording]) -> list[Finding]:
    """Once where it is the same of all recordings, else of each."""
    slips = list(off.values())
    if len(off) == len(entries) > 1 and len({(slip.code, slip.field, slip.unit) for slip in slips}) == 1:
        text = f"in all recordings, as in {next(iter(off))}: {slips[0].statement}"
        return [Finding(slips[0].code, "", slips[0].field, text)]
    return [Finding(slip.code, name, slip.field, slip.statement) for name, slip in off.items()]


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
    choice = telling(measured)
    chosen = choice.lines
    if not chosen:
        if choice.mains is None:
            text = "charge follows force at no frequency: left out"
        else:
            text = f"mains of {choice.mains.mains:g} Hz may spoil all lines where the force has its power: left out"
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


def _once(choices: dict[str, Choice]) -> list[Finding]:
    """Where the force passes through its band once."""
    names = [name for name, choice in choices.items() if choice.once]
    if not names:
        return []
    text = (
        f"in {len(names)} of {len(choices)} recordings the force acts at each frequency once, as a single sweep or "
        "blow: the lowest lines are left out, and those beside a sharp resonance are off by parts of a percent; a "
        "drive that repeats itself at least four times gives them all"
    )
    return [Finding("force_acts_once", names[0] if len(names) == 1 else "", "force_n", text)]


def _mains(choices: dict[str, Choice]) -> list[Finding]:
    """Where charge stands out at the mains' multiples and force does not, within the band or beside it."""
    pickups = {name: choice.mains for name, choice in choices.items() if choice.mains is not None}
    found = []
    for mains in sorted({entry.mains for entry in pickups.values()}):
        own = {name: entry.charge for name, entry in pickups.items() if entry.mains == mains}
        charge = float(to_lab("charge_pc", np.median(list(own.values()))))
        text = (
            f"in {len(own)} of {len(choices)} recordings the charge stands out at {mains:g} Hz or a multiple of it by "
            f"about {significant(charge, 2)} pC, and the force does not: mains pickup? The lines there are left out"
        )
        found.append(Finding("mains_in_charge", next(iter(own)) if len(own) == 1 else "", "charge_pc", text))
    return found
