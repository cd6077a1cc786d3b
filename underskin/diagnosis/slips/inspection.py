"""Errors in the recordings of a campaign, checked before any physics is fitted.

Recordings that contradict the others (copies, reversed signs, units off by 1000, no response, no finite line) are
findings; they are left out, or corrected where the error is plain (a sensor of reversed sign). Errors that show only in
the levels (a weak or outlying sensor, rms or peak-to-peak amplitudes, a warm-up, exchanged cables) are corrected one at
a time, the most probable first, since each resembles the others.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.dataset import Inspected, agree, recording_axes
from underskin.diagnosis.slips.amplitude_factors import amplitude_factors
from underskin.diagnosis.slips.conjugated import conjugated
from underskin.diagnosis.slips.exchanged_cables import exchanged_cables
from underskin.diagnosis.slips.exchanged_labels import exchanged_labels
from underskin.diagnosis.slips.reversed_signs import reversed_signs
from underskin.diagnosis.slips.sensor_gain import groups_of, sensor_gains
from underskin.diagnosis.slips.silent import silent
from underskin.diagnosis.slips.table import Screened, Slip, without_slips
from underskin.diagnosis.slips.table_domain import within_tables
from underskin.diagnosis.slips.warm_up import warm_ups
from underskin.diagnosis.slips.wrong_forces import without_wrong_forces
from underskin.diagnosis.slips.wrong_positions import all_positions, at_sensors, wrong_positions
from underskin.diagnosis.slips.wrong_units import (
    contradicting,
    faint_oscillation,
    unlikely_d33,
    wrong_responses,
    wrong_values,
)
from underskin.findings.codes import Lack, Lacking, Reason
from underskin.findings.finding import Finding
from underskin.prediction.pressed_skin import exchanged_values, far_contacts, response_shares
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.frf.series_lines import as_given, as_lines
from underskin.recordings.plausibility import loose_sphere, overlapping_sensors, unlikely
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes

LEAST_RECORDINGS = 2  # to compare one with another
_FIELD = "frf_re_pc_per_n"
_SAME = 1e-4  # relative difference of copies: files round numbers to some digits

# The table of slips, in the order in which recordings can be judged: declared values, then phases and labels, for which
# no response has to be right, then responses beside the base model.
OF_VALUES: Sequence[Slip] = (wrong_values, wrong_positions)
OF_LABELS: Sequence[Slip] = (conjugated, exchanged_labels)
OF_RESPONSES: Sequence[Slip] = (
    silent,
    wrong_responses,
    reversed_signs,
    sensor_gains,
    groups_of,
    amplitude_factors,
    exchanged_cables,
    warm_ups,
)
_AXES = ("preload_n", "indenter_radius_mm", "dynamic_force_n")


def inspect(campaign: Campaign, table: SigmaTable, keep_ids: Collection[str] | None = None) -> Inspected:
    """The campaign without unusable recordings, reversed sensors corrected, and the findings.

    Recordings whose contacts lie beyond the tables as declared are used if their ids are in `keep_ids`; None: if a
    plausible modulus brings them within.
    """
    given = list(frf_recordings(campaign)) if campaign.recordings else []
    recorded, of_forces, are_many = without_wrong_forces(given, units_checked=campaign.units_checked)
    if are_many:
        return _inspected(campaign, [], of_forces, _impossible(of_forces, confirmable=True))
    series = as_lines(recorded)
    imported = frozenset(recording.id for recording in recorded if recording.sample_rate_hz is None)
    inspected = _inspect_lines(campaign, series.recordings, imported, table, keep_ids)
    findings = as_given(given, [*of_forces, *series.findings, *inspected.findings])
    return replace(inspected, findings=findings, uneven=series.uneven, unsure=series.unsure)


def _inspect_lines(
    campaign: Campaign,
    recorded: Sequence[FrfRecording],
    imported: frozenset[str],
    table: SigmaTable,
    keep_ids: Collection[str] | None,
) -> Inspected:
    with_lines, of_lines = _with_lines(recorded)
    originals, copies = _without_copies(with_lines)
    screened = Screened(campaign, originals, table, imported)
    misgiven = all_positions(screened)
    recordings, of_values = without_slips(screened, OF_VALUES)
    findings = [*of_lines, *copies, *of_values]
    if not recordings:
        return _inspected(campaign, recordings, findings)
    screened = replace(screened, recordings=recordings)
    contradictory = [*loose_sphere(recordings), *overlapping_sensors(campaign), *misgiven]
    exchanged = exchanged_values(campaign.skin, recordings, table)
    lines = [lines_of(recording).frequency for recording in recordings]
    doubtful = [*unlikely(campaign, recordings, lines), *at_sensors(screened), *exchanged]
    findings += [*doubtful, *contradictory]
    if contradictory or (doubtful and not campaign.units_checked):
        lacking = _impossible([*doubtful, *contradictory], confirmable=not contradictory)
        return _inspected(campaign, [], findings, lacking)
    findings += [*_constant_axes(recordings), *faint_oscillation(recordings)]
    recordings, of_labels = without_slips(screened, OF_LABELS)
    recordings, beyond, of_domain = within_tables(campaign, recordings, table, keep_ids)
    findings += [*of_labels, *of_domain]
    if not recordings:
        return _inspected(campaign, recordings, findings)
    level = np.array([np.abs(np.nanmedian(lines_of(recording).values)) for recording in recordings])
    far, of_far = far_contacts(recordings, level, response_shares(campaign.skin, recordings, table))
    findings += of_far
    recordings = [recording for recording, is_far in zip(recordings, far, strict=True) if not is_far]
    if not recordings:
        return _inspected(campaign, recordings, findings)
    screened = replace(screened, recordings=recordings)
    if screened.comparison.unresponsive.all():
        findings.append(Finding(Reason.SILENT_CAMPAIGN, "", _FIELD, {"recordings": len(recordings)}))
        return _inspected(campaign, [], findings, Lacking(Lack.NO_RESPONSE))
    if (contradiction := contradicting(screened.comparison.ratio)) is not None:
        return _inspected(campaign, [], [*findings, contradiction], Lacking(Lack.TWO_RECORDINGS_CONTRADICT))
    findings += unlikely_d33(screened.comparison.ratio, campaign.skin.d33_pc_per_n)
    recordings, of_responses = without_slips(screened, OF_RESPONSES)
    inspected = _inspected(campaign, recordings, [*findings, *of_responses])
    return replace(inspected, beyond=beyond & {recording.id for recording in recordings})


def _inspected(
    campaign: Campaign, recordings: Sequence[FrfRecording], findings: Sequence[Finding], lacking: Lacking | None = None
) -> Inspected:
    usable = replace(campaign, recordings=tuple(recordings))
    if lacking is None and len(recordings) < LEAST_RECORDINGS:
        lacking = Lacking(Lack.FEW_RECORDINGS, {"recordings": len(recordings), "least": LEAST_RECORDINGS})
    elif (
        lacking is None
        and not recording_axes(usable)
        and max(len(lines_of(recording).values) for recording in recordings) < 2
    ):
        lacking = Lacking(Lack.MADE_ALIKE)
    return Inspected(usable, findings, lacking)


def _impossible(findings: Sequence[Finding], *, confirmable: bool) -> Lacking:
    """The fields to be corrected, or confirmed, before anything can be concluded."""
    fields = list(dict.fromkeys(finding.field for finding in findings))
    return Lacking(Lack.IMPOSSIBLE_DECLARATION, {"fields": fields, "confirmable": confirmable})


def _with_lines(recordings: Sequence[FrfRecording]) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings with a line that is finite and not 0, and the findings on the others."""
    usable, findings = [], []
    for recording in recordings:
        values = lines_of(recording).values
        finite = np.isfinite(values)
        reason = None if finite.all() else Reason.LINES_NOT_FINITE if finite.any() else Reason.NO_FINITE_LINE
        if finite.any() and not np.abs(values[finite]).any():
            reason = Reason.ZERO_LINES
        if reason is not None:
            arguments = {"lines": int((~finite).sum())}
            findings.append(Finding(reason, recording.id, _FIELD, arguments))
        if reason in (None, Reason.LINES_NOT_FINITE):
            usable.append(recording)
    return usable, findings


