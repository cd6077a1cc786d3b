"""What a report says in words, for people who press skins: no statistics but percentages, values with their units."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from underskin.diagnosis.data.axes import WORDS
from underskin.diagnosis.data.names import EXPLAINED, SIMPLEST, in_words
from underskin.diagnosis.localisation.effect_size import EffectSize
from underskin.diagnosis.localisation.permutation_test import SIGNIFICANT, AxisResult, Undecidable
from underskin.diagnosis.localisation.residual_shape import (
    ALONG_CURVES,
    FormKind,
    Shape,
    ShapeForm,
)
from underskin.diagnosis.selection.answers import Answer
from underskin.diagnosis.validation.identifiability import Likeness
from underskin.diagnosis.validation.power import Power
from underskin.findings.english import lacking
from underskin.findings.formatting import in_digits, in_percent
from underskin.findings.lacking import Lacking
from underskin.mechanisms.base import Kind
from underskin.mechanisms.registry import CATALOGUE

_WORTH_NAMING = 0.02
_FAR_ABOVE = 2.0  # times the noise: an error held out that a verdict's first sentence tells
_UNTHOUGHT_AT_MOST = 0.016  # of none_of_these, where no process shows
_INSUFFICIENT = "The recordings cannot tell anything: "
_SMALL = 5.0  # % of the response
_IN_PERCENT = 90.0  # beyond it an effect is said as a factor


def answer_statement(
    answers: Sequence[Answer],
    verdict: str,
    shape: Shape | None = None,
    kind: Kind = "frf",
    fit: Mapping[str, Any] | None = None,
    caveats: str = "",
    power: Sequence[Power] = (),
    idle: Sequence[str] = (),
    told: Sequence[str] = (),
    group: Mapping[str, Any] | None = None,
) -> str:
    """Some plain sentences: what is missing, what decides how far that can be trusted (`caveats`), the laws; of curves
    also the modulus under the stated answer, or what the base model leaves; where nothing is missing, what would have
    shown (`power`).

    `fit` is the report's, `group` the most probable of its `presence`; `idle`: mechanisms of the leading answer that
    may as well have no effect; `told`: what the values of the leading answer mean.
    """
    first, rest = _answer(answers, verdict, shape, SIMPLEST[kind], idle, all_used=not caveats)
    alike = group is not None and len(group["mechanisms"]) > 1 and group["probability"] >= EXPLAINED
    if group is not None and alike and verdict == "ambiguous" and not idle:
        first, rest = _of_group(group, answers)
    if fit is not None and verdict in ("explained", "no_mismatch"):
        first = first.removesuffix(".") + _reserve(fit) + "."
    if verdict == "no_mismatch" and caveats:
        first, caveats = _after_caveat(first, caveats)
    parts = [first, caveats, rest, *told]
    if verdict == "no_mismatch":
        parts.append(power_statement(power, kind))
    if fit is not None and "youngs_modulus" in fit["before"]:
        parts.append(left_by(fit, SIMPLEST[kind]) if verdict == "unexplained" else _modulus(fit["after"]))
    return " ".join(part for part in parts if part)


def _after_caveat(first: str, caveats: str) -> tuple[str, str]:
    """The first of the caveats and then the verdict as one sentence, and the other caveats: what was left out must not
    come after the words that nothing needs to be added."""
    leading, _, others = caveats.partition(". ")
    return f"{leading.removesuffix('.')}; apart from that, {first[0].lower()}{first[1:]}", others


def _reserve(fit: Mapping[str, Any]) -> str:
    """What keeps an answer from being one without reserve: recordings held out that are predicted far worse than noise
    would have it."""
    missed, floor = fit["after"]["heldout_rmse_percent"], fit["noise_floor_percent"]
    if missed is None or floor is None or missed <= _FAR_ABOVE * floor:
        return ""
    return f"; but what was held out is missed by {in_digits(missed, 2)} %, where noise gives {in_digits(floor, 2)} %"


def insufficient_statement(what: Lacking | None) -> str:
    """The statement on a campaign from which nothing can be concluded."""
    assert what is not None
    return f"{_INSUFFICIENT}{lacking(what)}."


# The page of a stored report lays its statement out by these two; nothing is decided by what they return.
def lacking_part(statement: str) -> str:
    """What is lacking, with its full stop, out of the statement that `insufficient_statement` made."""
    return statement.removeprefix(_INSUFFICIENT)


def first_and_rest(statement: str) -> tuple[str, str]:
    """The first sentence of a statement, which is the verdict, without its full stop, and the other sentences."""
    first, _, rest = statement.partition(". ")
    return first.rstrip("."), rest


def _answer(
    answers: Sequence[Answer],
    verdict: str,
    shape: Shape | None,
    model: str,
    idle: Sequence[str],
    *,
    all_used: bool,
) -> tuple[str, str]:
    """The verdict in one sentence, and what else there is to say of it."""
    leader = answers[0]
    percent = in_percent(leader.probability)
    rivals = [answer for answer in answers[1:4] if answer.probability > _WORTH_NAMING]
    listed = "; ".join(f"{in_words(answer.names)} ({in_percent(answer.probability)})" for answer in rivals)
    mentioned = dict.fromkeys(name for answer in (leader, *rivals) for name in answer.names if name in CATALOGUE)
    if verdict == "no_mismatch":
        agree = f"Recordings and {model} agree within the noise (probability {percent})"
        if leader.probability >= EXPLAINED or not rivals:
            return f"{agree}; nothing needs to be added{'' if all_used else ' for those that were used'}.", ""
        return f"{agree}, but they do not rule out: {listed}.", _laws(tuple(mentioned))
    if verdict == "unexplained":
        missing = f"Something is missing that none of the known mechanisms describes (probability {percent})."
        return missing, shape_statement(shape)
    names = in_words(leader.names)
    if verdict == "explained":
        return f"{model[0].upper()}{model[1:]} lacks {names} (probability {percent}).", _laws(leader.names)
    but = [f"the 95 % intervals of {in_words(idle)} hold the values at which nothing changes"] if idle else []
    but += [f"these rivals remain: {listed}"] if listed else []
    certain = f"What is certain is that {model} does not describe the recordings. " if idle else ""
    return f"Best explained by {names} ({percent}), but {', and '.join(but)}.", certain + _laws(tuple(mentioned))


def _of_group(group: Mapping[str, Any], answers: Sequence[Answer]) -> tuple[str, str]:
    """That one of several mechanisms is there that these recordings cannot tell apart, and how probable sets are."""
    named = " or ".join(in_words([name]) for name in group["mechanisms"])
    first = f"{named[0].upper()}{named[1:]} ({in_percent(group['probability'])}): these recordings cannot tell which."
    rivals = [answer for answer in answers[:4] if answer.probability > _WORTH_NAMING]
    each = "; ".join(f"{in_words(answer.names)} ({in_percent(answer.probability)})" for answer in rivals)
    return first, f"By sets: {each}."


def _modulus(after: Mapping[str, Any]) -> str:
    modulus = after["youngs_modulus"]
    interval = f"95 %: {modulus['low']:.3g} to {modulus['high']:.3g}"
    return f"Young's modulus under this answer: {modulus['value']:.3g} {modulus['unit']} ({interval})."


def left_by(fit: Mapping[str, Any], model: str, law: Sequence[str] | None = None) -> str:
    """How far the base model goes on curves, and the best set of mechanisms, or a law that nobody listed with the
    mechanisms beside it, which `law` holds."""
    before, after, names = fit["before"], fit["after"], fit["mechanisms"]
    modulus = before.get("least_squares_modulus_mpa")
    alone = f"{model[0].upper()}{model[1:]} alone" + (f", with Young's modulus {modulus:.3g} MPa," if modulus else "")
    said = f"{alone} leaves {in_digits(before['rmse_percent'], 2)} % of the force (root mean square)"
    added = in_words(names) if names else ""
    if law is not None:
        added = f"this law and {in_words(law)}" if law else "this law"
    beside = f", with {added} {in_digits(after['rmse_percent'], 2)} %" if added else ""
    return f"{said}{beside}." + (f" {_modulus(after)}" if added and "youngs_modulus" in after else "")


def power_statement(power: Sequence[Power], kind: Kind) -> str:
    """What the recordings would have shown, as one sentence."""
    all_of_them = sum(kind in mechanism.kinds for mechanism in CATALOGUE.values())
    shown = [entry.mechanism for entry in power if entry.smallest_visible_percent <= _SMALL]
    if not shown:
        return f"None of the {all_of_them} known mechanisms would have shown with {_SMALL:g} % of the response."
    which = f"these {len(shown)} would each have shown with {_SMALL:g} % of the response"
    return f"Of the {all_of_them} known mechanisms {which}: {', '.join(in_words([name]) for name in shown)}."


def _laws(names: Sequence[str]) -> str:
    """What a mechanism is, in one sentence; of several nothing, since a page says it of each."""
    return f"{in_words(names).capitalize()}: {CATALOGUE[names[0]].plain.rstrip('.')}." if len(names) == 1 else ""


def shape_statement(shape: Shape | None) -> str:
    """What is known of a residual that no mechanism describes, as one sentence; empty where nothing was looked at."""
    if shape is None:
        return ""
    form = "has no simple form over one axis" if shape.form is None else f"looks like {_form(shape.form, shape)}"
    if not shape.beyond:
        return f"What remains {form}."
    explain = "explains" if len(shape.beyond) == 1 else "explain"
    return f"{in_words(shape.beyond).capitalize()} {explain} part of the misfit; what remains {form}."


def _form(form: ShapeForm, shape: Shape) -> str:
    called, unit = ALONG_CURVES[form.axis] if shape.of_curves else (_form_axis(form), WORDS[form.axis][1])
    words = _FORMS[form.kind].format(at=form.at, unit=f" {unit}" if unit else "")
    of = " of the largest force" if shape.of_curves else ""
    return f"{words}, up to {in_digits(form.size, 2)} %{of} over {called}"


_FORMS: Mapping[FormKind, str] = {
    FormKind.POWER_LAW: "a power law",
    FormKind.DRIFT: "a drift",
    FormKind.STEP: "a step at {at:.4g}{unit}",
    FormKind.PERIODIC: "a periodic change of period {at:.3g}{unit}",
    FormKind.PEAK: "a peak or notch at {at:.3g}{unit}",
    FormKind.BUMP: "a bump at {at:.3g}{unit}",
}


def _form_axis(form: ShapeForm) -> str:
    words = WORDS[form.axis][0]
    return words if form.component is None else f"{words} ({'xy'[form.component]})"


def why_not(answer: Answer, leader: Answer, imitating: Collection[tuple[str, ...]] = ()) -> str:
    """Why an answer is less probable than the leading one; `imitating`: sets that look like an unlisted law."""
    if answer.probability > 0.25 * leader.probability:
        return "the recordings hardly tell it from the leading explanation"
    if answer.explanation is None and answer.probability < _UNTHOUGHT_AT_MOST:
        return "nothing in the recordings asks for it; a small share always stays for what nobody thought of"
    if answer.explanation is None and () in imitating:
        return "few laws without a name would not show in these recordings"
    if answer.explanation is None and imitating:
        return "few laws without a name would look like the leading explanation in these recordings"
    if answer.explanation is None:
        return "a smooth discrepancy without a name explains the recordings less well, or no better at a higher price"
    if leader.explanation is None:
        return "what it leaves of the misfit is not noise"
    less = leader.explanation.log_evidence - answer.explanation.log_evidence
    if less > 1:
        factor = f"about {_round(np.exp(less))}" if less < np.log(1e6) else "more than a million"
        return f"the recordings are {factor} times less probable under it"
    return "it explains no more and is less probable beforehand" if less > -1 else "it is less probable beforehand"


def _round(value: float) -> str:
    return f"{float(f'{value:.1g}'):.0f}" if value >= 10 else f"{value:.1g}"


UNDECIDABLE: Mapping[Undecidable, str] = {
    Undecidable.FEW_EXCHANGEABLE: "too few recordings that could be exchanged",
    Undecidable.FEW_RECORDINGS: "too few recordings to tell it from the other axes",
    Undecidable.ALIASED: "the other axes determine it in this design",
    Undecidable.FEW_SIGNS: "fewer than 6 recordings, whose signs could be changed",
}


CONFOUNDED: Mapping[Likeness, str] = {
    Likeness.NOISE: "at a typical strength it stays within the noise here",
    Likeness.TAKEN_UP: "at a typical strength, d33, E and h within their tolerances take up what it does here",
    Likeness.IMITATED: "what {mechanism} typically does to these recordings, {other} can do as well",
    Likeness.IMITATES: "what {other} typically does to these recordings, {mechanism} can do as well",
    Likeness.FITS_AS_WELL: "{other} explains these recordings about as well as {mechanism}",
}


def location_statement(
    axes: Sequence[AxisResult],
    region: Mapping[str, Sequence[float | str]],
    whole: Mapping[str, bool],
    effect: EffectSize,
    *,
    agrees: bool = False,
) -> str:
    """One plain sentence; `whole` says of each axis of the region whether the region reaches all along it, `agrees`
    that recordings and model agree within the noise."""
    telling = [entry for entry in axes if entry.p_value is not None and entry.p_value < SIGNIFICANT]
    undecidable = [WORDS[entry.axis][0] for entry in axes if entry.p_value is None]
    tail = f"; whether it depends on {listed(undecidable)}, this design cannot tell" if undecidable else ""
    if len(undecidable) == len(axes) and undecidable:
        return f"Whether the misfit depends on {listed(undecidable)}, this design cannot tell."
    if not telling:
        return f"The misfit depends on none of the axes beyond chance{tail}."
    names = listed([WORDS[entry.axis][0] for entry in sorted(telling, key=lambda entry: entry.p_value or 0.0)])
    if agrees:
        return (
            f"What is left is within the noise, though more of it goes along with {names} than chance would give{tail}."
        )
    parts = [_range(name, ends) for name, ends in region.items() if not whole[name]]
    where = f"most of it lies at {listed(parts)}, where" if parts else "it is spread over all of the recordings, where"
    return f"The misfit depends on {names}; {where} {_size(effect)}{tail}."


def _size(effect: EffectSize) -> str:
    low, high = sorted((abs(effect.low), abs(effect.high)))
    if not effect.signed:
        return (
            f"the response is off by {in_digits(effect.percent, 3)} % (root mean square: above the model in parts, "
            f"below it in others; 95 %: {in_digits(low, 3)} to {in_digits(high, 3)} %)"
        )
    if abs(effect.percent) > _IN_PERCENT:
        return _times(effect)
    side = "above" if effect.percent > 0 else "below"
    span = (
        f"{effect.low:+.2g} to {effect.high:+.2g}"
        if effect.low * effect.high < 0
        else f"{in_digits(low, 3)} to {in_digits(high, 3)}"
    )
    return f"the response is {in_digits(abs(effect.percent), 3)} % {side} the model (95 %: {span} %)"


def _times(effect: EffectSize) -> str:
    """A large effect as a factor: nothing is more than 100 % below, unless its sign has turned."""
    factor, low, high = (1 + percent / 100 for percent in (effect.percent, effect.low, effect.high))
    span = f"{in_digits(low, 2)} to {in_digits(high, 2)}"
    if factor >= 0:
        return f"the response is {in_digits(factor, 2)} times the model's (95 %: {span})"
    return f"the response has the other sign than the model's, {in_digits(factor, 2)} times it (95 %: {span})"


def _range(axis: str, ends: Sequence[float | str]) -> str:
    words, unit = WORDS[axis]
    values = [value if isinstance(value, str) else in_digits(value) for value in ends]
    text = " to ".join(dict.fromkeys(values))
    return f"{words} {text} {unit}".rstrip()


def listed(names: Sequence[str]) -> str:
    """Names with commas and a last "and"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
