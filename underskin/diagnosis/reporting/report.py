"""The report (`report/1`): the results of all steps of a diagnosis as one document of plain JSON values.

Values have four significant digits, probabilities and p-values three decimals. The same input gives the same report on
one machine; on a processor that rounds differently a last digit may differ.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from underskin.diagnosis.data.names import EXPLAINED, NOTHING_MISSING, SIMPLEST
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.hypothesis import parameter_slices
from underskin.diagnosis.localisation import AxisResult, EffectSize, Shape, reaches_all_along
from underskin.diagnosis.planning.optimal_design import NextRecordings
from underskin.diagnosis.reporting import goodness_of_fit, numbers, statements
from underskin.diagnosis.reporting import statements as next_experiment
from underskin.diagnosis.reporting.goodness_of_fit import explains_percent, fit_summary, fit_warnings
from underskin.diagnosis.reporting.law_statement import (
    AnswerFacts,
    StatementContext,
    answer_statement,
    insufficient_statement,
    misfit_clause,
    not_tried,
    reserves,
    slips,
)
from underskin.diagnosis.reporting.law_statement import statement as law_statement
from underskin.diagnosis.reporting.numbers import (
    at_bounds,
    idealised,
    outlying_sensors,
    parameter_with_interval,
    rounded,
    without_effect,
)
from underskin.diagnosis.reporting.statements import BY_NUISANCES, StatedD33, stated_d33
from underskin.diagnosis.reporting.unlisted_law import LeadingLaw, confirming, law_document
from underskin.diagnosis.selection.answers import Answer, Search
from underskin.diagnosis.selection.priors import least_evidence
from underskin.diagnosis.selection.search import KindsTogether
from underskin.diagnosis.validation import cross_validation
from underskin.diagnosis.validation.signatures import Confounding, HiddenShift, Power
from underskin.findings.codes import FindingCode
from underskin.findings.finding import Finding
from underskin.findings.formatting import in_digits
from underskin.findings.lacking import Lacking
from underskin.mechanisms.laws import contact_creep, strain_stiffening
from underskin.mechanisms.models.curves import CurveModel
from underskin.physics.sphere_law import PARABOLOID
from underskin.recordings.campaign import Campaign, IndentationRecording

SCHEMA = "report/1"
_ALTERNATIVES = 6
_LEAST_PROBABILITY = 0.005
_STIFFER_WITH_DEPTH = frozenset({"layered_contact", "strain_stiffening"})


@dataclass(frozen=True)
class DiagnosisResult:
    """The results of all steps on one campaign; `search` is None where the data were too few."""

    name: str
    findings: Sequence[Finding]
    provenance: Mapping[str, Any]
    skin_d33_pc_per_n: float | None = None  # as the skin declares it
    level_unsure: float = 0.0  # relative uncertainty of all FRFs due to noise in their channels
    lacking: Lacking | None = None  # of a campaign from which nothing can be concluded
    search: Search | None = None
    few: Search | None = None  # instead of `search` where recordings agree with the model but are too few to say so
    problem: FittingProblem | None = None
    axes: Sequence[AxisResult] = ()
    region: Mapping[str, list[float | str]] = field(default_factory=dict)
    effect: EffectSize | None = None
    groups: Sequence[cross_validation.HeldOut] = ()
    confounded: Sequence[Confounding] = ()
    power: Sequence[Power] = ()
    shifts: Sequence[HiddenShift] = ()
    shape: Shape | None = None  # of the residual, where no mechanism describes it
    plan: NextRecordings | None = None
    curves: Campaign | None = None  # with every sample, where curves were diagnosed
    joined: KindsTogether | None = None  # with recordings of other kinds

    def with_findings(self, *further: Finding) -> "DiagnosisResult":
        """The same result with further findings appended."""
        return replace(self, findings=(*self.findings, *further))

    @property
    def next_experiment(self) -> dict[str, Any]:
        """The recordings to make next, as in the report; empty where all is decided."""
        planned = next_experiment.next_experiment(self.plan)
        if planned or self.search is None or self.problem is None or verdict(self) != "unexplained":
            return planned
        leading = LeadingLaw.of(self.problem, self.search.fit_behind(self.search.answers[0]))
        return {} if leading is None else confirming(self.problem, leading)


def verdict(diagnosis: DiagnosisResult) -> str:
    """The verdict by the probabilities, as docs/diagnosis.md explains it.

    A set of mechanisms explains nothing if one of them may as well have no effect, or has a parameter at the bound of
    its search; nor does the base model with d33 or a free modulus at a bound.
    """
    if diagnosis.search is None:
        return "insufficient_data"
    leader = diagnosis.search.answers[0]
    if leader.explanation is None:
        return "unexplained"
    if at_bounds(leader.explanation):
        return "ambiguous"
    if leader.names == (NOTHING_MISSING,):
        return "no_mismatch"
    certain = leader.probability >= EXPLAINED and not _idle(diagnosis, leader.explanation)
    certain = certain and not _may_be_the_other(diagnosis.search, leader.explanation)
    return "explained" if certain else "ambiguous"


def _may_be_the_other(search: Search, explanation: Explanation) -> bool:
    """Whether an undeclared thickness leaves open if a thin layer or a stiffening sample stiffens curves with depth.

    That is so where the evidence of one in place of the other is above that which an idealised contact law may have.
    """
    lines = explanation.best.hypothesis.lines
    if lines.kind != "indentation" or lines.campaign.skin.thickness_mm is not None:
        return False
    evidence = {frozenset(candidate.names): candidate.log_evidence for candidate in search.explanations}
    least = explanation.log_evidence - least_evidence(explanation)
    names = frozenset(explanation.names)
    stiffening = names & _STIFFER_WITH_DEPTH
    others = (
        [names - stiffening | {other} for other in _STIFFER_WITH_DEPTH - stiffening] if len(stiffening) == 1 else []
    )
    return any(evidence.get(other, -math.inf) > least for other in others)


def _idle(diagnosis: DiagnosisResult, explanation: Explanation) -> list[str]:
    """Mechanisms that may as well have no effect, and are not supported by recordings of another kind."""
    joined = diagnosis.joined
    return [
        name
        for name in without_effect(explanation)
        if joined is None or not joined.shows_on_curves(name, explanation.names)
    ]


@dataclass(frozen=True)
class Reported:
    """A report of plain JSON values, and its d33 with the reasons against quoting it."""

    document: dict[str, Any]
    d33: StatedD33


def report(diagnosis: DiagnosisResult) -> dict[str, Any]:
    """The report of a diagnosis."""
    return reported(diagnosis).document


def reported(diagnosis: DiagnosisResult) -> Reported:
    """The report of a diagnosis, and its d33."""
    stated = verdict(diagnosis)
    document: dict[str, Any] = {"schema": SCHEMA, "campaign": diagnosis.name, "verdict": stated}
    if diagnosis.search is None or diagnosis.problem is None:
        findings = [finding.in_report() for finding in diagnosis.findings]
        nothing = {
            **document,
            "probability": 1.0,
            "statement": insufficient_statement(diagnosis.lacking, slips(findings)),
            "location": {"axes": [], "region": {}, "effect_percent": None, "statement": "Nothing was located."},
            "mechanisms": [],
            "presence": [],
            "unnamed": None,
            "alternatives": [],
            "idealised": [],
            "not_identifiable": [],
            "findings": findings,
            "fit": None,
            "power": [],
            "d33": None,
            "next_experiment": None,
            "provenance": dict(diagnosis.provenance),
        }
        return Reported(nothing, StatedD33(None, why_not=["its recordings say too little"]))
    search, problem = diagnosis.search, diagnosis.problem
    leader = search.answers[0]
    shown = search.fit_behind(leader)
    fit = fit_summary(search, problem, diagnosis.groups, shown)
    named = leader.explanation if stated in ("explained", "ambiguous") else None
    leading = LeadingLaw.of(problem, shown) if stated == "unexplained" else None
    stated_set = named if leading is None else leading.explanation
    mechanisms = [] if stated_set is None else _mechanisms(search, problem, stated_set)
    if named is not None:
        mechanisms += _mechanisms_of_curves(diagnosis, leader)
    by_kind = [] if diagnosis.joined is None else goodness_of_fit.by_kind(diagnosis.joined, shown.names)
    contradictory = [] if diagnosis.joined is None else goodness_of_fit.contradictions(diagnosis.joined)
    law = None if leading is None else law_document(search, problem, leading, diagnosis.groups)
    stands = (stated in ("explained", "no_mismatch") or leading is not None) and leader.probability >= EXPLAINED
    d33 = stated_d33(
        search,
        problem,
        fit,
        diagnosis.shifts,
        stands=stands,
        contradictory=bool(contradictory),
        at_bounds=[bound.words for bound in at_bounds(shown)],
        law=leading,
        unsure=diagnosis.level_unsure,
        skin_pc_per_n=diagnosis.skin_d33_pc_per_n,
    )
    alike = numbers.alike(search, problem, float(fit["noise_floor_percent"] or 0.0)) if problem.kind == "frf" else None
    findings = [finding.in_report() for finding in (*diagnosis.findings, *fit_warnings(problem, shown), *d33.findings)]
    present = numbers.presence(search, numbers.present(search, problem))
    # Detection limits are left out for mechanisms that would not show at a typical strength: they are not ruled out
    unseen = {
        confounding.mechanism for confounding in diagnosis.confounded if confounding.confounded_with in BY_NUISANCES
    }
    unseen |= {shift.mechanism for shift in d33.hidden}
    plain = [limit for limit in diagnosis.power if limit.mechanism not in unseen]
    of_kinds = "" if diagnosis.joined is None else goodness_of_fit.moduli_clause(diagnosis.joined, by_kind)
    untried = _not_tried(stated, search, problem, findings)
    around = StatementContext(
        slips=[*slips(findings), *([outliers] if (outliers := outlying_sensors(problem, shown)) else [])],
        contradictions=[contradiction["statement"] for contradiction in contradictory],
        reserves=[*reserves(findings), *untried],
        quoted=[
            of_kinds,
            _depths_clause(problem, shown),
            "" if alike is None else numbers.alike_clause(alike),
            d33.clause(),
        ],
    )
    if leading is not None and law is not None:
        floor = float(fit["noise_floor_percent"] or float("nan"))
        mechanism_names = [mechanism["name"] for mechanism in mechanisms]
        misfit = misfit_clause(fit, SIMPLEST[problem.kind], mechanism_names) if problem.lines.curves else ""
        statement = law_statement(leader.probability, leading, law, floor, around, misfit)
    else:
        of_answer = AnswerFacts(
            groups=present,
            idle=_idle(diagnosis, named) if named is not None else (),
            at_bounds=[bound.words for bound in at_bounds(named)] if named is not None else (),
            mechanisms=mechanisms,
            meanings=_meanings(mechanisms) if named is not None else (),
        )
        # The shape of the residual is not stated where a mechanism that may explain it was not tried
        shape = "" if untried else statements.shape_clause(diagnosis.shape)
        statement = answer_statement(search.answers, stated, problem.kind, fit, around, of_answer, shape, plain)
    completed = {
        **document,
        "probability": round(leader.probability, 3),
        "statement": statement,
        "location": _location(diagnosis, problem, stated == "no_mismatch"),
        "mechanisms": mechanisms,
        "presence": present,
        "unnamed": law,
        "alternatives": _alternatives(search),
        "idealised": idealised(search, problem, shown),
        "not_identifiable": d33.not_identifiable(diagnosis.confounded),
        "findings": findings,
        "fit": fit,
        "power": [
            {"mechanism": limit.mechanism, "smallest_visible_percent": rounded(limit.smallest_visible_percent, 2)}
            for limit in diagnosis.power
        ],
        "d33": d33.document,
        **({"by_kind": by_kind, "contradictions": contradictory} if by_kind else {}),
        "next_experiment": diagnosis.next_experiment or None,
        # Sets that were tried but not fitted could not win, or did not improve on the smaller set.
        "provenance": {
            **diagnosis.provenance,
            **({} if leading is None else {"unnamed": leading.as_fitted}),
            **({} if alike is None else {"alike": alike}),
            "sets_of_mechanisms": {"tried": search.tried, "fitted": len(search.explanations)},
        },
    }
    return Reported(completed, d33)


def _depths_clause(problem: FittingProblem, explanation: Explanation) -> str:
    """A clause on the depth of indentation over radius and declared thickness; empty for other recordings."""
    model, lines = explanation.model, problem.lines
    if lines.kind != "indentation" or not isinstance(model, CurveModel):
        return ""
    curves = [curve for curve in lines.campaign.recordings if isinstance(curve, IndentationRecording)]
    contacts = explanation.point.fit[model.contact_points].tolist()
    depths = [float(curve.displacement_mm.max()) - at for curve, at in zip(curves, contacts, strict=True)]
    over = max(depth / curve.indenter_radius_mm for depth, curve in zip(depths, curves, strict=True))
    clause = f"pressed to {in_digits(over, 2)} of the radius"
    if over > PARABOLOID:
        clause += " (by the law of the whole sphere)"
    thickness = lines.campaign.skin.thickness_mm
    return clause if thickness is None else f"{clause}, {in_digits(max(depths) / thickness, 2)} of the thickness"


def _not_tried(
    stated: str, search: Search, problem: FittingProblem, findings: Sequence[Mapping[str, str]]
) -> list[str]:
    """Clauses on mechanisms that were not tried, where they could explain a residual."""
    remains = stated in ("unexplained", "ambiguous") or any(
        finding["code"] == FindingCode.REMAINDER for finding in findings
    )
    return not_tried(search.unsupported, problem.kind) if remains else []


def _mechanisms(search: Search, problem: FittingProblem, explanation: Explanation) -> list[dict[str, Any]]:
    spans = parameter_slices(explanation.names, explanation.best.hypothesis.lines)
    score = cross_validation.in_sample(problem, explanation)
    probabilities = numbers.present(search, problem)
    return [
        {
            "name": name,
            "probability": round(probabilities.get(name, 0.0), 3),
            "parameters": [
                parameter_with_interval(explanation, index) for index in range(spans[name].start, spans[name].stop)
            ],
            "explains_percent": explains_percent(search, problem, explanation, name, score),
        }
        for name in explanation.names
        if name in problem.lines.mechanisms.named
    ]


def _mechanisms_of_curves(diagnosis: DiagnosisResult, leader: Answer) -> list[dict[str, Any]]:
    if diagnosis.joined is None or leader.explanation is None or diagnosis.search is None or diagnosis.problem is None:
        return []
    present = numbers.present(diagnosis.search, diagnosis.problem)
    mechanisms = goodness_of_fit.mechanisms_of_curves(diagnosis.joined, leader.alone, leader.explanation.names)
    return [{**mechanism, "probability": round(present.get(mechanism["name"], 0.0), 3)} for mechanism in mechanisms]


_MEANINGS = {
    contact_creep.ContactCreep.name: contact_creep.meaning,
    strain_stiffening.StrainStiffening.name: strain_stiffening.meaning,
}


def _meanings(mechanisms: Sequence[Mapping[str, Any]]) -> list[str]:
    """The joint meaning of each mechanism's parameters, where a single value does not show it."""
    meanings = [
        _MEANINGS[mechanism["name"]]({parameter["name"]: parameter["value"] for parameter in mechanism["parameters"]})
        for mechanism in mechanisms
        if mechanism["name"] in _MEANINGS
    ]
    return [meaning for meaning in meanings if meaning]