def _without_copies(recordings: list[FrfRecording]) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings without copies, whose lines agree but for rounding; compared if their means nearly agree."""
    lines = [np.nan_to_num(lines_of(recording).values) for recording in recordings]
    size = np.array([float(np.abs(values).mean()) for values in lines])
    is_copy, findings = np.zeros(len(recordings), dtype=bool), list[Finding]()
    for index, recording in enumerate(recordings):
        near = ~is_copy[:index] & (np.abs(size[:index] - size[index]) <= _SAME * size[index])
        original = next((first for first in np.flatnonzero(near) if _alike(lines[first], lines[index])), None)
        if original is not None:
            is_copy[index] = True
            arguments = {"original": recordings[original].id}
            findings.append(Finding(Reason.DUPLICATED_RECORDING, recording.id, _FIELD, arguments))
    return [recording for recording, copied in zip(recordings, is_copy, strict=True) if not copied], findings


def _alike(first: Complexes, second: Complexes) -> bool:
    return len(first) == len(second) and bool((np.abs(first - second) <= _SAME * np.abs(first)).all())


def _constant_axes(recordings: list[FrfRecording]) -> list[Finding]:
    findings = []
    if len(recordings) > 1:
        constant = [name for name in _AXES if agree(name, [getattr(recording, name) for recording in recordings])]
        findings += [Finding(Reason.CONSTANT_AXIS, "", name, {"axis": name}) for name in constant]
    if recordings and max(len(lines_of(recording).values) for recording in recordings) < 2:
        findings.append(Finding(Reason.ONE_LINE, "", "frequency_hz"))
    return findings
