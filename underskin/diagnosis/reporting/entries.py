"""Words of a report's entries: location, rivals, next recordings.

Written for experimenters: percentages and values with units, no further statistics.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from underskin.diagnosis.data.dataset import WORDS
from underskin.diagnosis.data.names import in_words
from underskin.diagnosis.localisation import (
    AxisResult,
    EffectSize,
    Undecidable,
)
from underskin.diagnosis.planning.optimal_design import WRONG_MODULUS, NextRecordings
from underskin.diagnosis.selection.answers import P_NOT_IN_MODEL_SPACE, Answer
from underskin.findings.formatting import capital, in_digits, in_percent, listed, times_in_words

_MOST_UNLISTED = P_NOT_IN_MODEL_SPACE + 1e-3  # largest probability of none_of_these where no unlisted law shows
_IN_PERCENT = 90.0  # beyond it an effect is given as a factor


def why_not(answer: Answer, leader: Answer) -> str:
    """Why an answer is less probable than the leading one."""
    if answer.probability > 0.25 * leader.probability:
        return "the recordings hardly tell it from the leading explanation"
    if answer.explanation is None and answer.probability < _MOST_UNLISTED:
        return "nothing in the recordings asks for it; a small share always stays for what nobody thought of"
    if answer.explanation is None:
        return "unlisted laws explain the recordings less well, or no better though they are freer"
    if leader.explanation is None:
        return "what it leaves of the misfit is not noise"
    less = leader.explanation.log_evidence - answer.explanation.log_evidence
    if less > 1:
        return f"the recordings are {times_in_words(less)} less probable under it"
    return "it explains no more and is less probable beforehand" if less > -1 else "it is less probable beforehand"


_UNDECIDABLE: Mapping[Undecidable, str] = {
    Undecidable.FEW_EXCHANGEABLE: "too few recordings that could be exchanged",
    Undecidable.FEW_RECORDINGS: "too few recordings to tell it from the other axes",
    Undecidable.ALIASED: "the other axes together determine it in this design",
    Undecidable.FEW_SIGNS: "fewer than 6 recordings, whose signs could be changed",
}


_DETERMINING = {"recorded_at": "the time of recording", "sensor": "the sensor"}  # others as in `WORDS`


def undecidable(result: AxisResult) -> str:
    """Why it cannot be decided whether the residual depends on an axis; empty where it can."""
    if not result.determined_by:
        return "" if result.reason is None else _UNDECIDABLE[result.reason]
    named = listed([_DETERMINING.get(name, WORDS[name][0]) for name in result.determined_by])
    determine = "determines" if len(result.determined_by) == 1 else "together determine"
    return f"{named} {determine} it in this design"


def location_statement(
    axes: Sequence[AxisResult], region: Mapping[str, Sequence[float | str]], effect: EffectSize, *, agrees: bool
) -> str:
    """The location of the misfit in one sentence.

    `region` has the axes over which the region does not span all, `agrees` says that recordings and model agree within
    the noise.
    """
    unknown = [WORDS[result.axis][0] for result in axes if result.p_value is None]
    if unknown and len(unknown) == len(axes):
        return f"Whether the misfit depends on {listed(unknown)}, this design cannot tell."
    tail = f"; whether it depends on {listed(unknown)}, this design cannot tell" if unknown else ""
    beyond_chance = [result for result in axes if result.significant]
    if not beyond_chance:
        return f"The misfit changes with nothing that was varied, beyond chance{tail}."
    telling = [result for result in beyond_chance if result.telling]
    named = sorted(telling or beyond_chance, key=lambda result: result.p_value or 0.0)
    names = listed([WORDS[result.axis][0] for result in named])
    if agrees:
        return (
            f"What is left is within the noise, though more of it goes along with {names} than chance would give{tail}."
        )
    if not telling:
        return (
            f"The misfit changes with {names} beyond chance, but no more than a trace of it goes along with that{tail}."
        )
    # The ranges that hold most of the misfit, and the sensor or day where it is largest
    ranges = [_range(name, ends) for name, ends in region.items() if not isinstance(ends[0], str)]
    levels = [_range(name, ends) for name, ends in region.items() if isinstance(ends[0], str)]
    parts = [f"most of it lies at {listed(ranges)}"] if ranges else []
    parts += [f"it is largest at {listed(levels)}"] if levels else []
    where = listed(parts) or "it is spread over all of the recordings"
    return f"The misfit depends on {names}; {where}, where {_size(effect)}{tail}."


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
    """A large effect as a factor; more than 100 % below means the opposite sign."""
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


_STIFFENING, _STAGE = "strain_stiffening", "instrument_compliance"
_VARIED = {  # axes of curves; others as in `WORDS`
    "displacement_mm": "depth",
    "force_n": "largest force",
    "sample_diameter_mm": "diameter of the sample",
    "sample_height_mm": "height of the sample",
    "time_s": "speed and the time of a hold",
}


def next_experiment(plan: NextRecordings) -> dict[str, Any]:
    """The plan as the report has it, in lab units."""
    return {
        "recordings": _recordings(plan),
        "separates": [list(names) for names in plan.rivals],
        "probability_of_deciding": round(plan.probability, 3),
        "without_it": round(plan.without, 3),
        "minutes": round(plan.minutes, 1),
        "statement": _statement(plan) if plan.recordings else _why_none(plan),
    }


def _recordings(plan: NextRecordings) -> list[dict[str, Any]]:
    documents = []
    for recording in dict.fromkeys(plan.recordings):
        names = ("sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n")
        described = {name: getattr(recording, name) for name in names}
        described |= {"position_mm": list(recording.position_mm or ()), "dwell_s": recording.dwell_s}
        given = {name: value for name, value in described.items() if value is not None}
        documents.append({**given, "repeats": plan.recordings.count(recording)})
    return documents


def _statement(plan: NextRecordings) -> str:
    first = plan.first
    assert first is not None
    beyond = " It goes beyond what this campaign did: check that the rig can." if plan.beyond else ""
    contact = f"with the sphere of {first.indenter_radius_mm:g} mm radius at {first.preload_n:g} N"
    several = f"{len(plan.recordings)} recordings, of which that {contact} tells most,"
    return (
        f"{several if len(plan.recordings) > 1 else f'One recording {contact}'} should tell whether "
        f"it is {_rivals(plan)}, with a probability of {in_percent(plan.probability)}.{beyond}{_block(plan)}"
    )


def _block(plan: NextRecordings) -> str:
    """A sentence on a compressed block or an indentation, where that promises to decide."""
    if plan.block is None:
        return ""
    stiffens = any(_STIFFENING in names for names in plan.rivals)
    also = "; compressed by a fifth of its height, a block shows strain stiffening too" if stiffens else ""
    clause = f"whether it is {in_words([WRONG_MODULUS])}, with a probability of {in_percent(plan.block)}{also}"
    return f" A compressed block or an indentation of the same elastomer would tell E, and so {clause}."


def _why_none(plan: NextRecordings) -> str:
    if plan.outside:
        return (
            f"No recordings within these limits can be planned to tell whether it is {_rivals(plan)}: the tables hold "
            f"none of their contacts; choose spheres and preloads nearer to those of the campaign.{_block(plan)}"
        )
    statement = f"No recordings within these limits are likely to tell whether it is {_rivals(plan)}."
    if plan.differ_on:
        words = sorted(_VARIED[axis] if axis in _VARIED else WORDS[axis][0] for axis in plan.differ_on)
        statement += f" They differ in what they depend on: vary the {listed(words)} more widely than here."
    stage = stage_clause(plan.rivals)
    return statement + _block(plan) + (f" {capital(stage)}." if stage else "")


def stage_clause(rivals: Sequence[Sequence[str]]) -> str:
    """What shows whether the stage gives, where only some of the rivals have it; otherwise empty."""
    if len({_STAGE in names for names in rivals}) < 2:
        return ""
    return "a block of steel pressed in place of the sample would tell how far the instrument itself gives"


def _rivals(plan: NextRecordings) -> str:
    """The explanations in words, joined by "or", and the mechanisms of each by "with"."""
    *others, last = [" with ".join(in_words([name]) for name in names) for names in plan.rivals]
    return f"{', '.join(others)} or {last}" if others else last
