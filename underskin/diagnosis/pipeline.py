"""A campaign's diagnosis: findings → lines → search → residuals and location → held-out groups → plan → report."""

import importlib.metadata
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy

import underskin
from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.inference.explanation import FittingProblem
from underskin.diagnosis.inference.residuals import residuals, whole_prediction
from underskin.diagnosis.localisation.effect_size import effect
from underskin.diagnosis.localisation.permutation_test import SEED, in_region, locate, region
from underskin.diagnosis.localisation.residual_shape import (
    contradicts,
    describe,
    largest_floor_percent,
    worth_telling,
)
from underskin.diagnosis.planning.optimal_design import plan
from underskin.diagnosis.planning.rig_limits import Limits
from underskin.diagnosis.reporting.report import Diagnosis, report
from underskin.diagnosis.screening.curve_unit_errors import without_slips
from underskin.diagnosis.screening.inspection import inspect
from underskin.diagnosis.screening.physical_limits import without_extremes
from underskin.diagnosis.screening.unusable_curves import without_unusable
from underskin.diagnosis.selection.noise_refinement import frf_problem
from underskin.diagnosis.selection.search import Search, search
from underskin.diagnosis.validation import cross_validation
from underskin.diagnosis.validation.identifiability import confounding, left_open
from underskin.diagnosis.validation.platen_seating import without_seating
from underskin.mechanisms.base import Kind
from underskin.recordings.campaign import Campaign, FrfRecording, RecordingProblem
from underskin.recordings.finding import Finding
from underskin.recordings.plausibility import implausible
from underskin.surrogate.sigma_table import SigmaTable

_CURVES: tuple[Kind, ...] = ("indentation", "compression")
_LARGEST_FLOOR = 100.0  # % of what is predicted: beyond it the recordings are noise

Progress = Callable[[float], None]
NO_LIMITS = Limits()


def diagnose(
    campaign: Campaign, table: SigmaTable, progress: Progress = lambda _: None, limits: Limits = NO_LIMITS
) -> Diagnosis:
    """What recordings and model disagree about, and what physics was left out.

    Deterministic, but for a campaign that states times to come (underskin.campaign_findings). Raises InvalidInput where
    the campaign has no FRF recording.
    """
    found = _diagnosed(campaign, table, progress, limits)
    return replace(found, findings=tuple(dict.fromkeys((*implausible(campaign), *found.findings))))


def _diagnosed(campaign: Campaign, table: SigmaTable, progress: Progress, limits: Limits) -> Diagnosis:
    provenance = _provenance(table)
    progress(0.05)
    possible = without_extremes(campaign)
    if possible.found and possible.lacking:
        return Diagnosis(campaign.name, possible.found, provenance, lacking=possible.lacking)
    campaign, left_out = possible.campaign, list(possible.found)
    for kind in () if any(isinstance(entry, FrfRecording) for entry in campaign.recordings) else _CURVES:
        if all(entry.kind != kind for entry in campaign.recordings):
            continue
        usable, found = without_unusable(campaign, kind)
        curves = without_slips(usable, kind)
        left_out += [*found, *curves.found]
        if curves.found and curves.lacking:
            return Diagnosis(campaign.name, left_out, provenance, lacking=curves.lacking)
        rows = curve_lines(curves.campaign, kind)
        if rows.recordings:
            problem = FittingProblem(rows, table)
            result = search(problem)
            seated = without_seating(curves.campaign, result.answers[0].names, table) if kind == "compression" else None
            if seated is not None:
                problem, said = seated
                left_out, result = [*left_out, said], search(problem)
            return _work_out(campaign.name, problem, result, left_out, provenance, progress, limits)
    frf = tuple(entry for entry in campaign.recordings if isinstance(entry, FrfRecording))
    inspected = inspect(replace(campaign, recordings=frf), table)
    found = [*left_out, *inspected.found]
    if inspected.lacking:
        return Diagnosis(campaign.name, found, provenance, lacking=inspected.lacking)
    problem = frf_problem(inspected.campaign, inspected.uneven, table)
    return _work_out(campaign.name, problem, search(problem), found, provenance, progress, limits)


def _work_out(
    name: str,
    problem: FittingProblem,
    result: Search,
    found: Sequence[Finding],
    provenance: dict[str, Any],
    progress: Progress,
    limits: Limits,
) -> Diagnosis:
    """All steps after the search."""
    progress(0.65)
    confounded = confounding(problem)
    progress(0.7)
    leader = result.answers[0]
    nothing = next(entry for entry in result.explanations if not entry.names)
    shown = result.shown_or_nothing(leader)
    levels = shown.best.at.marginal.levels
    gain = float(np.clip(levels.gain, 0.005, 0.05))
    against_base = residuals(problem, nothing, gain, levels.position)
    axes = locate(problem.lines, against_base)
    ranges = region(problem.lines, against_base, axes)
    size = effect(
        problem.lines, whole_prediction(problem, nothing), in_region(problem.lines, ranges), gain, levels.level
    )
    progress(0.8)
    ranked = [answer.explanation for answer in result.answers if answer.explanation is not None]
    groups = cross_validation.hold_out(problem, ranked, nothing, result.supported)
    progress(0.95)
    if contradicts(problem, nothing):
        result = replace(result, null_contradicted=True)
        leader = result.answers[0]
        shown = result.shown_or_nothing(leader)
    floor = largest_floor_percent(problem, nothing, groups)
    if leader.explanation is nothing and floor > _LARGEST_FLOOR:
        lacking = f"a response that stands out of its noise, which is {floor:.0f} % of what is predicted"
        return Diagnosis(name, found, provenance, lacking=lacking)
    shape = describe(problem, shown) if leader.explanation is None else ""
    return Diagnosis(
        name,
        (*found, *worth_telling(problem, shown, groups)),
        provenance,
        search=result,
        problem=problem,
        axes=axes,
        region=ranges,
        effect=size,
        groups=groups,
        confounded=left_open(confounded, result.answers),
        shape=shape,
        next_experiment=plan(problem, result, limits),
    )


def diagnosis_report(
    campaign: Campaign,
    table: SigmaTable,
    progress: Progress = lambda _: None,
    refused: Sequence[RecordingProblem] = (),
) -> dict[str, Any]:
    """The report of a campaign's diagnosis (`report/1`); `refused` recordings are named among the findings."""
    found = with_refused(diagnose(campaign, table, progress), refused)
    progress(1.0)
    return report(found)


def with_refused(found: Diagnosis, refused: Sequence[RecordingProblem]) -> Diagnosis:
    """The diagnosis with recordings that were refused when they were read named first among its findings."""
    problems = [
        Finding("refused", entry.recording, entry.field, f"{entry.field} = {entry.value!r}: {entry.allowed}; left out")
        for entry in refused
    ]
    lacking = found.lacking
    if lacking and problems:
        fields = " and ".join(dict.fromkeys(entry.field for entry in refused))
        count = len({entry.recording for entry in refused})
        lacking = f"{count} recording(s) were refused for their {fields} (see findings), which leaves {lacking}"
    return replace(found, findings=(*problems, *found.findings), lacking=lacking)


def _provenance(table: SigmaTable) -> dict[str, Any]:
    return {
        "underskin": importlib.metadata.version(underskin.__name__),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "tables": {"sigma": table.sha256},
        "seed": SEED,
    }
