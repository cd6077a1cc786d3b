"""Slips that show in the levels of recordings only: a weak sensor, one that stands alone, amplitudes of another kind,
a warm-up, cables exchanged.

The plainest is put right first, since each looks a little like the others.

What is wrong with the recordings of a campaign themselves, before any physics is held responsible.

Recordings that contradict the others (copies, reversed signs, units off by 1000, no response, no finite line) are
findings. They are left out of the diagnosis, or corrected where the error is plain (a sensor of reversed sign).
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.dataset import Inspected, agree, recording_axes
from underskin.diagnosis.screening.amplitude_factors import Step, amplitude_step, without_step
from underskin.diagnosis.screening.declared_values import unlikely
from underskin.diagnosis.screening.exchanged_cables import exchanged_cables, with_right_sensors
from underskin.diagnosis.screening.exchanged_sensors import without_exchanges
from underskin.diagnosis.screening.levels import causes_of, levels
from underskin.diagnosis.screening.model_consistency import against_model
from underskin.diagnosis.screening.phase_convention import in_one_convention
from underskin.diagnosis.screening.position_errors import at_sensors, misplaced
from underskin.diagnosis.screening.sensor_alone import Alone, at_the_others, standing_alone
from underskin.diagnosis.screening.silent_together import without_silent_pair
from underskin.diagnosis.screening.time_series import as_given, as_lines
from underskin.diagnosis.screening.unit_errors import faint_oscillation, single_unit_errors
from underskin.diagnosis.screening.warm_up import WarmUp, warming, without_first
from underskin.diagnosis.screening.weak_sensors import weak_sensors
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.lacking import Lack, Lacking
from underskin.prediction.exchanged_values import exchanged_values
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.plausibility import loose_sphere, overlapping_sensors
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes

_LEAST = 4  # recordings
_MOST = 300  # recordings: the covariance of more costs minutes
_MOST_SLIPS = 3


def without_level_slips(
    campaign: Campaign, entries: Sequence[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings with such slips put right or left out, and the findings on them."""
    left, findings = list(entries), list[Finding]()
    if len(left) >= _LEAST:
        weak, findings = weak_sensors(left, levels(campaign, left, table))
        left = [entry for entry, off in zip(left, weak, strict=True) if not off]
    for _ in range(_MOST_SLIPS):
        found = _plainest(campaign, left, table)
        if found is None:
            break
        left, finding = found
        findings.append(finding)
    return left, findings


def _plainest(
    campaign: Campaign, entries: list[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], Finding] | None:
    """The recordings without the plainest slip, and the finding on it; None where there is none."""
    if len(entries) < _LEAST:
        return None
    own = levels(campaign, entries, table)
    if not _LEAST <= len(own.value) <= _MOST:
        return None
    slips = (
        amplitude_step(own),
        warming(own, causes_of(campaign, entries, own, table)),
        exchanged_cables(own),
        standing_alone(own),
    )
    found = [one for one in slips if one is not None]
    best = max(found, key=lambda one: one.gain, default=None)
    if isinstance(best, Step):
        return without_step(entries, own, best)
    if isinstance(best, WarmUp):
        return without_first(entries, best)
    if isinstance(best, Alone):
        return at_the_others(entries, own, best)
    places = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    return None if best is None else with_right_sensors(entries, own, best, places)


LEAST_RECORDINGS = 2
_SAME = 1e-4  # relative difference of copies: files round numbers to some digits
_AXES = ("preload_n", "indenter_radius_mm", "dynamic_force_n")


def inspect(campaign: Campaign, table: SigmaTable, kept: Collection[str] | None = None) -> Inspected:
    """The campaign without what cannot be used, reversed sensors put right, and the findings.

    Of the recordings whose contacts lie beyond the tables as declared, those `kept` stay (ids); None: all that a
    plausible modulus brings within.
    """
    recorded = frf_recordings(campaign) if campaign.recordings else ()
    series = as_lines(recorded, units_checked=campaign.units_checked)
    if series.doubtful:
        return _inspected(campaign, [], series.doubtful, _impossible(series.doubtful, confirmable=True))
    imported = {entry.id for entry in recorded if entry.sample_rate_hz is None}
    inspected = _inspect_lines(campaign, series.entries, imported, table, kept)
    findings = as_given(recorded, [*series.findings, *inspected.findings])
    return replace(inspected, findings=findings, uneven=series.uneven, unsure=series.unsure)


