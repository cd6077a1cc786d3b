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
from underskin.diagnosis.slips.amplitude_factors import Step, amplitude_step, without_step
from underskin.diagnosis.slips.declared_values import unlikely
from underskin.diagnosis.slips.exchanged_cables import exchanged_cables, with_right_sensors
from underskin.diagnosis.slips.exchanged_sensors import without_exchanges
from underskin.diagnosis.slips.levels import causes_of, levels
from underskin.diagnosis.slips.model_consistency import against_model
from underskin.diagnosis.slips.phase_convention import in_common_convention
from underskin.diagnosis.slips.position_errors import at_sensors, misplaced
from underskin.diagnosis.slips.sensor_alone import OutlyingSensor, outlying_sensor, without_sensor_gain
from underskin.diagnosis.slips.silent_together import without_silent_pair
from underskin.diagnosis.slips.time_series import as_given, as_lines
from underskin.diagnosis.slips.unit_errors import faint_oscillation, single_unit_errors
from underskin.diagnosis.slips.warm_up import WarmUp, warming, without_first
from underskin.diagnosis.slips.weak_sensors import weak_sensors
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
_MOST = 300  # recordings: the covariance of more takes minutes
_MOST_SLIPS = 3


def without_level_slips(
    campaign: Campaign, recordings: Sequence[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings corrected for errors in their levels, or without them, and the findings."""
    remaining, findings = list(recordings), list[Finding]()
    if len(remaining) >= _LEAST:
        weak, findings = weak_sensors(remaining, levels(campaign, remaining, table))
        remaining = [recording for recording, off in zip(remaining, weak, strict=True) if not off]
    for _ in range(_MOST_SLIPS):
        correction = _plainest_slip(campaign, remaining, table)
        if correction is None:
            break
        remaining, finding = correction
        findings.append(finding)
    return remaining, findings


def _plainest_slip(
    campaign: Campaign, recordings: list[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], Finding] | None:
    """The recordings corrected for the error of largest gain, and the finding; None where there is none."""
    if len(recordings) < _LEAST:
        return None
    recorded_levels = levels(campaign, recordings, table)
    if not _LEAST <= len(recorded_levels.value) <= _MOST:
        return None
    slips = (
        amplitude_step(recorded_levels),
        warming(recorded_levels, causes_of(campaign, recordings, recorded_levels, table)),
        exchanged_cables(recorded_levels),
        outlying_sensor(recorded_levels),
    )
    plain = [slip for slip in slips if slip is not None]
    best = max(plain, key=lambda slip: slip.gain, default=None)
    if isinstance(best, Step):
        return without_step(recordings, recorded_levels, best)
    if isinstance(best, WarmUp):
        return without_first(recordings, best)
    if isinstance(best, OutlyingSensor):
        return without_sensor_gain(recordings, recorded_levels, best)
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    return None if best is None else with_right_sensors(recordings, recorded_levels, best, positions)


LEAST_RECORDINGS = 2
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
    doubtful = [*unlikely(campaign, recordings), *at_sensors(campaign, recordings), *exchanged]
    findings += [*doubtful, *contradictory]
    if contradictory or (doubtful and not campaign.units_checked):
        lacking = _impossible([*doubtful, *contradictory], confirmable=not contradictory)
        return _inspected(campaign, [], findings, lacking)
    findings += [*_constant_axes(recordings), *faint_oscillation(recordings)]
    recordings, of_phase = in_common_convention(recordings, imported)
    recordings, of_sensors = without_exchanges(campaign, recordings, table)
    recordings, silent = without_silent_pair(recordings)
    consistent = against_model(campaign, recordings, table, keep_ids)
    findings += [*of_phase, *of_sensors, *silent, *consistent.findings]
    if consistent.lacking is not None:
        return _inspected(campaign, consistent.recordings, findings, consistent.lacking)
    recordings, of_levels = without_level_slips(campaign, consistent.recordings, table)
    inspected = _inspected(campaign, recordings, [*findings, *of_levels])
    return replace(inspected, beyond=consistent.beyond & {recording.id for recording in recordings})


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
