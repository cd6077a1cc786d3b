"""A campaign's diagnosis: slips → rows with noise → search → location → held-out groups → plan → report."""

import importlib.metadata
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from underskin.diagnosis.data.dataset import curve_lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import Residuals, row_prediction
from underskin.diagnosis.localisation import SEED, AxisResult, EffectSize, effect, in_region, locate, region
from underskin.diagnosis.noise import NoiseLevels
from underskin.diagnosis.planning.optimal_design import plan
from underskin.diagnosis.planning.rig_limits import RigLimits
from underskin.diagnosis.reporting.facts import DiagnosisResult
from underskin.diagnosis.reporting.quantities import modulus_over_answers
from underskin.diagnosis.selection.answers import Search, inside_tables_under_posterior
from underskin.diagnosis.selection.priors import least_evidence
from underskin.diagnosis.selection.search import KindsTogether, frf_problem, joined, searched_alone
from underskin.diagnosis.selection.unlisted_search import with_laws
from underskin.diagnosis.slips.curve_unit_errors import without_inconsistent
from underskin.diagnosis.slips.inspection import inspect
from underskin.diagnosis.slips.physical_limits import without_extremes
from underskin.diagnosis.validation.cross_validation import (
    FAR_ABOVE,
    above_noise,
    held_out,
    largest_floor_percent,
    nearest_law_findings,
)
from underskin.diagnosis.validation.curve_checks import curve_spread_findings, odds_of_imitated_laws, thickness_findings
from underskin.diagnosis.validation.signatures import (
    Signatures,
    confounding,
    hidden_shifts,
    power,
    remaining_confounding,
)
from underskin.findings.codes import Lack, Lacking, Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import times_in_words
from underskin.inversion.mixed_model import GAIN_RANGE
from underskin.mechanisms.base import Kind
from underskin.mechanisms.registry import CATALOGUE, ActiveCatalogue
from underskin.recordings.campaign import Campaign, FrfRecording, RecordingProblem
from underskin.recordings.curve_course import contact_events
from underskin.recordings.curve_preparation import as_other_load, prepared
from underskin.recordings.plausibility import implausible
from underskin.surrogate.sigma_table import SigmaTable

_OF_CURVES: tuple[Kind, ...] = ("indentation", "compression")  # the first one present gives the verdict without FRFs
LEAST_RECORDINGS = 3  # FRFs: of two, d33 absorbs what is common, and the scatter of gain the difference
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
    """Where recordings and model disagree, and which physics the model lacks.

    FRFs are diagnosed where the campaign has any; else its indentation curves, else its compression curves. The other
    kinds count as further data on the same material (selection/search.py). Without usable recordings there is no
    verdict. Deterministic, except for a campaign that states future times (`recordings/plausibility.py`). The
    mechanisms `without` are left out of the catalogue.

    Raises InvalidInput where one of those is not in the catalogue.
    """
    run = _Run(table, progress, limits, ActiveCatalogue(without))
    diagnosis = _diagnose(prepared(campaign).campaign, run)
    return replace(diagnosis, findings=tuple(dict.fromkeys((*implausible(campaign), *diagnosis.findings))))


@dataclass(frozen=True)
class _Run:
    """What all steps of a diagnosis share."""

    table: SigmaTable
    progress: Progress
    limits: RigLimits
    mechanisms: ActiveCatalogue


def _diagnose(campaign: Campaign, run: _Run) -> DiagnosisResult:
    run.progress(0.05)
    within_limits = without_extremes(campaign)
    declared = campaign.skin.d33_pc_per_n
    partial = DiagnosisResult(campaign.name, within_limits.findings, _provenance(run), declared)
    if within_limits.findings and within_limits.lacking:
        return replace(partial, lacking=within_limits.lacking)
    campaign = within_limits.campaign
    has_frfs, present = bool(campaign.of(FrfRecording)), {curve.kind for curve in campaign.curves}
    curves: dict[Kind, Campaign] = {}
    kinds = [kind for kind in _OF_CURVES if kind in present]
    for kind in kinds:
        consistent = without_inconsistent(campaign, kind)
        partial = partial.with_findings(*consistent.findings)
        if consistent.findings and consistent.lacking and not has_frfs and kind == kinds[0]:
            return replace(partial, lacking=consistent.lacking)
        if curve_lines(consistent.campaign, kind).recordings:
            curves[kind] = consistent.campaign
    if has_frfs or not kinds:
        return _diagnose_frf(partial, campaign, curves, run)
    return _diagnose_curves(partial, curves, run) if curves else replace(partial, lacking=Lacking(Lack.NO_CURVE))


