"""The report (`report/1`): the facts of a diagnosis as one document of plain JSON values.

Values have four significant digits, probabilities and p-values three decimals. The same input gives the same report on
one machine; on a processor that rounds differently a last digit may differ.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.localisation import reaches_all_along
from underskin.diagnosis.reporting import entries, numbers, statement
from underskin.diagnosis.reporting.facts import DiagnosisResult, Facts
from underskin.diagnosis.reporting.headline import headline
from underskin.diagnosis.reporting.numbers import rounded
from underskin.diagnosis.reporting.quantities import StatedD33
from underskin.diagnosis.reporting.unlisted_law import confirming
from underskin.diagnosis.selection.answers import Search, remainder
from underskin.findings.formatting import in_digits
from underskin.mechanisms.models.curves import CurveModel

SCHEMA = "report/1"
ALTERNATIVES = 6
LEAST_PROBABILITY = 0.005  # of an alternative, or a mechanism, that is listed
EMPTY: Mapping[str, Any] = {  # the report of recordings that say too little, and the order of all reports
    "schema": SCHEMA,
    "campaign": "",
    "verdict": "insufficient_data",
    "probability": None,
    "headline": "",
    "statement": "",
    "location": {"axes": [], "region": {}, "effect_percent": None, "statement": "Nothing was located."},
    "mechanisms": [],
    "presence": [],
    "unnamed": None,
    "alternatives": [],
    "idealised": [],
    "not_identifiable": [],
    "findings": [],
    "fit": None,
    "remainder": None,
    "power": [],
    "d33": None,
}


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
    if diagnosis.search is None:
        findings = [finding.in_report() for finding in diagnosis.findings]
        document = {
            **EMPTY,
            "campaign": diagnosis.name,
            "probability": 1.0,
            "statement": statement.insufficient_statement(diagnosis.lacking, findings),
            "findings": findings,
            "next_experiment": None,
            "provenance": dict(diagnosis.provenance),
        }
        document["headline"] = headline(document)
        return Reported(document, StatedD33(None, why_not=["its recordings say too little"]))
    facts = Facts(diagnosis)
    search, leading = facts.search, facts.leading
    document = {
        **EMPTY,
        "campaign": diagnosis.name,
        "verdict": facts.verdict,
        "probability": round(facts.leader.probability, 3),
        "statement": statement.statement(facts),
        "location": _location(facts),
        "mechanisms": facts.mechanisms,
        "presence": facts.presence,
        "unnamed": facts.law,
        "alternatives": _alternatives(search),
        "idealised": numbers.idealised(search, facts.problem, facts.shown, facts.traits.measured),
        "not_identifiable": facts.d33.not_identifiable(diagnosis.confounded),
        "findings": facts.findings,
        "fit": facts.fit,
        "remainder": _remainder(facts.problem, facts.shown),
        "power": [
            {"mechanism": limit.mechanism, "smallest_visible_percent": rounded(limit.smallest_visible_percent, 2)}
            for limit in diagnosis.power
        ],
        "d33": facts.d33.document,
        **({"by_kind": facts.by_kind, "contradictions": facts.contradictions} if facts.by_kind else {}),
        "next_experiment": next_experiment(diagnosis) or None,
        # Sets that were tried but not fitted could not win, or did not improve on the smaller set.
        "provenance": {
            **diagnosis.provenance,
            **({} if leading is None else {"unnamed": leading.as_fitted}),
            **({} if facts.alike is None else {"alike": facts.alike}),
            "sets_of_mechanisms": {"tried": search.tried, "fitted": len(search.explanations)},
        },
    }
    document["headline"] = headline(document)
    return Reported(document, facts.d33)


def next_experiment(diagnosis: DiagnosisResult) -> dict[str, Any]:
    """The recordings to make next, as in the report; empty where all is decided."""
    planned = {} if diagnosis.plan is None else entries.next_experiment(diagnosis.plan)
    if planned or diagnosis.search is None:
        return planned
    facts = Facts(diagnosis)
    return {} if facts.leading is None else confirming(facts.problem, facts.leading)


def _alternatives(search: Search) -> list[dict[str, Any]]:
    leader, *others = search.answers
    alternatives: list[dict[str, Any]] = []
    for answer in others[:ALTERNATIVES]:
        if answer.probability < LEAST_PROBABILITY and len(alternatives) > 1:
            break
        why_not = entries.why_not(answer, leader)
        document = {"mechanisms": list(answer.names), "probability": round(answer.probability, 3)}
        alternatives.append({**document, "why_not": why_not})
    return alternatives


def _location(facts: Facts) -> dict[str, Any]:
    axes, region, effect = facts.diagnosis.axes, facts.diagnosis.region, facts.diagnosis.effect
    assert effect is not None
    partial = {name: ends for name, ends in region.items() if not reaches_all_along(facts.problem.lines, name, ends)}
    return {
        "axes": [
            {
                "axis": result.axis,
                "p_value": None if result.p_value is None else round(result.p_value, 3),
                "share_percent": round(100 * float(result.share), 1),
                **({"undecidable": why} if (why := entries.undecidable(result)) else {}),
            }
            for result in axes
        ],
        "region": {name: [rounded(x) if isinstance(x, float) else x for x in ends] for name, ends in region.items()},
        "effect_percent": rounded(effect.percent, 3),
        "effect_interval_percent": [rounded(effect.low, 3), rounded(effect.high, 3)],
        "statement": entries.location_statement(axes, partial, effect, agrees=facts.verdict == "no_mismatch"),
    }


_PARTS = 10  # tenths of the depth: curves are summed up in some hundred samples


def _remainder(problem: FittingProblem, explanation: Explanation) -> dict[str, Any] | None:
    """The smooth error of the force beyond an explanation: percent of the largest force, its size over a sample's
    noise, the axis along which it was looked for, and a statement with the tenth of the depth where it is largest.

    None of FRFs, and where nothing stands out of the noise.
    """
    found = remainder(explanation)
    model, lines = explanation.model, problem.lines
    if found is None or not isinstance(model, CurveModel):
        return None
    square = (lines.value - model.predict(explanation.point.fit).value).real ** 2
    depths = []
    contacts = explanation.point.fit[model.contact_points].tolist()
    for curve, at, rows in zip(lines.campaign.curves, contacts, lines.spans, strict=True):
        travel = curve.displacement_mm - at
        travel = travel * np.sign(travel[np.abs(lines.value[rows].real).argmax()])  # also of pulled samples
        depths.append(travel / max(float(travel.max()), 1e-12))
    depth = np.concatenate(depths)
    part = np.minimum((_PARTS * depth[depth > 0]).astype(np.intp), _PARTS - 1)
    mean = np.bincount(part, square[depth > 0], _PARTS) / np.maximum(np.bincount(part, minlength=_PARTS), 1)
    low, high = (round(100 * end / _PARTS) for end in (int(mean.argmax()), int(mean.argmax()) + 1))
    percent, over_noise = 100 * found[0], found[1]
    statement = (
        f"{in_digits(percent, 2)} % of the largest force remains, {in_digits(over_noise, 2)} times a sample's noise, "
        f"the most at {low} to {high} % of the depth."
    )
    stated = {"percent": rounded(percent), "over_noise": rounded(over_noise)}
    return {**stated, "axis": "displacement_mm", "statement": statement}
