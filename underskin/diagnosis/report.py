"""The report (`report/1`): what the steps found, in one document with numbers rounded to stated digits.

Four significant digits for values, three decimals for probabilities and p-values: enough for any use, and the same on
every machine.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.special import ndtri

from underskin.diagnosis import held_out
from underskin.diagnosis.confounding import Confounding
from underskin.diagnosis.explanation import Explanation, Workbench, own_places
from underskin.diagnosis.finding import Finding
from underskin.diagnosis.fit import COVARIANCE_NAMES
from underskin.diagnosis.locate import AxisResult
from underskin.diagnosis.search import NOTHING_MISSING, Answer, Search
from underskin.mechanisms.catalogue import CATALOGUE

SCHEMA = "report/1"
EXPLAINED = 0.8
_QUANTILE = float(ndtri(0.975))
_ALTERNATIVES = 6
_LEAST_PROBABILITY = 0.005


@dataclass(frozen=True)
class Diagnosis:
    """Everything that the steps worked out about one campaign; `search` is None where the data were too few."""

    name: str
    findings: Sequence[Finding]
    provenance: Mapping[str, Any]
    lacking: str = ""  # what a campaign that is too small lacks
    search: Search | None = None
    bench: Workbench | None = None
    axes: Sequence[AxisResult] = ()
    region: Mapping[str, list[float | str]] = field(default_factory=dict)
    effect_percent: float = 0.0
    groups: Sequence[held_out.HeldOut] = ()
    confounded: Sequence[Confounding] = ()
    shape: str = ""  # of what remains, where nothing here describes it
    next_experiment: Mapping[str, Any] = field(default_factory=dict)


def verdict(diagnosis: Diagnosis) -> str:
    """The verdict that the probabilities give, as DESIGN.md defines it."""
    if diagnosis.search is None:
        return "insufficient_data"
    leader = diagnosis.search.answers[0]
    if leader.names == (NOTHING_MISSING,):
        return "no_mismatch"
    if leader.explanation is None:
        return "unexplained"
    return "explained" if leader.probability >= EXPLAINED else "ambiguous"


def report(diagnosis: Diagnosis) -> dict[str, Any]:
    """The document; plain JSON values."""
    stated = verdict(diagnosis)
    document: dict[str, Any] = {"schema": SCHEMA, "campaign": diagnosis.name, "verdict": stated}
    findings = [
        {"code": entry.code, "recording": entry.recording, "field": entry.field, "statement": entry.statement}
        for entry in diagnosis.findings
    ]
    if diagnosis.search is None or diagnosis.bench is None:
        return {
            **document,
            "probability": 1.0,
            "statement": f"The recordings cannot tell anything: {diagnosis.lacking}.",
            "location": {"axes": [], "region": {}, "effect_percent": None, "statement": "nothing was located"},
            "mechanisms": [],
            "alternatives": [],
            "not_identifiable": [],
            "findings": findings,
            "fit": None,
            "d33": None,
            "next_experiment": None,
            "provenance": dict(diagnosis.provenance),
        }
    answers = diagnosis.search.answers
    leader = answers[0]
    named = stated in ("explained", "ambiguous")
    shown = diagnosis.search.shown_or_nothing(leader)
    return {
        **document,
        "probability": _probability(leader.probability),
        "statement": _statement(diagnosis, stated),
        "location": _location(diagnosis),
        "mechanisms": _mechanisms(diagnosis, leader) if named else [],
        "alternatives": _alternatives(answers),
        "not_identifiable": [
            {"mechanism": entry.mechanism, "confounded_with": entry.confounded_with, "reason": entry.reason}
            for entry in diagnosis.confounded
        ],
        "findings": findings + _at_bounds(leader, named),
        "fit": _fit(diagnosis, shown),
        "d33": None if diagnosis.bench.lines.curves else _parameter(shown, _place(shown, "d33")),
        "next_experiment": dict(diagnosis.next_experiment) or None,
        "provenance": dict(diagnosis.provenance),
    }


def rounded(value: float, digits: int = 4) -> float | None:
    """To significant digits; None for what is not finite."""
    return float(f"{value:.{digits}g}") if np.isfinite(value) else None


def _probability(value: float) -> float:
    return round(value, 3)


def _place(explanation: Explanation, name: str) -> int:
    return [entry.name for entry in explanation.model.parameters].index(name)


def _parameter(explanation: Explanation, place: int) -> dict[str, Any]:
    """A parameter's most probable value and 95 % interval, within its bounds."""
    fitter, point = explanation.best.fitter, explanation.point
    entry = fitter.parameters[place]
    if entry.name in COVARIANCE_NAMES:
        _, hessian = fitter.covariance_equations(explanation.best.at)
        names = [parameter.name for parameter in fitter.covariance]
        variance = float(np.linalg.pinv(hessian)[names.index(entry.name), names.index(entry.name)])
    else:
        index = fitter.places.index(place)
        variance = float(explanation.best.covariance[index, index])
    reach = _QUANTILE * np.sqrt(max(variance, 0.0))
    low, high = entry.bounds
    middle = float(point.fit[place])
    ends = (max(middle - reach, low), min(middle + reach, high))
    return {
        "name": entry.name,
        "unit": entry.unit,
        "value": rounded(float(entry.from_fit(middle))),
        "low": rounded(float(entry.from_fit(ends[0]))),
        "high": rounded(float(entry.from_fit(ends[1]))),
    }