def _diagnose_frf(
    partial: DiagnosisResult, campaign: Campaign, curves: Mapping[Kind, Campaign], run: _Run
) -> DiagnosisResult:
    """By the FRFs, together with curves of other kinds."""
    frfs = replace(campaign, recordings=tuple(campaign.of(FrfRecording)))
    inspection, together = inspect(frfs, run.table), None
    other_kinds = [] if inspection.lacking else searched_alone(curves, run.table, run.mechanisms.without)
    while not inspection.lacking:
        problem, fitted = frf_problem(inspection.campaign, inspection.uneven, run.table, run.mechanisms)
        together = joined(problem, other_kinds, fitted)
        if not inspection.beyond:
            break
        beyond = inspection.beyond & inside_tables_under_posterior(together.problem, together.search)
        if beyond == inspection.beyond:
            break
        inspection = inspect(frfs, run.table, beyond)
    partial = replace(partial.with_findings(*inspection.findings), level_unsure=inspection.unsure)
    if together is None or inspection.lacking:
        return replace(partial, lacking=inspection.lacking)
    return _complete(partial, _with_unlisted(together), run)


def _diagnose_curves(partial: DiagnosisResult, curves: Mapping[Kind, Campaign], run: _Run) -> DiagnosisResult:
    """By the first kind of curves, together with the others."""
    (kind, campaign), *others = curves.items()
    partial = partial.with_findings(*(event for curve in campaign.curves for event in contact_events(curve)))
    other_kinds = searched_alone(dict(others), run.table, run.mechanisms.without)

    def searched(recorded: Campaign) -> KindsTogether:
        active = ActiveCatalogue(run.mechanisms.without)
        active.bind(recorded, run.table, kind)
        return joined(FittingProblem(replace(curve_lines(recorded, kind), mechanisms=active), run.table), other_kinds)

    together = searched(campaign)
    if (other_load := as_other_load(campaign)) is not None:
        campaign, together, findings = _pulled_or_pressed((campaign, together), (other_load, searched(other_load)))
        partial = partial.with_findings(*findings)
    together = _with_unlisted(together)
    problem, result = together.problem, together.search
    modulus = modulus_over_answers(result, problem, result.fit_behind(result.answers[0]))
    partial = partial.with_findings(*thickness_findings(campaign, problem, result, modulus))
    return _complete(replace(partial, curves=campaign), together, run)


def _with_unlisted(together: KindsTogether) -> KindsTogether:
    """With the unlisted laws that may matter among the rivals."""
    laws = tuple(with_laws(together.problem, together.search))
    return replace(together, search=replace(together.search, laws=laws))


_Searched = tuple[Campaign, KindsTogether]


def _pulled_or_pressed(stated: _Searched, other: _Searched) -> tuple[Campaign, KindsTogether, list[Finding]]:
    """Blocks by the stated signs or as under the other load, by the evidence of all sets of mechanisms under each, with
    equal prior odds; and the finding where it is the other, or stays open.

    It is the other if its base model alone outweighs all that the stated signs offer. Mechanisms that may bend a curve
    either way leave it open.
    """
    ours, theirs = stated[1].search, other[1].search
    least = least_evidence(ours.explanations[0])
    curve = next(curve for curve, turned in zip(stated[0].curves, other[0].curves, strict=True) if curve is not turned)
    is_pulled = bool(np.nansum(curve.force_n) < 0)  # by the stated signs
    is_open = [Finding(Reason.PULLED_OR_PRESSED, curve.id, "force_n", {"pulled": is_pulled})]
    if theirs.log_total < ours.log_total + least:
        return *stated, is_open if theirs.log_total > ours.log_total - least else []
    plain = theirs.log_weight(theirs.null) - ours.log_total
    if plain < least:
        return *other, is_open
    arguments = {"pulled": not is_pulled, "why": f"the other way {times_in_words(plain)} less probable"}
    return *other, [Finding(Reason.COUNTED_AS_OTHER_LOAD, curve.id, "force_n", arguments)]


