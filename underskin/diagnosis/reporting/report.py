"""The report (`report/1`): the results of all steps as one document, its numbers rounded to stated digits.

Four significant digits for values, three decimals for probabilities and p-values: enough for any use. The same input
gives the same report on one machine; on a processor that rounds differently a last digit may differ.
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
    left_by,
    not_tried,
    reserves,
    slips,
)
from underskin.diagnosis.reporting.law_statement import statement as law_statement
from underskin.diagnosis.reporting.numbers import (
    at_bounds,
    idealised,
    parameter,
    rounded,
    sensors_apart,
    without_effect,
)
from underskin.diagnosis.reporting.statements import BY_NUISANCES, StatedD33, stated_d33
from underskin.diagnosis.reporting.unlisted_law import LeadingLaw, confirming, unnamed
from underskin.diagnosis.selection.answers import Answer, Search
from underskin.diagnosis.selection.priors import least_evidence
from underskin.diagnosis.selection.search import KindsTogether
from underskin.diagnosis.validation import cross_validation
from underskin.diagnosis.validation.signatures import Confounding, HiddenShift, Power
from underskin.findings.codes import FindingCode
from underskin.findings.finding import Finding
from underskin.findings.formatting import in_digits
from underskin.findings.lacking import Lacking
from underskin.mechanisms.models.curves import CurveModel
from underskin.physics.sphere_law import PARABOLOID
from underskin.recordings.campaign import Campaign, IndentationRecording

SCHEMA = "report/1"
_ALTERNATIVES = 6
_LEAST_PROBABILITY = 0.005
_STIFFER_WITH_DEPTH = frozenset({"layered_contact", "strain_stiffening"})


@dataclass(frozen=True)
class DiagnosisResult:
    """Everything that the steps worked out about one campaign; `search` is None where the data were too few."""

    name: str
    findings: Sequence[Finding]
    provenance: Mapping[str, Any]
    skin_d33_pc_per_n: float | None = None  # as the skin declares it
    level_unsure: float = 0.0  # relative uncertainty of all FRFs that noise in their channels leaves
    lacking: Lacking | None = None  # of a campaign from which nothing can be concluded
    search: Search | None = None
    few: Search | None = None  # in its place where recordings agree with the model but are too few to say so alone
    problem: FittingProblem | None = None
    axes: Sequence[AxisResult] = ()
    region: Mapping[str, list[float | str]] = field(default_factory=dict)
    effect: EffectSize | None = None
    groups: Sequence[cross_validation.HeldOut] = ()
    confounded: Sequence[Confounding] = ()
    power: Sequence[Power] = ()
    shifts: Sequence[HiddenShift] = ()
    shape: Shape | None = None  # of what remains, where no mechanism describes it
    plan: NextRecordings | None = None
    curves: Campaign | None = None  # with every sample, where curves were diagnosed
    joined: KindsTogether | None = None  # with recordings of other kinds

    def with_findings(self, *further: Finding) -> "DiagnosisResult":
        """The same with further findings behind the others."""
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
    """The verdict that the probabilities give, as docs/diagnosis.md explains it.

    A set of mechanisms explains nothing while one of them may as well have no effect, or has a parameter at the bound
    of its search; nor does the base model with d33 or a free modulus there.
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
    """Whether a thickness that nobody declared leaves open which of a thin layer and a stiffening sample stiffens a
    curve with depth: the one in place of the other is no less probable than a law of contact that idealises may be."""
    lines = explanation.best.hypothesis.lines
    if lines.kind != "indentation" or lines.campaign.skin.thickness_mm is not None:
        return False
    evidence = {frozenset(entry.names): entry.log_evidence for entry in search.explanations}
    least = explanation.log_evidence - least_evidence(explanation)
    names = frozenset(explanation.names)
    own = names & _STIFFER_WITH_DEPTH
    others = [names - own | {other} for other in _STIFFER_WITH_DEPTH - own] if len(own) == 1 else []
    return any(evidence.get(other, -math.inf) > least for other in others)


def _idle(diagnosis: DiagnosisResult, explanation: Explanation) -> list[str]:
    """Its mechanisms that may as well have no effect, and show on no recordings of another kind."""
    joined = diagnosis.joined
    return [
        name
        for name in without_effect(explanation)
        if joined is None or not joined.shows_on_curves(name, explanation.names)
    ]


