"""What a report says in words, for people who press skins: no statistics but percentages, values with their units."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from underskin.diagnosis.data.axes import WORDS
from underskin.diagnosis.data.names import in_words
from underskin.diagnosis.localisation.effect_size import EffectSize
from underskin.diagnosis.localisation.permutation_test import AxisResult, Undecidable
from underskin.diagnosis.localisation.residual_shape import ALONG_CURVES, FormKind, Shape, ShapeForm
from underskin.diagnosis.selection.answers import Answer
from underskin.diagnosis.validation.identifiability import Likeness
from underskin.findings.formatting import in_digits

_UNTHOUGHT_AT_MOST = 0.016  # of none_of_these, where no process shows
_IN_PERCENT = 90.0  # beyond it an effect is said as a factor


def shape_clause(shape: Shape | None) -> str:
    """What is known of a residual that no mechanism describes; empty where nothing was looked at."""
    if shape is None:
        return ""
    form = "has no simple form over one axis" if shape.form is None else f"looks like {_form(shape.form, shape)}"
    if not shape.beyond:
        return f"what remains {form}"
    explain = "explains" if len(shape.beyond) == 1 else "explain"
    return f"{in_words(shape.beyond)} {explain} part of the misfit; what remains {form}"


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
        return "a smooth deviation of no known cause explains the recordings less well, or no better though it is freer"
    if leader.explanation is None:
        return "what it leaves of the misfit is not noise"
    less = leader.explanation.log_evidence - answer.explanation.log_evidence
    if less > 1:
        factor = f"about {_round(np.exp(less))}" if less < np.log(1e6) else "more than a million"
        return f"the recordings are {factor} times less probable under it"
    return "it explains no more and is less probable beforehand" if less > -1 else "it is less probable beforehand"


def _round(value: float) -> str:
    return f"{float(f'{value:.1g}'):.0f}" if value >= 10 else f"{value:.1g}"


_UNDECIDABLE: Mapping[Undecidable, str] = {
    Undecidable.FEW_EXCHANGEABLE: "too few recordings that could be exchanged",
    Undecidable.FEW_RECORDINGS: "too few recordings to tell it from the other axes",
    Undecidable.ALIASED: "the other axes together determine it in this design",
    Undecidable.FEW_SIGNS: "fewer than 6 recordings, whose signs could be changed",
}


_DETERMINING = {"recorded_at": "the time of recording", "sensor": "the sensor"}  # as in `WORDS` else


def undecidable(entry: AxisResult) -> str:
    """Why it cannot be decided whether the residual depends on an axis; empty where it can."""
    if not entry.determined_by:
        return "" if entry.reason is None else _UNDECIDABLE[entry.reason]
    named = listed([_DETERMINING.get(name, WORDS[name][0]) for name in entry.determined_by])
    determine = "determines" if len(entry.determined_by) == 1 else "together determine"
    return f"{named} {determine} it in this design"


CONFOUNDED: Mapping[Likeness, str] = {
    Likeness.NOISE: "at a typical strength it stays within the noise here",
    Likeness.TAKEN_UP: "at a typical strength it looks here like another d33, E or h within their tolerances",
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
    unknown = [WORDS[entry.axis][0] for entry in axes if entry.p_value is None]
    tail = f"; whether it depends on {listed(unknown)}, this design cannot tell" if unknown else ""
    if len(unknown) == len(axes) and unknown:
        return f"Whether the misfit depends on {listed(unknown)}, this design cannot tell."
    beyond_chance = [entry for entry in axes if entry.significant]
    if not beyond_chance:
        return f"The misfit changes with nothing that was varied, beyond chance{tail}."
    telling = [entry for entry in beyond_chance if entry.telling]
    named = sorted(telling or beyond_chance, key=lambda entry: entry.p_value or 0.0)
    names = listed([WORDS[entry.axis][0] for entry in named])
    if not telling and not agrees:
        return (
            f"The misfit changes with {names} beyond chance, but no more than a trace of it goes along with that{tail}."
        )
    if agrees:
        return (
            f"What is left is within the noise, though more of it goes along with {names} than chance would give{tail}."
        )
    return f"The misfit depends on {names}; {_where(region, whole)}, where {_size(effect)}{tail}."


def _where(region: Mapping[str, Sequence[float | str]], whole: Mapping[str, bool]) -> str:
    """Along which ranges most of it lies, and at which sensor or on which day it is largest."""
    ranges: list[str] = []
    levels: list[str] = []
    for name, ends in region.items():
        if not whole[name]:
            (levels if isinstance(ends[0], str) else ranges).append(_range(name, ends))
    parts = [f"most of it lies at {listed(ranges)}"] if ranges else []
    parts += [f"it is largest at {listed(levels)}"] if levels else []
    return listed(parts) if parts else "it is spread over all of the recordings"


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
