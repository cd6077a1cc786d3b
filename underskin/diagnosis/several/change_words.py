"""Clauses on how d33 changed from campaign to campaign."""

from collections.abc import Sequence

from underskin.diagnosis.data.names import in_words
from underskin.diagnosis.reporting.numbers import SDS_OF_95
from underskin.diagnosis.several.dates import Dated
from underskin.diagnosis.several.exchanged import changed_once
from underskin.diagnosis.several.sensors import ArrayOverDates, Change
from underskin.inversion.array_course import FEWEST_DATES
from underskin.inversion.array_words import TWO_DATES, array_change_in_words

_MOST_TOLD, _MOST_CAUSES = 3, 3  # changes in a statement, and mechanisms that would make one
_OF_THE_CHAIN = ("an amplifier's gain", "the temperature")


def in_statement(changed: Sequence[Change], over: ArrayOverDates | None, dated: Dated) -> list[str]:
    """What a statement says of d33: of the array first where it changed, and of sensors beside it, of more than a few
    how many."""
    dates = 0 if over is None else len(over.numbers)
    steps = [change for change in changed if change.sensor is None and change.is_step and dates > 2]
    of_array = [change_in_words(change, dated) for change in steps]
    if over is not None and not steps:
        of_array = _array_in_words(over, changed, dated)
    own = [change for change in changed_once(changed) if change.sensor is not None]
    said = [change_in_words(change, dated) for change in own[:_MOST_TOLD]]
    more = len(own) - _MOST_TOLD
    said += [f"d33 of each sensor has {more} further changes"] if more > 0 else []
    changed_at_all = steps or (over is not None and over.is_significant)
    return [*of_array, *said] if changed_at_all else [*said, *of_array]


def change_in_words(change: Change, dated: Dated) -> str:
    """A clause on d33 of one sensor or of the array; of the array, that a change of level tells nothing of its
    cause."""
    if change.exchanged_with is not None:
        both = f"sensors {change.sensor} and {change.exchanged_with}"
        return f"{both} look exchanged since {dated.called(change.since)}: each has the d33 that the other had"
    whose = "of the array" if change.sensor is None else f"of sensor {change.sensor}, beyond the others,"
    way = "fell" if change.value < 0 else "rose"
    before, after = (dated.called(number) for number in (change.before, change.until))
    half = SDS_OF_95 * change.uncertainty
    low, high = sorted(abs(100 * (change.value + end * half)) for end in (-1, 1))
    size = f"{abs(100 * change.value):.3g} % ({low:.3g} to {high:.3g})"
    level = f", {_causes(change)}" if change.sensor is None else ""
    return f"d33 {whose} {way} by {size} between {before} and {after}{level}"


def _array_in_words(over: ArrayOverDates, changed: Sequence[Change], dated: Dated) -> list[str]:
    """From the first to the last campaign."""
    first, last = over.numbers[0], over.numbers[-1]
    between = f"between {dated.called(first)} and {dated.called(last)}"
    said = array_change_in_words(
        over.change.value, over.low, over.high, over.d33.tolist(), between, dated.days(first, last)
    )
    if not over.is_significant:
        return [said]
    stated = next((change for change in changed if change.sensor is None), over.change)
    return [f"{said}, {_causes(stated)}", *([TWO_DATES] if len(over.numbers) < FEWEST_DATES else [])]


def _causes(change: Change) -> str:
    few = [in_words([name]) for name in change.causes[:_MOST_CAUSES]]
    more = ["another mechanism"] if len(change.causes) > _MOST_CAUSES else []
    causes = " or ".join([*few, *more, *_OF_THE_CHAIN])
    return f"a change of level that {causes} would make: these recordings do not tell which"
