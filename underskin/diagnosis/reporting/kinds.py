"""What reports say and draw otherwise for each kind of recordings, and what each kind contributes to an answer."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.reporting.numbers import (
    ENDS,
    in_sentence,
    parameter_with_interval,
    parameters_of,
    rounded,
    scaled,
    with_hidden,
)
from underskin.diagnosis.selection.other_kinds import MODULUS_ERROR, OtherKind
from underskin.diagnosis.selection.search import KindsTogether
from underskin.findings.formatting import in_percent
from underskin.mechanisms.base import Kind


@dataclass(frozen=True)
class KindTraits:
    """One kind of recordings in reports.

    `recordings`: in a sentence; `measured`: the parameter that they measure; `response`: what is recorded; `part`: its
    real part by itself, and after the response; `lists_untried`: whether mechanisms
    that they do not support are named beside a residual; `title` and `along`: of the figure of curves, and of its
    abscissa; `per_si`: the unit of figures over the SI unit of a response.
    """

    recordings: str
    measured: str
    response: str = "force"
    part: tuple[str, str] = ("force", "")
    lists_untried: bool = True
    title: str = ""
    along: str = ""
    per_si: float = 1.0


KINDS: Mapping[Kind, KindTraits] = {
    "frf": KindTraits(
        "the FRFs",
        "d33",
        response="FRF",
        part=("in phase", ", in phase"),
        lists_untried=False,
        per_si=1e12,
    ),
    "indentation": KindTraits("the indentations", "youngs_modulus", title="Force against depth", along="depth"),
    "compression": KindTraits("the block", "youngs_modulus", title="Force against displacement", along="displacement"),
}


def _kinds(joined: KindsTogether) -> Sequence[OtherKind]:
    """The kinds beside the one that gives the verdict."""
    return () if joined.other_kinds is None else joined.other_kinds.kinds


def by_kind(joined: KindsTogether, leading: Sequence[str]) -> list[dict[str, Any]]:
    """E by each kind alone, and the parameters of the curves' own mechanisms; empty where there is one kind.

    The parameters are those under the leading set, or under the curves' own best set where the kinds contradict each
    other. The interval of E allows for hidden mechanisms, and for a difference between block and skin.
    """
    rows = _modulus_of_first_kind(joined)
    for kind in _kinds(joined):
        assert joined.other_kinds is not None
        if joined.apart_is_likelier:
            curves = joined.other_kinds.posterior_alone(kind)
        else:
            curves = joined.other_kinds.posterior(kind, leading)
        fitted = curves.best
        modulus = parameter_with_interval(fitted, fitted.index("youngs_modulus"))
        parameters = [with_hidden(modulus, curves.hidden, curves.tolerance)]
        parameters += [parameter for name in fitted.spans for parameter in parameters_of(fitted, name)]
        rows += [_row(kind.kind, parameter) for parameter in parameters]
    return rows


def _row(kind: Kind, parameter: Mapping[str, Any]) -> dict[str, Any]:
    return {"kind": kind, "parameter": parameter["name"], **{key: parameter[key] for key in ("unit", *ENDS)}}


def _modulus_of_first_kind(joined: KindsTogether) -> list[dict[str, Any]]:
    """E by the recordings of the first kind alone; none where their best set keeps the declared one."""
    if joined.apart is None:
        return []
    kind, declared = joined.problem.kind, joined.problem.lines.campaign.skin.youngs_modulus_mpa
    fitted = joined.apart.fit_behind(joined.apart.answers[0])
    if declared is None:
        return [_row(kind, parameter_with_interval(fitted, fitted.index("youngs_modulus")))]
    if MODULUS_ERROR not in fitted.names:
        return []
    factor = parameter_with_interval(fitted, fitted.spans[MODULUS_ERROR].start)
    return [_row(kind, {"name": "youngs_modulus", "unit": "MPa", **scaled(factor, declared)})]


def moduli_clause(joined: KindsTogether, rows: Sequence[Mapping[str, Any]]) -> str:
    """A clause on E by kind; empty where there is one kind."""
    text = ", ".join(
        f"E from {KINDS[row['kind']].recordings}: {in_sentence(row)}"
        for row in rows
        if row["parameter"] == "youngs_modulus"
    )
    declared = joined.problem.lines.campaign.skin.youngs_modulus_mpa
    return f"{text}, declared {declared:g}" if text and declared is not None else text


def contradictions(joined: KindsTogether) -> list[dict[str, Any]]:
    """The statement that the kinds are not of one material, where this is more probable than the opposite."""
    if not _kinds(joined) or not joined.apart_is_likelier:
        return []
    kinds = [joined.problem.kind, *(kind.kind for kind in _kinds(joined))]
    named = " and ".join(KINDS[kind].recordings for kind in kinds)
    statement = (
        f"{named[0].upper()}{named[1:]} contradict each other (probability {in_percent(joined.contradictory)}): they "
        "are not of one material, or one of them is wrong, so each is explained alone."
    )
    return [{"parameter": "youngs_modulus", "kinds": kinds, "statement": statement}]


def mechanisms_of_curves(joined: KindsTogether, names: Sequence[str], leading: Sequence[str]) -> list[dict[str, Any]]:
    """Name, parameters and share of the misfit of mechanisms that act on the additional curves only."""
    rows = []
    for kind in _kinds(joined):
        assert joined.other_kinds is not None
        fits = [explanation for explanation, _ in joined.other_kinds.posterior(kind, leading).fits]
        without = max(_misfit_square(fits[0]), 1e-300)
        rows += [
            {
                "name": name,
                "of": explanation.best.hypothesis.lines.mechanisms[name].of,
                "parameters": parameters_of(explanation, name),
                "explains_percent": rounded(100 * max(1 - _misfit_square(explanation) / without, 0.0), 3),
            }
            for explanation in fits
            for name in names
            if name in explanation.names
        ]
    return rows


def _misfit_square(explanation: Explanation) -> float:
    """Σ (F − model)² of the samples, without zero offset, drift and gain of the cell."""
    predicted = explanation.model.predict(explanation.point.fit).value.real
    return float(((explanation.best.hypothesis.lines.value.real - predicted) ** 2).sum())
