"""A campaign's diagnosis: screening → rows with noise → search → location → held-out groups → plan → report."""

import importlib.metadata
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy

from underskin.diagnosis.data.dataset import Inspected, curve_lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import residuals, whole_prediction
from underskin.diagnosis.localisation import SEED, AxisResult, EffectSize, describe, effect, in_region, locate, region
from underskin.diagnosis.noise import NoiseLevels
from underskin.diagnosis.planning.optimal_design import plan
from underskin.diagnosis.planning.rig_limits import RigLimits
from underskin.diagnosis.reporting.report import DiagnosisResult
from underskin.diagnosis.screening.curve_unit_errors import without_inconsistent
from underskin.diagnosis.screening.inspection import inspect
from underskin.diagnosis.screening.physical_limits import without_extremes
from underskin.diagnosis.screening.unusable_curves import without_unusable
from underskin.diagnosis.selection.answers import Search, inside_tables_under_posterior
from underskin.diagnosis.selection.other_kinds import CurveLikelihood
from underskin.diagnosis.selection.search import KindsTogether, OtherKinds, frf_problem, search, telling_modulus
from underskin.diagnosis.selection.unlisted_search import with_laws
from underskin.diagnosis.validation.cross_validation import (
    above_noise,
    held_out,
    largest_floor_percent,
    nearest_law_findings,
)
from underskin.diagnosis.validation.signatures import (
    Signatures,
    confounding,
    hidden_shifts,
    power,
    remaining_confounding,
    without_seating,
)
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.lacking import Lack, Lacking
from underskin.mechanisms.base import Kind
from underskin.mechanisms.registry import CATALOGUE, ActiveCatalogue
from underskin.recordings.campaign import Campaign, FrfRecording, RecordingProblem
from underskin.recordings.curve_preparation import prepared
from underskin.recordings.plausibility import implausible
from underskin.recordings.usual_scatter import GAIN_RANGE
from underskin.surrogate.sigma_table import SigmaTable

_KINDS: tuple[Kind, ...] = ("frf", "indentation", "compression")  # the first that there is gives the verdict
_LEAST_TO_AGREE = 3  # FRFs: d33 takes up what two have in common, and their gain scatters by what they differ
_UNUSUAL_SCATTER = 2.0  # times the gain scatter of a poor rig
_LARGEST_FLOOR = 100.0  # % of what is predicted: beyond it the recordings are noise

Progress = Callable[[float], None]
NO_LIMITS = RigLimits()


def diagnose(
    campaign: Campaign,
    table: SigmaTable,
    progress: Progress = lambda _: None,
    limits: RigLimits = NO_LIMITS,
    without: Collection[str] = (),
) -> DiagnosisResult:
    """What recordings and model disagree about, and what physics was left out.

    FRFs are diagnosed where the campaign has any; else its indentation curves, else its compression curves. What the
    other kinds tell of the same material counts with them (selection/search.py). From a campaign that holds
    nothing usable nothing is concluded. Deterministic, but for a campaign that states times to come
    (`recordings/plausibility.py`). Mechanisms `without` which it is to be explained are left out of the catalogue.

    Raises InvalidInput where one of those is not in it.
    """
    diagnosis = _diagnosed(prepared(campaign).campaign, table, progress, limits, ActiveCatalogue(without))
    return replace(diagnosis, findings=tuple(dict.fromkeys((*implausible(campaign), *diagnosis.findings))))


def _diagnosed(
    campaign: Campaign, table: SigmaTable, progress: Progress, limits: RigLimits, mechanisms: ActiveCatalogue
) -> DiagnosisResult:
    progress(0.05)
    possible = without_extremes(campaign)
    declared = campaign.skin.d33_pc_per_n
    begun = DiagnosisResult(campaign.name, possible.findings, _provenance(table, mechanisms), declared)
    if possible.findings and possible.lacking:
        return replace(begun, lacking=possible.lacking)
    campaign = possible.campaign
    kinds = [kind for kind in _KINDS if any(entry.kind == kind for entry in campaign.recordings)]
    curves: dict[Kind, Campaign] = {}
    for kind in kinds:
        if kind == "frf":
            continue
        usable, unusable = without_unusable(campaign, kind)
        consistent = without_inconsistent(usable, kind)
        begun = begun.with_findings(*unusable, *consistent.findings)
        if (unusable or consistent.findings) and consistent.lacking and kind == kinds[0]:
            return replace(begun, lacking=consistent.lacking)
        if curve_lines(consistent.campaign, kind).recordings:
            curves[kind] = consistent.campaign
    if kinds and "frf" not in kinds and not curves:
        return replace(begun, lacking=Lacking(Lack.NO_CURVE))
    if "frf" in kinds or not curves:
        return _of_frf(
            begun, campaign, table, mechanisms, OtherKinds(curves, table, mechanisms.without), progress, limits
        )
    kind = next(iter(curves))
    others = OtherKinds({other: own for other, own in curves.items() if other != kind}, table, mechanisms.without)
    return _of_curves(begun, curves[kind], kind, table, mechanisms, others, progress, limits)


