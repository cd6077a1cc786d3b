"""The statement of a report: what decides, what is missing, what that means, and what to quote, in three sentences."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from underskin.diagnosis.data.names import EXPLAINED, NOTHING_MISSING, SIMPLEST, in_words
from underskin.diagnosis.reporting.sentences import of_clauses, small
from underskin.diagnosis.selection.answers import Answer
from underskin.diagnosis.validation.power import Power
from underskin.findings.english import lacking
from underskin.findings.formatting import in_digits, in_percent
from underskin.findings.lacking import Lack, Lacking
from underskin.mechanisms.base import Kind
from underskin.mechanisms.registry import CATALOGUE

_WORTH_NAMING = 0.02
_FAR_ABOVE = 2.0  # times the noise: an error held out that a verdict's first sentence tells
_INSUFFICIENT = "The recordings cannot tell anything: "
_TO_CORRECT = "Nothing can be told before a correction: "
_CORRECTED = (Lack.CURVES_CONTRADICT, Lack.IMPOSSIBLE_DECLARATION)  # more recordings would not help
_SMALL = 5.0  # % of the response
_STATED = 3  # mechanisms whose strengths are told


@dataclass(frozen=True)
class Around:
    """What a statement says beside the answer itself.

    `slips` and `contradictions` are clauses on what decides how far any answer can be trusted, `reserves` on what this
    one leaves open; `quoted` are clauses on d33, and on E as each kind of recording has it.
    """

    slips: Sequence[str] = ()
    contradictions: Sequence[str] = ()
    reserves: Sequence[str] = ()
    quoted: Sequence[str] = ()

    def first(self, verdict: str, *reserve: str) -> list[str]:
        """The clauses of the first sentence: what decides comes before the verdict."""
        decides = [*self.contradictions, *self.slips]
        return [*decides, f"apart from that, {verdict}" if decides else verdict, *reserve, *self.reserves]


@dataclass(frozen=True)
class OfAnswer:
    """What is known of the leading answer beside its probability.

    `groups` are the report's `presence`, the most probable first, `idle` mechanisms that may as well have no effect,
    `at_bounds` the parameters at an end of their search,
    `mechanisms` those of the report, and `told` is what their values mean together.
    """

    groups: Sequence[Mapping[str, Any]] = ()
    idle: Sequence[str] = ()
    at_bounds: Sequence[str] = ()
    mechanisms: Sequence[Mapping[str, Any]] = ()
    told: Sequence[str] = ()


_NOTHING_AROUND, _NOTHING_KNOWN = Around(), OfAnswer()


def answer_statement(
    answers: Sequence[Answer],
    verdict: str,
    kind: Kind = "frf",
    fit: Mapping[str, Any] | None = None,
    around: Around = _NOTHING_AROUND,
    of_answer: OfAnswer = _NOTHING_KNOWN,
    shape: str = "",
    power: Sequence[Power] = (),
) -> str:
    """Three sentences at most: the verdict, after what decides how far it can be trusted; what is missing, its rivals,
    or the `shape` of what remains; what to quote, or where nothing is missing what would have shown (`power`).

    `fit` is the report's; of curves it has the modulus under the stated answer, or what the base model leaves.
    """
    model = SIMPLEST[kind]
    stated, *means = _answer(answers, verdict, model, of_answer, all_used=not around.slips)
    reserve = _reserve(fit) if fit is not None and verdict in ("explained", "no_mismatch") else ""
    of_curves = fit is not None and "youngs_modulus" in fit["before"]
    modulus = ""
    if fit is not None and of_curves and verdict != "unexplained":
        settled = verdict != "ambiguous"
        how = "under this answer" if settled else f"with {in_words(fit['mechanisms'])}, which is not settled"
        modulus = _modulus_clause(fit["after"], how)
    quoted = [*around.quoted, modulus]
    first = around.first(stated, reserve)
    if verdict == "no_mismatch":
        return of_clauses(first, [*means, *quoted], [power_clause(power, kind)])
    left = [left_by(fit, model)] if fit is not None and of_curves and verdict == "unexplained" else []
    return of_clauses(first, [*means, shape, *left, *of_answer.told], quoted)


def _answer(
    answers: Sequence[Answer], verdict: str, model: str, of_answer: OfAnswer, *, all_used: bool
) -> tuple[str, ...]:
    """The verdict as a clause, and further ones on what it means."""
    leader = answers[0]
    percent = in_percent(leader.probability)
    rivals = [answer for answer in answers[1:4] if answer.probability > _WORTH_NAMING]
    listed = _each(rivals)
    mentioned = dict.fromkeys(name for answer in (leader, *rivals) for name in answer.names if name in CATALOGUE)
    if verdict == "no_mismatch":
        agree = f"recordings and {model} agree within the noise (probability {percent})"
        if leader.probability >= EXPLAINED or not rivals:
            return (f"{agree}, and nothing needs to be added{'' if all_used else ' for those that were used'}",)
        return f"{agree}, but they do not rule out: {listed}", _law(tuple(mentioned))
    if verdict == "unexplained":
        return (f"something is missing that none of the known mechanisms describes (probability {percent})",)
    by_sets = f"by sets: {_each([leader, *rivals])}" if rivals else ""
    if verdict == "explained":
        lacking, by_mechanism = _lacking(leader, of_answer)
        means = _law(leader.names) or _strengths(of_answer.mechanisms)
        return f"{model} lacks {lacking}", *([by_sets] if by_mechanism else []), means
    idle = of_answer.idle
    certain = [group for group in of_answer.groups if group["probability"] >= EXPLAINED]
    if certain and not idle and not of_answer.at_bounds:
        named = " and ".join(_group_in_words(group) for group in certain)
        if any(len(group["mechanisms"]) > 1 for group in certain):
            return f"{named}: these recordings cannot tell which", by_sets
        return f"{model} lacks {named}, but these recordings cannot tell what else", by_sets, _law(tuple(mentioned))
    but = list(of_answer.at_bounds)
    but += [f"the 95 % intervals of {in_words(idle)} hold the values at which nothing changes"] if idle else []
    but += [f"these rivals remain: {listed}"] if listed else []
    but = but or [f"many rivals remain, each below {in_percent(_WORTH_NAMING)}"]
    doubtful = bool(idle or of_answer.at_bounds) and leader.names != (NOTHING_MISSING,)
    misfit = f"what is certain is that {model} does not describe the recordings" if doubtful else ""
    begin = f"best explained by {in_words(leader.names)} ({percent})"
    if rivals and rivals[0].probability > leader.probability:  # as all sets of known mechanisms together lead
        known = sum(answer.probability for answer in answers if answer.kind == leader.kind)
        begin = (
            f"known mechanisms explain this ({in_percent(known)} together), best {in_words(leader.names)} ({percent})"
        )
    return (
        f"{begin}, but {', and '.join(but)}",
        misfit,
        _law(tuple(mentioned)),
    )


def _lacking(leader: Answer, of_answer: OfAnswer) -> tuple[str, bool]:
    """The mechanisms of the leading set with their probability, and whether that is each mechanism's own.

    It is where a mechanism is in other sets too, or these have its twin in its place.
    """
    group, least = next(iter(of_answer.groups), None), leader.probability + _WORTH_NAMING
    twins = group is not None and len(group["mechanisms"]) > 1 and set(leader.names) < set(group["mechanisms"])
    if group is not None and twins and group["probability"] > least:
        return f"{_group_in_words(group)}, rather {in_words(leader.names)} ({in_percent(leader.probability)})", True
    present = {entry["name"]: entry["probability"] for entry in of_answer.mechanisms}
    if not any(present.get(name, 0.0) > least for name in leader.names):
        return f"{in_words(leader.names)} (probability {in_percent(leader.probability)})", False
    own = [{"mechanisms": [name], "probability": present[name]} for name in leader.names]
    return " and ".join(map(_group_in_words, own)), True


def _group_in_words(group: Mapping[str, Any]) -> str:
    named = " or ".join(in_words([name]) for name in group["mechanisms"])
    return f"{named} ({in_percent(group['probability'])})"


def _each(answers: Sequence[Answer]) -> str:
    return ", or ".join(f"{in_words(answer.names)} ({in_percent(answer.probability)})" for answer in answers)


def _law(names: Sequence[str]) -> str:
    """What a mechanism is; of several nothing, since a page says it of each."""
    return f"{in_words(names)}: {small(CATALOGUE[names[0]].plain)}" if len(names) == 1 else ""


def _strengths(mechanisms: Sequence[Mapping[str, Any]]) -> str:
    """The first parameter of each of a few mechanisms."""
    each = [
        (in_words([entry["name"]]), parameter_in_words(entry["parameters"][0]))
        for entry in mechanisms[:_STATED]
        if entry["parameters"]
    ]
    return ", ".join(f"{name} has {'an' if strength[0] in 'aeiou' else 'a'} {strength}" for name, strength in each)


def parameter_in_words(entry: Mapping[str, Any]) -> str:
    """Name, value and interval of a parameter: "tip mass of 6.02 g (5.9 to 6.1)"."""
    value, low, high = (in_digits(entry[key], 3) for key in ("value", "low", "high"))
    unit = "" if entry["unit"] == "-" else f" {entry['unit']}"
    interval = "at or beyond the end of its search" if entry.get("at_bound") else f"{low} to {high}"
    return f"{entry['name'].replace('_', ' ')} of {value}{unit} ({interval})"


def _reserve(fit: Mapping[str, Any]) -> str:
    """What keeps an answer from being one without reserve: recordings held out that are predicted far worse than noise
    would have it."""
    missed, floor = fit["after"]["heldout_rmse_percent"], fit["noise_floor_percent"]
    if missed is None or floor is None or missed <= _FAR_ABOVE * floor:
        return ""
    return f"but what was held out is missed by {in_digits(missed, 2)} %, where noise gives {in_digits(floor, 2)} %"


def insufficient_statement(what: Lacking | None, slips: Sequence[str]) -> str:
    """The statement on a campaign from which nothing can be concluded."""
    assert what is not None
    return of_clauses([f"{_TO_CORRECT if what.lack in _CORRECTED else _INSUFFICIENT}{lacking(what)}"], slips)


# The page of a stored report lays its statement out by these two; nothing is decided by what they return.
def lacking_part(statement: str) -> str:
    """What is lacking or wrong, with its full stop, out of the statement that `insufficient_statement` made."""
    return statement.removeprefix(_INSUFFICIENT).removeprefix(_TO_CORRECT)


def first_and_rest(statement: str) -> tuple[str, str]:
    """The first sentence of a statement, which is the verdict, without its full stop, and the other sentences."""
    first, _, rest = statement.partition(". ")
    return first.rstrip("."), rest


def _modulus_clause(after: Mapping[str, Any], how: str) -> str:
    """E of curves, and what it is under."""
    modulus = after["youngs_modulus"]
    if modulus.get("at_bound"):
        bound = f"{modulus['value']:.3g} {modulus['unit']}"
        return f"Young's modulus {how} lies at or beyond {bound}, where its search ends: no result"
    interval = f"95 %: {modulus['low']:.3g} to {modulus['high']:.3g}"
    return f"Young's modulus {how}: {modulus['value']:.3g} {modulus['unit']} ({interval})"


def left_by(fit: Mapping[str, Any], model: str, law: Sequence[str] | None = None) -> str:
    """How far the base model goes on curves, and the best set of mechanisms, or a law that nobody listed with the
    mechanisms beside it, which `law` holds."""
    before, after, names = fit["before"], fit["after"], fit["mechanisms"]
    modulus = before.get("least_squares_modulus_mpa")
    alone = f"{model} alone" + (f", with Young's modulus {modulus:.3g} MPa," if modulus else "")
    said = f"{alone} leaves {in_digits(before['rmse_percent'], 2)} % of the force (root mean square)"
    added = in_words(names) if names else ""
    if law is not None:
        added = f"this law and {in_words(law)}" if law else "this law"
    beside = f", with {added} {in_digits(after['rmse_percent'], 2)} %" if added else ""
    modulus = _modulus_clause(after, f"with {added}") if added and "youngs_modulus" in after else ""
    return f"{said}{beside}" + (f"; {modulus}" if modulus else "")


def power_clause(power: Sequence[Power], kind: Kind) -> str:
    """What the recordings would have shown."""
    all_of_them = sum(kind in mechanism.kinds for mechanism in CATALOGUE.values())
    shown = [entry.mechanism for entry in power if entry.smallest_visible_percent <= _SMALL]
    if not shown:
        return f"none of the {all_of_them} known mechanisms would have shown with {_SMALL:g} % of the response"
    which = f"these {len(shown)} would each have shown with {_SMALL:g} % of the response"
    return f"of the {all_of_them} known mechanisms {which}: {', '.join(in_words([name]) for name in shown)}"
