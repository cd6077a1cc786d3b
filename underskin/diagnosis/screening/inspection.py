"""What is wrong with a campaign's recordings themselves, by name, before any physics is blamed for it.

Recordings that cannot belong with the others (copies, reversed signs, units off by 1000, silence, no finite line) are
reported, and left out of the diagnosis, or put right where that is plain (a sensor whose sign is reversed).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.axes import recording_axes
from underskin.diagnosis.data.inspected import Inspected
from underskin.diagnosis.screening.declared_values import unlikely
from underskin.diagnosis.screening.model_consistency import against_model
from underskin.diagnosis.screening.position_errors import huddled, misplaced
from underskin.diagnosis.screening.time_series import as_given, as_lines
from underskin.diagnosis.screening.unit_errors import faint_oscillation, lone_slips, loose_sphere
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings
from underskin.recordings.finding import Finding
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.plausibility import overlapping_sensors
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes

LEAST_RECORDINGS = 2
_SAME = 1e-4  # relative difference of copies: files round numbers to some digits
_AXES = ("preload_n", "indenter_radius_mm", "dynamic_force_n")


def inspect(campaign: Campaign, table: SigmaTable) -> Inspected:
    """The campaign without what cannot be used, reversed sensors put right, and what was found."""
    found: list[Finding] = []
    recorded = frf_recordings(campaign) if campaign.recordings else ()
    series = as_lines(recorded, found, units_checked=campaign.units_checked)
    if series.doubtful:
        return _inspected(campaign, [], series.doubtful, _cannot_be_right(series.doubtful, []))
    inspected = _inspect_lines(campaign, series.entries, found, table)
    return replace(inspected, found=as_given(recorded, inspected.found), uneven=series.uneven)


def _inspect_lines(
    campaign: Campaign, recorded: Sequence[FrfRecording], found: list[Finding], table: SigmaTable
) -> Inspected:
    entries = _without_copies(_with_lines(recorded, found), found)
    off = lone_slips(entries, found)
    astray, misgiven = misplaced(campaign, entries, found)
    entries = [entry for entry, wrong in zip(entries, off | astray, strict=True) if not wrong]
    if not entries:
        return _inspected(campaign, entries, found)
    contradictory = [*loose_sphere(entries), *overlapping_sensors(campaign), *misgiven]
    doubtful = [*unlikely(campaign, entries), *huddled(campaign, entries)]
    found += [*doubtful, *contradictory]
    if contradictory or (doubtful and not campaign.units_checked):
        return _inspected(campaign, [], found, _cannot_be_right(doubtful, contradictory))
    found += [*_constant_axes(entries), *faint_oscillation(entries)]
    usable, lacking = against_model(campaign, entries, table, found)
    return _inspected(campaign, usable, found, lacking)


def _inspected(
    campaign: Campaign, entries: Sequence[FrfRecording], found: Sequence[Finding], lacking: str = ""
) -> Inspected:
    usable = replace(campaign, recordings=tuple(entries))
    if not lacking and len(entries) < LEAST_RECORDINGS:
        lacking = (
            f"usable recordings: {len(entries)}; at least {LEAST_RECORDINGS} are needed, better at different preloads "
            "or spheres"
        )
    elif not lacking and not recording_axes(usable) and max(len(lines_of(entry).values) for entry in entries) < 2:
        lacking = "all recordings were made alike, at one frequency; different preloads, spheres or places are needed"
    return Inspected(usable, found, lacking)


def _cannot_be_right(doubtful: Sequence[Finding], contradictory: Sequence[Finding]) -> str:
    """What is to be corrected before anything can be concluded."""
    what = " and ".join(dict.fromkeys(entry.field for entry in (*doubtful, *contradictory)))
    meant = "" if contradictory else "; if it is meant, say units_checked"
    return f"{what} cannot be right as declared (see findings){meant}"


def _with_lines(entries: Sequence[FrfRecording], found: list[Finding]) -> list[FrfRecording]:
    """Those with a line that is finite and not 0."""
    kept = []
    for entry in entries:
        values = lines_of(entry).values
        finite = np.isfinite(values)
        if not finite.any():
            found.append(Finding("no_finite_line", entry.id, "frf_re_pc_per_n", "no line is finite: left out"))
        elif not np.abs(values[finite]).any():
            found.append(Finding("no_response", entry.id, "frf_re_pc_per_n", "every line is 0: left out"))
        else:
            if not finite.all():
                text = f"{int((~finite).sum())} lines left out"
                found.append(Finding("lines_not_finite", entry.id, "frf_re_pc_per_n", text))
            kept.append(entry)
    return kept


def _without_copies(entries: list[FrfRecording], found: list[Finding]) -> list[FrfRecording]:
    """Each once: copies have the same lines but for rounding. Only recordings of nearly the same mean are compared."""
    lines = [np.nan_to_num(lines_of(entry).values) for entry in entries]
    size = np.array([float(np.abs(own).mean()) for own in lines])
    original = np.arange(len(entries))
    order = np.argsort(size, kind="stable")
    for place, number in enumerate(order):
        for earlier in order[:place][::-1]:
            if size[number] - size[earlier] > _SAME * size[number]:
                break
            if _alike(lines[number], lines[earlier]):
                original[max(number, earlier)] = min(original[number], original[earlier])
    for number, first in enumerate(original):
        if first != number:
            text = f"the same numbers as recording {entries[first].id!r}: left out"
            found.append(Finding("duplicated_recording", entries[number].id, "frf_re_pc_per_n", text))
    return [entry for number, entry in enumerate(entries) if original[number] == number]


def _alike(one: Complexes, other: Complexes) -> bool:
    return len(one) == len(other) and bool((np.abs(one - other) <= _SAME * np.abs(one)).all())


def _constant_axes(entries: list[FrfRecording]) -> list[Finding]:
    found = []
    if len(entries) > 1:
        constant = [name for name in _AXES if len({getattr(entry, name) for entry in entries}) == 1]
        found += [Finding("constant_axis", "", name, f"{name} is the same in all recordings") for name in constant]
    if entries and max(len(lines_of(entry).values) for entry in entries) < 2:
        text = "one line a recording: nothing can be said about frequency"
        found.append(Finding("one_line", "", "frequency_hz", text))
    return found
