"""What each kind of recording told, and where they contradict each other, as a report has it."""

from collections.abc import Mapping, Sequence
from typing import Any

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.reporting.numbers import parameter, place_of, rounded, with_hidden
from underskin.diagnosis.selection.curve_knowledge import OfCurves
from underskin.diagnosis.selection.kinds_together import Joined
from underskin.findings.formatting import in_percent
from underskin.mechanisms.base import Kind

_CALLED: Mapping[Kind, str] = {"frf": "the FRFs", "indentation": "the indentations", "compression": "the block"}
_MODULUS_ERROR = "modulus_error"


def by_kind(joined: Joined, leading: Sequence[str]) -> list[dict[str, Any]]:
    """E by each kind alone, and from curves the parameters of their mechanisms under the leading set, or under what the
    curves alone find where the kinds contradict each other; empty where there is one kind."""
    if joined.beside is None or joined.apart is None:
        return []
    told = []
    for kind in joined.beside.kinds:
        known = joined.beside.told_alone(kind) if joined.apart_is_likelier else joined.beside.told(kind, leading)
        explanation = known.best
        stated = [_of_elastomer(parameter(explanation, place_of(explanation, "youngs_modulus")), known)]
        for own in own_places(explanation.names, explanation.best.hypothesis.lines).values():
            stated += [parameter(explanation, place) for place in range(own.start, own.stop)]
        told += [{"kind": kind.kind, **_entry(entry)} for entry in stated]
    own_modulus = _modulus_alone(joined)
    return told if own_modulus is None else [own_modulus, *told]


def _of_elastomer(modulus: Mapping[str, Any], known: OfCurves) -> dict[str, Any]:
    """With an interval that allows for what an apparent modulus hides, and for how the skin's may differ."""
    return with_hidden(modulus, known.hidden, known.tolerance)


def _entry(stated: Mapping[str, Any]) -> dict[str, Any]:
    return {"parameter": stated["name"], **{key: stated[key] for key in ("unit", "value", "low", "high")}}


def _modulus_alone(joined: Joined) -> dict[str, Any] | None:
    """E as the recordings of the first kind alone have it; None where they do not ask for another than is declared."""
    assert joined.apart is not None
    declared = joined.problem.lines.campaign.skin.youngs_modulus_mpa
    leader = joined.apart.answers[0]
    explanation = joined.apart.shown_or_nothing(leader)
    kind = {"kind": joined.problem.kind}
    if declared is None:
        return {**kind, **_entry(parameter(explanation, place_of(explanation, "youngs_modulus")))}
    if _MODULUS_ERROR not in explanation.names:
        return None
    place = own_places(explanation.names, explanation.best.hypothesis.lines)[_MODULUS_ERROR].start
    factor = parameter(explanation, place)
    ends = {key: rounded(declared * factor[key]) for key in ("value", "low", "high")}
    return {**kind, "parameter": "youngs_modulus", "unit": "MPa", **ends}


def moduli_clause(joined: Joined, told: Sequence[Mapping[str, Any]]) -> str:
    """E by kind; empty where there is one kind."""
    moduli = [entry for entry in told if entry["parameter"] == "youngs_modulus"]
    if not moduli:
        return ""
    each = ", ".join(
        f"E from {_CALLED[entry['kind']]}: {entry['value']:.3g} MPa (95 %: {entry['low']:.3g} to {entry['high']:.3g})"
        for entry in moduli
    )
    declared = joined.problem.lines.campaign.skin.youngs_modulus_mpa
    return f"{each}, declared {declared:g}" if declared is not None else each


def contradictions(joined: Joined) -> list[dict[str, Any]]:
    """That the kinds are not of one material, where this is more probable than that they are."""
    if joined.beside is None or not joined.apart_is_likelier:
        return []
    kinds = [joined.problem.kind, *(kind.kind for kind in joined.beside.kinds)]
    named = " and ".join(_CALLED[kind] for kind in kinds)
    said = (
        f"{named[0].upper()}{named[1:]} contradict each other (probability {in_percent(joined.contradictory)}): they "
        "are not of one material, or one of them is wrong, so each is explained alone."
    )
    return [{"parameter": "youngs_modulus", "kinds": kinds, "statement": said}]


def of_curves_alone(joined: Joined, names: Sequence[str], leading: Sequence[str]) -> list[dict[str, Any]]:
    """Name, parameters and share of the misfit of mechanisms that act on the curves beside alone."""
    entries = []
    for kind in () if joined.beside is None else joined.beside.kinds:
        assert joined.beside is not None
        told = joined.beside.told(kind, leading)
        entries += [
            _of_mechanism(name, explanation, told.each[0][0])
            for explanation, _ in told.each
            for name in names
            if name in explanation.names
        ]
    return entries


def _of_mechanism(name: str, explanation: Explanation, without: Explanation) -> dict[str, Any]:
    places = own_places(explanation.names, explanation.best.hypothesis.lines)[name]
    left, all_of_it = (_left(entry) for entry in (explanation, without))
    return {
        "name": name,
        "parameters": [parameter(explanation, place) for place in range(places.start, places.stop)],
        "explains_percent": rounded(100 * max(1 - left / max(all_of_it, 1e-300), 0.0), 3),
    }


def _left(explanation: Explanation) -> float:
    """Σ (F − model)² of the samples, what the cell may add not counted."""
    predicted = explanation.model.predict(explanation.point.fit).value.real
    return float(((explanation.best.hypothesis.lines.value.real - predicted) ** 2).sum())