def _complete(partial: DiagnosisResult, together: KindsTogether, run: _Run) -> DiagnosisResult:
    """All steps after the search."""
    problem, result = together.problem, together.search
    run.progress(0.65)
    signatures = Signatures(problem)
    confounded = confounding(signatures)
    run.progress(0.7)
    null = result.null
    result = replace(result, unlisted_odds=_unlisted_odds(partial, problem, result, null))
    leader = result.answers[0]
    stated = result.fit_behind(leader)
    axes, ranges, size = _locate(problem, null, stated.best.levels)
    run.progress(0.8)
    ranked = [answer.explanation for answer in result.answers if answer.explanation is not None]
    supported = [explanation for explanation in ranked if result.is_supported(explanation)]
    groups = held_out(problem, result, supported, null)
    run.progress(0.95)
    floor = largest_floor_percent(problem, null, groups)
    if leader.explanation is null and floor > _LARGEST_FLOOR:
        return replace(partial, lacking=Lacking(Lack.NOISE, {"floor_percent": floor}))
    if leader.explanation is null and problem.kind == "frf" and problem.lines.recordings < LEAST_RECORDINGS:
        few = {"recordings": problem.lines.recordings, "least": LEAST_RECORDINGS}
        return replace(partial, lacking=Lacking(Lack.FEW_TO_AGREE, few), few=result, problem=problem)
    undescribed = leader.explanation is None and result.law is None
    partial = partial.with_findings(*_scatter_findings(problem, stated))
    partial = partial.with_findings(*(nearest_law_findings(problem, result, null) if undescribed else ()))
    if leader.explanation is not None:
        partial = partial.with_findings(*curve_spread_findings(problem, stated, null))
    return replace(
        partial.with_findings(*above_noise(problem, stated, groups)),
        search=result,
        joined=together,
        problem=problem,
        axes=axes,
        region=ranges,
        effect=size,
        groups=groups,
        confounded=remaining_confounding(confounded, result.answers),
        power=power(signatures, stated, result.supported),
        shifts=hidden_shifts(problem, signatures, stated, result.supported, together.determining_modulus(stated.names)),
        plan=plan(problem, result, run.limits),
    )


def _locate(
    problem: FittingProblem, null: Explanation, levels: NoiseLevels
) -> tuple[list[AxisResult], dict[str, list[float | str]], EffectSize]:
    """Where the recordings deviate from the base model, and by how much there; `levels` are those of the answer."""
    gain = float(np.clip(levels.gain, 0.005, 0.05))
    against_base = Residuals.of(problem, null, gain, levels.position)
    axes = locate(problem.lines, against_base)
    ranges = region(problem.lines, against_base, axes)
    prediction = row_prediction(problem, null)
    return axes, ranges, effect(problem.lines, prediction, in_region(problem.lines, ranges), gain, levels.level)


def _scatter_findings(problem: FittingProblem, stated: Explanation) -> list[Finding]:
    """Of FRFs: a gain that scatters between recordings by far more than that of usual rigs."""
    gain, usual = stated.best.levels.gain, GAIN_RANGE[1]
    if problem.kind != "frf" or gain <= FAR_ABOVE * usual:
        return []
    return [Finding(Reason.UNUSUAL_SCATTER, "", "frf", {"percent": 100 * gain, "usual": 100 * usual})]


def _unlisted_odds(partial: DiagnosisResult, problem: FittingProblem, result: Search, null: Explanation) -> float:
    """Of indentations: the least odds of something unlisted beside the leading set, by the laws that this imitates, and
    by the share of curves whose tip looks like a cone, for which there is no mechanism."""
    leader = result.answers[0].explanation
    if problem.kind != "indentation" or leader is None:
        return 0.0
    tips = {finding.recording for finding in partial.findings if finding.reason is Reason.TIP_SHAPE}
    share = min(len(tips) / problem.lines.recordings, 1.0)
    return max(share, odds_of_imitated_laws(leader, null, result.supported))


def refused(problems: Sequence[RecordingProblem]) -> list[Finding]:
    """Recordings that were refused on reading, as findings."""
    return [
        Finding(
            Reason.REFUSED,
            problem.recording,
            problem.field,
            {"field": problem.field, "value": problem.value, "allowed": problem.allowed},
        )
        for problem in problems
    ]


def with_refused(diagnosis: DiagnosisResult, problems: Sequence[RecordingProblem]) -> DiagnosisResult:
    """The diagnosis with recordings that were refused on reading first among its findings."""
    lacking = diagnosis.lacking
    if lacking and problems:
        lacking = replace(
            lacking,
            refused_recordings=len({problem.recording for problem in problems}),
            refused_fields=tuple(dict.fromkeys(problem.field for problem in problems)),
        )
    return replace(diagnosis, findings=(*refused(problems), *diagnosis.findings), lacking=lacking)


def _provenance(run: _Run) -> dict[str, Any]:
    return {
        "underskin": importlib.metadata.version("underskin"),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "tables": {"sigma": run.table.sha256},
        "seed": SEED,
        **({"mechanisms": dict(CATALOGUE.packages)} if CATALOGUE.packages else {}),
        **({"without": list(run.mechanisms.without)} if run.mechanisms.without else {}),
    }