def _of_frf(
    begun: DiagnosisResult,
    campaign: Campaign,
    table: SigmaTable,
    mechanisms: ActiveCatalogue,
    others: OtherKinds,
    progress: Progress,
    limits: RigLimits,
) -> DiagnosisResult:
    frf = tuple(entry for entry in campaign.recordings if isinstance(entry, FrfRecording))
    inspected = inspect(replace(campaign, recordings=frf), table)
    joined: KindsTogether | None = None
    while not inspected.lacking:
        joined = _searched(inspected, table, mechanisms, others)
        if not inspected.beyond:
            break
        kept = inspected.beyond & inside_tables_under_posterior(joined.problem, joined.search)
        if kept == inspected.beyond:
            break
        inspected = inspect(replace(campaign, recordings=frf), table, kept)
    begun = replace(begun.with_findings(*inspected.findings), level_unsure=inspected.unsure)
    if joined is None or inspected.lacking:
        return replace(begun, lacking=inspected.lacking)
    problem, result = joined.problem, joined.search
    result = replace(result, laws=tuple(with_laws(problem, result)))
    return _work_out(replace(begun, joined=joined), problem, result, progress, limits)


def _searched(
    inspected: Inspected, table: SigmaTable, mechanisms: ActiveCatalogue, others: OtherKinds
) -> KindsTogether:
    """The search on FRFs, with what other kinds tell."""
    alone, known = frf_problem(inspected.campaign, inspected.uneven, table, mechanisms)

    def fitted(
        beside: CurveLikelihood | None, required_sets: Sequence[frozenset[str]]
    ) -> tuple[FittingProblem, Search]:
        """Beside other kinds under the same noise, so that evidences can be compared."""
        if beside is None:
            return alone, search(alone, known)
        problem = FittingProblem(alone.lines, table, beside)
        return problem, search(problem, required_sets=required_sets)

    return others.joined(fitted)


def _of_curves(
    begun: DiagnosisResult,
    campaign: Campaign,
    kind: Kind,
    table: SigmaTable,
    mechanisms: ActiveCatalogue,
    others: OtherKinds,
    progress: Progress,
    limits: RigLimits,
) -> DiagnosisResult:
    mechanisms.bind(campaign, table, kind)
    rows = replace(curve_lines(campaign, kind), mechanisms=mechanisms)

    def fitted(
        beside: CurveLikelihood | None, required_sets: Sequence[frozenset[str]]
    ) -> tuple[FittingProblem, Search]:
        problem = FittingProblem(rows, table, beside)
        return problem, search(problem, required_sets=required_sets)

    joined = others.joined(fitted)
    problem, result = joined.problem, joined.search
    seated = without_seating(campaign, result.answers[0].names, table) if kind == "compression" else None
    if seated is not None:
        problem, seating = seated
        begun, result = begun.with_findings(seating), search(problem)
    result = replace(result, laws=tuple(with_laws(problem, result)))
    return _work_out(replace(begun, curves=campaign, joined=joined), problem, result, progress, limits)