@dataclass(frozen=True)
class Reported:
    """A report, plain JSON values, and its d33 with what keeps it from being quoted."""

    document: dict[str, Any]
    d33: StatedD33


def report(diagnosis: DiagnosisResult) -> dict[str, Any]:
    """The document."""
    return reported(diagnosis).document


def reported(diagnosis: DiagnosisResult) -> Reported:
    """The document and its d33."""
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
        mechanisms += _of_curves_alone(diagnosis, leader)
    told_by_kind = [] if diagnosis.joined is None else goodness_of_fit.by_kind(diagnosis.joined, shown.names)
    contradictory = [] if diagnosis.joined is None else goodness_of_fit.contradictions(diagnosis.joined)
    law = None if leading is None else unnamed(search, problem, leading, diagnosis.groups)
    stands = (stated in ("explained", "no_mismatch") or leading is not None) and leader.probability >= EXPLAINED
    d33 = stated_d33(
        search,
        problem,
        fit,
        diagnosis.shifts,
        stands=stands,
        contradictory=bool(contradictory),
        at_bounds=[one.words for one in at_bounds(shown)],
        law=leading,
        unsure=diagnosis.level_unsure,
        skin_pc_per_n=diagnosis.skin_d33_pc_per_n,
    )
    alike = numbers.alike(search, problem, float(fit["noise_floor_percent"] or 0.0)) if problem.kind == "frf" else None
    findings = [finding.in_report() for finding in (*diagnosis.findings, *fit_warnings(problem, shown), *d33.findings)]
    present = numbers.presence(search, numbers.present(search, problem))
    # At a typical strength: what shows only where it changes more than it usually does, would be read as ruled out
    unseen = {entry.mechanism for entry in diagnosis.confounded if entry.confounded_with in BY_NUISANCES}
    unseen |= {entry.mechanism for entry in d33.hidden}
    plain = [entry for entry in diagnosis.power if entry.mechanism not in unseen]
    of_kinds = "" if diagnosis.joined is None else goodness_of_fit.moduli_clause(diagnosis.joined, told_by_kind)
    untried = _not_tried(stated, search, problem, findings)
    around = StatementContext(
        slips=[*slips(findings), *([apart] if (apart := sensors_apart(problem, shown)) else [])],
        contradictions=[entry["statement"] for entry in contradictory],
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
        beside = [entry["name"] for entry in mechanisms]
        left = left_by(fit, SIMPLEST[problem.kind], beside) if problem.lines.curves else ""
        statement = law_statement(leader.probability, leading, law, floor, around, left)
    else:
        of_answer = AnswerFacts(
            groups=present,
            idle=_idle(diagnosis, named) if named is not None else (),
            at_bounds=[one.words for one in at_bounds(named)] if named is not None else (),
            mechanisms=mechanisms,
            told=_told(problem, mechanisms) if named is not None else (),
        )
        # What remains tells no form where a mechanism that may explain it was not tried
        shape = "" if untried else statements.shape_clause(diagnosis.shape)
        statement = answer_statement(search.answers, stated, problem.kind, fit, around, of_answer, shape, plain)
    whole = {
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
            {"mechanism": entry.mechanism, "smallest_visible_percent": rounded(entry.smallest_visible_percent, 2)}
            for entry in diagnosis.power
        ],
        "d33": d33.document,
        **({"by_kind": told_by_kind, "contradictions": contradictory} if told_by_kind else {}),
        "next_experiment": diagnosis.next_experiment or None,
        # The rest was left early: hopeless, or without a gain over the smaller set that it grew from.
        "provenance": {
            **diagnosis.provenance,
            **({} if leading is None else {"unnamed": leading.as_fitted}),
            **({} if alike is None else {"alike": alike}),
            "sets_of_mechanisms": {"tried": search.tried, "fitted": len(search.explanations)},
        },
    }
    return Reported(whole, d33)