def _alternatives(search: Search) -> list[dict[str, Any]]:
    answers = search.answers
    leader = answers[0]
    alternatives: list[dict[str, Any]] = []
    for answer in answers[1:]:
        enough = answer.probability < _LEAST_PROBABILITY and len(alternatives) > 1
        if enough or len(alternatives) >= _ALTERNATIVES:
            break
        document = {"mechanisms": list(answer.names), "probability": round(answer.probability, 3)}
        alternatives.append({**document, "why_not": statements.why_not(answer, leader)})
    return alternatives


def _location(diagnosis: DiagnosisResult, problem: FittingProblem, agrees: bool) -> dict[str, Any]:
    assert diagnosis.effect is not None
    effect, region = diagnosis.effect, diagnosis.region
    reaches_all = {name: reaches_all_along(problem.lines, name, ends) for name, ends in region.items()}
    return {
        "axes": [
            {
                "axis": result.axis,
                "p_value": None if result.p_value is None else round(result.p_value, 3),
                "share_percent": round(100 * float(result.share), 1),
                **({"undecidable": why} if (why := statements.undecidable(result)) else {}),
            }
            for result in diagnosis.axes
        ],
        "region": {name: [rounded(x) if isinstance(x, float) else x for x in ends] for name, ends in region.items()},
        "effect_percent": rounded(effect.percent, 3),
        "effect_interval_percent": [rounded(effect.low, 3), rounded(effect.high, 3)],
        "statement": statements.location_statement(diagnosis.axes, region, reaches_all, effect, agrees=agrees),
    }