def _work_out(
    begun: DiagnosisResult, problem: FittingProblem, result: Search, progress: Progress, limits: RigLimits
) -> DiagnosisResult:
    """All steps after the search."""
    progress(0.65)
    signatures = Signatures(problem)
    confounded = confounding(signatures)
    progress(0.7)
    leader = result.answers[0]
    nothing = next(entry for entry in result.explanations if not entry.names)
    shown = result.fit_behind(leader)
    axes, ranges, size = _located(problem, nothing, shown.best.levels)
    progress(0.8)
    ranked = [answer.explanation for answer in result.answers if answer.explanation is not None]
    showing = [entry for entry in ranked if result.is_supported(entry)]
    groups = held_out(problem, result, showing, nothing)
    progress(0.95)
    result = replace(result, other_tip=_other_tips(begun, problem))
    leader = result.answers[0]
    shown = result.fit_behind(leader)
    floor = largest_floor_percent(problem, nothing, groups)
    if leader.explanation is nothing and floor > _LARGEST_FLOOR:
        return replace(begun, lacking=Lacking(Lack.NOISE, {"floor_percent": floor}))
    if leader.explanation is nothing and problem.kind == "frf" and problem.lines.recordings < _LEAST_TO_AGREE:
        few = {"recordings": problem.lines.recordings, "least": _LEAST_TO_AGREE}
        return replace(begun, lacking=Lacking(Lack.FEW_TO_AGREE, few), few=result, problem=problem)
    undescribed = leader.explanation is None and result.law is None
    begun = begun.with_findings(*_scatter(problem, shown))
    shape = describe(problem, shown) if undescribed else None
    begun = begun.with_findings(*(nearest_law_findings(problem, result, nothing) if undescribed else ()))
    return replace(
        begun.with_findings(*above_noise(problem, shown, groups)),
        search=result,
        problem=problem,
        axes=axes,
        region=ranges,
        effect=size,
        groups=groups,
        confounded=remaining_confounding(confounded, result.answers),
        power=power(signatures, shown, result.supported),
        shifts=hidden_shifts(problem, signatures, shown, result.supported, telling_modulus(begun.joined, shown.names)),
        shape=shape,
        plan=plan(problem, result, limits),
    )


def _located(
    problem: FittingProblem, nothing: Explanation, levels: NoiseLevels
) -> tuple[list[AxisResult], dict[str, list[float | str]], EffectSize]:
    """Where the recordings depart from the base model, and by how much there; `levels` are those of the answer."""
    gain = float(np.clip(levels.gain, 0.005, 0.05))
    against_base = residuals(problem, nothing, gain, levels.position)
    axes = locate(problem.lines, against_base)
    ranges = region(problem.lines, against_base, axes)
    prediction = whole_prediction(problem, nothing)
    return axes, ranges, effect(problem.lines, prediction, in_region(problem.lines, ranges), gain, levels.level)


def _scatter(problem: FittingProblem, shown: Explanation) -> list[Finding]:
    """Of FRFs: a gain that scatters from recording to recording by far more than that of rigs."""
    gain, usual = shown.best.levels.gain, GAIN_RANGE[1]
    if problem.kind != "frf" or gain <= _UNUSUAL_SCATTER * usual:
        return []
    return [Finding(Reason.UNUSUAL_SCATTER, "", "frf", {"percent": 100 * gain, "usual": 100 * usual})]


def _other_tips(begun: DiagnosisResult, problem: FittingProblem) -> float:
    """The share of curves whose tip looks like a cone, which no mechanism lists."""
    tips = {finding.recording for finding in begun.findings if finding.reason is Reason.TIP_SHAPE}
    return min(len(tips) / problem.lines.recordings, 1.0)


def refused(problems: Sequence[RecordingProblem]) -> list[Finding]:
    """Recordings that were refused when they were read, as findings."""
    return [
        Finding(
            Reason.REFUSED,
            entry.recording,
            entry.field,
            {"field": entry.field, "value": entry.value, "allowed": entry.allowed},
        )
        for entry in problems
    ]


def with_refused(diagnosis: DiagnosisResult, problems: Sequence[RecordingProblem]) -> DiagnosisResult:
    """The diagnosis with recordings that were refused when they were read named first among its findings."""
    lacking = diagnosis.lacking
    if lacking and problems:
        lacking = replace(
            lacking,
            refused_recordings=len({entry.recording for entry in problems}),
            refused_fields=tuple(dict.fromkeys(entry.field for entry in problems)),
        )
    return replace(diagnosis, findings=(*refused(problems), *diagnosis.findings), lacking=lacking)


def _provenance(table: SigmaTable, mechanisms: ActiveCatalogue) -> dict[str, Any]:
    return {
        "underskin": importlib.metadata.version("underskin"),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "tables": {"sigma": table.sha256},
        "seed": SEED,
        **({"mechanisms": dict(CATALOGUE.packages)} if CATALOGUE.packages else {}),
        **({"without": list(mechanisms.without)} if mechanisms.without else {}),
    }