def _depths_clause(problem: FittingProblem, explanation: Explanation) -> str:
    """How deep spheres were pressed, over their radius and the declared thickness; empty of other recordings."""
    model, lines = explanation.model, problem.lines
    if lines.kind != "indentation" or not isinstance(model, CurveModel):
        return ""
    curves = [one for one in lines.campaign.recordings if isinstance(one, IndentationRecording)]
    contacts = explanation.point.fit[model.contact_points].tolist()
    depths = [float(one.displacement_mm.max()) - at for one, at in zip(curves, contacts, strict=True)]
    over = max(depth / one.indenter_radius_mm for depth, one in zip(depths, curves, strict=True))
    said = f"pressed to {in_digits(over, 2)} of the radius"
    if over > PARABOLOID:
        said += " (by the law of the whole sphere)"
    thickness = lines.campaign.skin.thickness_mm
    return said if thickness is None else f"{said}, {in_digits(max(depths) / thickness, 2)} of the thickness"


def _not_tried(
    stated: str, search: Search, problem: FittingProblem, findings: Sequence[Mapping[str, str]]
) -> list[str]:
    """What was not tried, where something remains that it could explain."""
    remains = stated in ("unexplained", "ambiguous") or any(
        entry["code"] == FindingCode.REMAINDER for entry in findings
    )
    return not_tried(search.unsupported, problem.kind) if remains else []


def _mechanisms(search: Search, problem: FittingProblem, explanation: Explanation) -> list[dict[str, Any]]:
    places = parameter_slices(explanation.names, explanation.best.hypothesis.lines)
    whole = cross_validation.in_sample(problem, explanation)
    probabilities = numbers.present(search, problem)
    return [
        {
            "name": name,
            "probability": round(probabilities.get(name, 0.0), 3),
            "parameters": [parameter(explanation, place) for place in range(places[name].start, places[name].stop)],
            "explains_percent": explains_percent(search, problem, explanation, name, whole),
        }
        for name in explanation.names
        if name in problem.lines.mechanisms.named
    ]


def _of_curves_alone(diagnosis: DiagnosisResult, leader: Answer) -> list[dict[str, Any]]:
    if diagnosis.joined is None or leader.explanation is None or diagnosis.search is None or diagnosis.problem is None:
        return []
    present = numbers.present(diagnosis.search, diagnosis.problem)
    own = goodness_of_fit.of_curves_alone(diagnosis.joined, leader.alone, leader.explanation.names)
    return [{**entry, "probability": round(present.get(entry["name"], 0.0), 3)} for entry in own]


def _told(problem: FittingProblem, mechanisms: Sequence[Mapping[str, Any]]) -> list[str]:
    """What the parameters of each mean together, where they do not speak for themselves."""
    values = {one["name"]: {entry["name"]: entry["value"] for entry in one["parameters"]} for one in mechanisms}
    return [said for name, own in values.items() if (said := problem.lines.mechanisms[name].told(own))]


def _alternatives(search: Search) -> list[dict[str, Any]]:
    answers = search.answers
    leader = answers[0]
    alternatives: list[dict[str, Any]] = []
    for answer in answers[1:]:
        enough = answer.probability < _LEAST_PROBABILITY and len(alternatives) > 1
        if enough or len(alternatives) >= _ALTERNATIVES:
            break
        said = {"mechanisms": list(answer.names), "probability": round(answer.probability, 3)}
        alternatives.append({**said, "why_not": statements.why_not(answer, leader)})
    return alternatives


def _location(diagnosis: DiagnosisResult, problem: FittingProblem, agrees: bool) -> dict[str, Any]:
    assert diagnosis.effect is not None
    effect, region = diagnosis.effect, diagnosis.region
    whole = {name: reaches_all_along(problem.lines, name, ends) for name, ends in region.items()}
    return {
        "axes": [
            {
                "axis": entry.axis,
                "p_value": None if entry.p_value is None else round(entry.p_value, 3),
                "share_percent": round(100 * float(entry.share), 1),
                **({"undecidable": why} if (why := statements.undecidable(entry)) else {}),
            }
            for entry in diagnosis.axes
        ],
        "region": {name: [rounded(x) if isinstance(x, float) else x for x in ends] for name, ends in region.items()},
        "effect_percent": rounded(effect.percent, 3),
        "effect_interval_percent": [rounded(effect.low, 3), rounded(effect.high, 3)],
        "statement": statements.location_statement(diagnosis.axes, region, whole, effect, agrees=agrees),
    }