def _mechanisms(diagnosis: Diagnosis, leader: Answer) -> list[dict[str, Any]]:
    assert leader.explanation is not None
    assert diagnosis.bench is not None
    assert diagnosis.search is not None
    search, explanation = diagnosis.search, leader.explanation
    places = own_places(explanation.names, explanation.best.fitter.hypothesis.lines)
    whole = held_out.in_sample(diagnosis.bench, explanation)
    return [
        {
            "name": name,
            "probability": _probability(
                sum(
                    answer.probability
                    for answer in search.answers
                    if answer.explanation is not None and name in answer.explanation.names
                )
            ),
            "parameters": [_parameter(explanation, place) for place in range(places[name].start, places[name].stop)],
            "explains_percent": _explains(diagnosis, explanation, name, whole),
        }
        for name in explanation.names
    ]


def _explains(diagnosis: Diagnosis, explanation: Explanation, name: str, whole: held_out.Prediction) -> float | None:
    """How much of the misfit beyond noise, without the mechanism, it takes away [%]."""
    assert diagnosis.search is not None
    assert diagnosis.bench is not None
    rest = tuple(entry for entry in explanation.names if entry != name)
    without = next((entry for entry in diagnosis.search.explanations if entry.names == rest), None)
    if without is None:
        return None
    misfit = held_out.in_sample(diagnosis.bench, without)
    beyond = misfit.square / misfit.size - whole.noise / whole.size
    left = whole.square / whole.size - whole.noise / whole.size
    return round(100 * float(np.clip(1 - max(left, 0.0) / beyond, 0.0, 1.0)), 1) if beyond > 0 else 0.0


def _alternatives(answers: Sequence[Answer]) -> list[dict[str, Any]]:
    leader = answers[0]
    found: list[dict[str, Any]] = []
    for answer in answers[1:]:
        if len(found) >= _ALTERNATIVES or (answer.probability < _LEAST_PROBABILITY and len(found) > 1):
            break
        found.append(
            {
                "mechanisms": list(answer.names),
                "probability": _probability(answer.probability),
                "why_not": _why_not(answer, leader),
            }
        )
    return found


def _why_not(answer: Answer, leader: Answer) -> str:
    if answer.probability > 0.25 * leader.probability:
        return "the recordings hardly tell it from the leading explanation"
    if answer.explanation is None:
        return "a smooth discrepancy without a name explains the recordings less well, or no better at a higher price"
    if leader.explanation is None:
        return "it leaves a structured residual"
    nats = leader.explanation.log_evidence - answer.explanation.log_evidence
    if nats > 1:
        return f"its evidence is lower by a factor of e^{nats:.1f}"
    return "it explains no more and is less probable beforehand" if nats > -1 else "it is less probable beforehand"


def _at_bounds(leader: Answer, named: bool) -> list[dict[str, Any]]:
    if not named or leader.explanation is None:
        return []
    explanation = leader.explanation
    found = []
    places = own_places(explanation.names, explanation.best.fitter.hypothesis.lines)
    for name, place in places.items():
        for index in range(place.start, place.stop):
            entry = explanation.model.parameters[index]
            if min(abs(explanation.point.fit[index] - bound) for bound in entry.bounds) < 1e-9:
                limits = f"{entry.low:g} to {entry.high:g} {entry.unit}"
                text = f"{name}: {entry.name} lies at a bound of its prior range ({limits})"
                found.append({"code": "parameter_at_bound", "recording": "", "field": entry.name, "statement": text})
    return found