def _inspect_lines(
    campaign: Campaign,
    recorded: Sequence[FrfRecording],
    imported: Collection[str],
    table: SigmaTable,
    kept: Collection[str] | None,
) -> Inspected:
    with_lines, of_lines = _with_lines(recorded)
    entries, copies = _without_copies(with_lines)
    off, unit_errors = single_unit_errors(entries)
    astray, of_places, misgiven = misplaced(campaign, entries)
    findings = [*of_lines, *copies, *unit_errors, *of_places]
    entries = [entry for entry, wrong in zip(entries, off | astray, strict=True) if not wrong]
    if not entries:
        return _inspected(campaign, entries, findings)
    contradictory = [*loose_sphere(entries), *overlapping_sensors(campaign), *misgiven]
    exchanged = exchanged_values(campaign.skin, entries, table)
    doubtful = [*unlikely(campaign, entries), *at_sensors(campaign, entries), *exchanged]
    findings += [*doubtful, *contradictory]
    if contradictory or (doubtful and not campaign.units_checked):
        lacking = _impossible([*doubtful, *contradictory], confirmable=not contradictory)
        return _inspected(campaign, [], findings, lacking)
    findings += [*_constant_axes(entries), *faint_oscillation(entries)]
    entries, of_phase = in_one_convention(entries, imported)
    entries, of_sensors = without_exchanges(campaign, entries, table)
    entries, silent = without_silent_pair(entries)
    consistent = against_model(campaign, entries, table, kept)
    findings += [*of_phase, *of_sensors, *silent, *consistent.findings]
    if consistent.lacking is not None:
        return _inspected(campaign, consistent.entries, findings, consistent.lacking)
    entries, of_levels = without_level_slips(campaign, consistent.entries, table)
    inspected = _inspected(campaign, entries, [*findings, *of_levels])
    return replace(inspected, beyond=consistent.beyond & {entry.id for entry in entries})


def _inspected(
    campaign: Campaign, entries: Sequence[FrfRecording], findings: Sequence[Finding], lacking: Lacking | None = None
) -> Inspected:
    usable = replace(campaign, recordings=tuple(entries))
    if lacking is None and len(entries) < LEAST_RECORDINGS:
        lacking = Lacking(Lack.FEW_RECORDINGS, {"recordings": len(entries), "least": LEAST_RECORDINGS})
    elif lacking is None and not recording_axes(usable) and max(len(lines_of(entry).values) for entry in entries) < 2:
        lacking = Lacking(Lack.MADE_ALIKE)
    return Inspected(usable, findings, lacking)


def _impossible(findings: Sequence[Finding], *, confirmable: bool) -> Lacking:
    """What is to be corrected, or confirmed, before anything can be concluded."""
    fields = list(dict.fromkeys(entry.field for entry in findings))
    return Lacking(Lack.IMPOSSIBLE_DECLARATION, {"fields": fields, "confirmable": confirmable})


def _with_lines(entries: Sequence[FrfRecording]) -> tuple[list[FrfRecording], list[Finding]]:
    """Those with a line that is finite and not 0."""
    usable, findings = [], []
    for entry in entries:
        values = lines_of(entry).values
        finite = np.isfinite(values)
        if not finite.any():
            findings.append(Finding(Reason.NO_FINITE_LINE, entry.id, "frf_re_pc_per_n"))
        elif not np.abs(values[finite]).any():
            findings.append(Finding(Reason.ZERO_LINES, entry.id, "frf_re_pc_per_n"))
        else:
            if not finite.all():
                arguments = {"lines": int((~finite).sum())}
                findings.append(Finding(Reason.LINES_NOT_FINITE, entry.id, "frf_re_pc_per_n", arguments))
            usable.append(entry)
    return usable, findings


def _without_copies(entries: list[FrfRecording]) -> tuple[list[FrfRecording], list[Finding]]:
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
    findings = [
        Finding(
            Reason.DUPLICATED_RECORDING, entries[number].id, "frf_re_pc_per_n", {"original": entries[int(first)].id}
        )
        for number, first in enumerate(original)
        if first != number
    ]
    return [entry for number, entry in enumerate(entries) if original[number] == number], findings


def _alike(one: Complexes, other: Complexes) -> bool:
    return len(one) == len(other) and bool((np.abs(one - other) <= _SAME * np.abs(one)).all())


def _constant_axes(entries: list[FrfRecording]) -> list[Finding]:
    findings = []
    if len(entries) > 1:
        constant = [name for name in _AXES if agree(name, [getattr(entry, name) for entry in entries])]
        findings += [Finding(Reason.CONSTANT_AXIS, "", name, {"axis": name}) for name in constant]
    if entries and max(len(lines_of(entry).values) for entry in entries) < 2:
        findings.append(Finding(Reason.ONE_LINE, "", "frequency_hz"))
    return findings
