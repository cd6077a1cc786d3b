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
from underskin.diagnosis.slips.comparison import compared
from underskin.diagnosis.slips.exchanged_sensors import without_exchanges
from underskin.diagnosis.slips.level_slips import without_level_slips
from underskin.diagnosis.slips.phase_convention import in_common_convention
from underskin.diagnosis.slips.position_errors import at_sensors, misplaced
from underskin.diagnosis.slips.reversed_signs import without_reversed
from underskin.diagnosis.slips.silent import dead, without_silent_pair
from underskin.diagnosis.slips.table_domain import within_tables
from underskin.diagnosis.slips.time_series import as_given, as_lines
from underskin.diagnosis.slips.unit_errors import (
    faint_oscillation,
    levels_off_by_1000,
    single_unit_errors,
    unlikely_d33,
)
from underskin.findings.codes import Lack, Lacking, Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.models.composed import compose
from underskin.prediction.pressed_skin import exchanged_values
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.plausibility import loose_sphere, overlapping_sensors, unlikely
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes

LEAST_RECORDINGS = 2  # to compare one with another
_SAME = 1e-4  # relative difference of copies: files round numbers to some digits
_AXES = ("preload_n", "indenter_radius_mm", "dynamic_force_n")


def inspect(campaign: Campaign, table: SigmaTable, keep_ids: Collection[str] | None = None) -> Inspected:
    """The campaign without unusable recordings, reversed sensors corrected, and the findings.

    Recordings whose contacts lie beyond the tables as declared are used if their ids are in `keep_ids`; None: if a
    plausible modulus brings them within.
    """
    recorded = frf_recordings(campaign) if campaign.recordings else ()
    series = as_lines(recorded, units_checked=campaign.units_checked)
    if series.doubtful:
        return _inspected(campaign, [], series.doubtful, _impossible(series.doubtful, confirmable=True))
    imported = {recording.id for recording in recorded if recording.sample_rate_hz is None}
    inspected = _inspect_lines(campaign, series.recordings, imported, table, keep_ids)
    findings = as_given(recorded, [*series.findings, *inspected.findings])
    return replace(inspected, findings=findings, uneven=series.uneven, unsure=series.unsure)


def _inspect_lines(
    campaign: Campaign,
    recorded: Sequence[FrfRecording],
    imported: Collection[str],
    table: SigmaTable,
    keep_ids: Collection[str] | None,
) -> Inspected:
    with_lines, of_lines = _with_lines(recorded)
    recordings, copies = _without_copies(with_lines)
    off, unit_errors = single_unit_errors(recordings)
    astray, of_positions, misgiven = misplaced(campaign, recordings)
    findings = [*of_lines, *copies, *unit_errors, *of_positions]
    recordings = [recording for recording, wrong in zip(recordings, off | astray, strict=True) if not wrong]
    if not recordings:
        return _inspected(campaign, recordings, findings)
    contradictory = [*loose_sphere(recordings), *overlapping_sensors(campaign), *misgiven]
    exchanged = exchanged_values(campaign.skin, recordings, table)
    lines = [lines_of(recording).frequency for recording in recordings]
    doubtful = [*unlikely(campaign, recordings, lines), *at_sensors(campaign, recordings), *exchanged]
    findings += [*doubtful, *contradictory]
    if contradictory or (doubtful and not campaign.units_checked):
        lacking = _impossible([*doubtful, *contradictory], confirmable=not contradictory)
        return _inspected(campaign, [], findings, lacking)
    findings += [*_constant_axes(recordings), *faint_oscillation(recordings)]
    recordings, of_phase = in_common_convention(recordings, imported)
    recordings, of_sensors = without_exchanges(campaign, recordings, table)
    recordings, silent = without_silent_pair(recordings)
    consistent = _against_model(campaign, recordings, table, keep_ids)
    findings += [*of_phase, *of_sensors, *silent, *consistent.findings]
    recordings = list(frf_recordings(consistent.campaign)) if consistent.campaign.recordings else []
    if consistent.lacking is not None:
        return _inspected(campaign, recordings, findings, consistent.lacking)
    recordings, of_levels = without_level_slips(campaign, recordings, table)
    inspected = _inspected(campaign, recordings, [*findings, *of_levels])
    return replace(inspected, beyond=consistent.beyond & {recording.id for recording in recordings})


def _against_model(
    campaign: Campaign, recordings: list[FrfRecording], table: SigmaTable, keep_ids: Collection[str] | None
) -> Inspected:
    """The recordings compared with the base model: those within the tables that respond, with their true signs."""
    model = compose((), replace(campaign, recordings=tuple(recordings)), table, "frf")
    inside, beyond, findings = within_tables(campaign, recordings, model, table, keep_ids)
    comparison = compared(recordings, model, inside | beyond)
    if comparison.unresponsive.all():
        silent = Finding(Reason.SILENT_CAMPAIGN, "", "frf_re_pc_per_n", {"recordings": len(recordings)})
        return Inspected(replace(campaign, recordings=()), [silent], Lacking(Lack.NO_RESPONSE))
    lost, dead_findings = dead(recordings, comparison)
    ratio = np.where(lost, np.nan, comparison.ratio)
    off, off_findings, lacking = levels_off_by_1000(recordings, ratio)
    findings += [*dead_findings, *off_findings]
    if lacking is not None:
        return Inspected(replace(campaign, recordings=()), findings, lacking)
    right, known, sign_findings = without_reversed(recordings, np.where(off, np.nan, ratio))
    findings += [*unlikely_d33(ratio, campaign.skin.d33_pc_per_n), *sign_findings]
    usable = (inside | beyond) & ~lost & ~off & known
    kept = tuple(recording for recording, chosen in zip(right, usable, strict=True) if chosen)
    far = frozenset(recording.id for recording, chosen in zip(right, usable & beyond, strict=True) if chosen)
    return Inspected(replace(campaign, recordings=kept), findings, beyond=far)


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
        if not finite.any():
            findings.append(Finding(Reason.NO_FINITE_LINE, recording.id, "frf_re_pc_per_n"))
        elif not np.abs(values[finite]).any():
            findings.append(Finding(Reason.ZERO_LINES, recording.id, "frf_re_pc_per_n"))
        else:
            if not finite.all():
                arguments = {"lines": int((~finite).sum())}
                findings.append(Finding(Reason.LINES_NOT_FINITE, recording.id, "frf_re_pc_per_n", arguments))
            usable.append(recording)
    return usable, findings


def _without_copies(recordings: list[FrfRecording]) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings without copies, whose lines agree but for rounding; compared if their means nearly agree."""
    lines = [np.nan_to_num(lines_of(recording).values) for recording in recordings]
    size = np.array([float(np.abs(values).mean()) for values in lines])
    original = np.arange(len(recordings))
    order = np.argsort(size, kind="stable")
    for rank, index in enumerate(order):
        for earlier in order[:rank][::-1]:
            if size[index] - size[earlier] > _SAME * size[index]:
                break
            if _alike(lines[index], lines[earlier]):
                original[max(index, earlier)] = min(original[index], original[earlier])
    findings = [
        Finding(
            Reason.DUPLICATED_RECORDING,
            recordings[index].id,
            "frf_re_pc_per_n",
            {"original": recordings[int(first)].id},
        )
        for index, first in enumerate(original)
        if first != index
    ]
    return [recording for index, recording in enumerate(recordings) if original[index] == index], findings


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