def _fit(diagnosis: Diagnosis, explanation: Explanation) -> dict[str, Any]:
    assert diagnosis.search is not None
    assert diagnosis.bench is not None
    nothing = next(entry for entry in diagnosis.search.explanations if not entry.names)
    inside = [held_out.in_sample(diagnosis.bench, entry) for entry in (nothing, explanation)]
    outside = held_out.total(diagnosis.groups)
    parts = {
        name: {
            "rmse_percent": rounded(fitted.rmse_percent),
            "heldout_rmse_percent": rounded(left.rmse_percent),
            "log_score": rounded(left.log_score / left.recordings) if left.recordings else None,
            **_modulus(diagnosis.bench, entry),
        }
        for name, entry, fitted, left in zip(("before", "after"), (nothing, explanation), inside, outside, strict=True)
    }
    floor = outside[1].floor_percent if outside[1].recordings else inside[1].floor_percent
    return {
        **parts,
        "mechanisms": list(explanation.names),  # of `after`, also where something beyond them is unexplained
        "noise_floor_percent": rounded(floor),
        "groups": [
            {
                "group": entry.group,
                "chosen": list(entry.chosen) or [NOTHING_MISSING],
                "before_rmse_percent": rounded(entry.before.rmse_percent),
                "after_rmse_percent": rounded(entry.after.rmse_percent),
                "noise_floor_percent": rounded(entry.after.floor_percent),
            }
            for entry in diagnosis.groups
        ],
        "noise": _noise(explanation),
    }


def _modulus(bench: Workbench, explanation: Explanation) -> dict[str, Any]:
    """Of curves whose modulus nobody declared: Young's modulus with its interval."""
    if not bench.lines.curves or bench.lines.campaign.skin.youngs_modulus_mpa is not None:
        return {}
    found = _parameter(explanation, _place(explanation, "youngs_modulus"))
    return {"youngs_modulus_mpa": {key: found[key] for key in ("value", "low", "high")}}


def _noise(explanation: Explanation) -> dict[str, Any]:
    levels = explanation.best.at.marginal.levels
    return {
        "gain_percent": rounded(100 * levels.gain),
        "position_mm": rounded(1e3 * levels.position),
        "line_level": rounded(levels.level),
        "smooth_percent": rounded(100 * levels.smooth),
    }


def _location(diagnosis: Diagnosis) -> dict[str, Any]:
    return {
        "axes": [
            {
                "axis": entry.axis,
                "p_value": None if entry.p_value is None else round(entry.p_value, 3),
                "share_percent": round(100 * entry.share, 1),
                **({"undecidable": entry.reason} if entry.reason else {}),
            }
            for entry in diagnosis.axes
        ],
        "region": {
            name: [rounded(x) if isinstance(x, float) else x for x in ends] for name, ends in diagnosis.region.items()
        },
        "effect_percent": rounded(diagnosis.effect_percent, 3),
        "statement": location_statement(diagnosis),
    }


def location_statement(diagnosis: Diagnosis) -> str:
    """One plain sentence."""
    telling = [entry for entry in diagnosis.axes if entry.p_value is not None and entry.p_value < 0.05]
    undecidable = [entry.axis for entry in diagnosis.axes if entry.p_value is None]
    tail = f"; undecidable in this design: {', '.join(undecidable)}" if undecidable else ""
    if not telling:
        return f"The residual depends on no axis beyond chance{tail}."
    names = ", ".join(entry.axis for entry in sorted(telling, key=lambda entry: entry.p_value or 0.0))
    where = "; ".join(
        f"{name} {' to '.join(f'{x:.4g}' if isinstance(x, float) else str(x) for x in ends)}"
        for name, ends in diagnosis.region.items()
    )
    size = f"{diagnosis.effect_percent:+.3g} %"
    return f"The residual depends on {names}; most of it lies at {where}, where the response is off by {size}{tail}."


def _statement(diagnosis: Diagnosis, stated: str) -> str:
    assert diagnosis.search is not None
    answers = diagnosis.search.answers
    leader = answers[0]
    percent = f"{100 * leader.probability:.0f} %"
    if stated == "no_mismatch":
        return f"Recordings and base model agree within the noise (probability {percent}); nothing needs to be added."
    if stated == "unexplained":
        shape = f" {diagnosis.shape}" if diagnosis.shape else ""
        return f"Something is missing that none of the known mechanisms describes (probability {percent}).{shape}"
    names = " and ".join(leader.names)
    laws = " ".join(f"{name}: {CATALOGUE[name].law.rstrip('.')}." for name in leader.names)
    if stated == "explained":
        return f"The base model lacks {names} (probability {percent}). {laws}"
    rivals = "; ".join(
        f"{' and '.join(a.names)} ({100 * a.probability:.0f} %)" for a in answers[1:4] if a.probability > 0.02
    )
    return f"Best explained by {names} ({percent}), but these rivals remain: {rivals}."
