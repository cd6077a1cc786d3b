"""All errors of a form at once, with each invalid field marked."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

from service.pages.shared.forms import number
from underskin.errors import InvalidInput, SeveralInvalid, UnderskinError, all_of, errors_of, noting
from underskin.recordings.validation import declared, poisson_ratio
from underskin.units import LAB

_MOST_LISTED_ERRORS = 20


@dataclass(frozen=True)
class WrongFields:
    """Errors in sentences, each with the name of its form field; empty for an error of no field."""

    sentences: Sequence[tuple[str, str]] = ()

    def __bool__(self) -> bool:
        return bool(self.sentences)

    def ids(self, name: str) -> str:
        """HTML ids of the error sentences of a field, separated by blanks."""
        return " ".join(f"wrong-{index}" for index, (field, _) in enumerate(self.sentences, 1) if field == name)


NOTHING_WRONG = WrongFields()


def wrong_fields(
    error: UnderskinError,
    in_words: Callable[[UnderskinError], str],
    field_of: Callable[[InvalidInput], str] = lambda error: error.field,
) -> WrongFields:
    """The errors of a form from an exception, each worded by `in_words`, for the field that `field_of` gives."""
    if not isinstance(error, InvalidInput):
        return WrongFields([("", in_words(error))])
    errors = errors_of(error)
    entries = [(field_of(invalid), in_words(invalid)) for invalid in errors[:_MOST_LISTED_ERRORS]]
    more = len(errors) - len(entries)
    return WrongFields([*entries, *([("", f"and {more} more")] if more else [])])


@contextmanager
def errors_together(order: Sequence[str] = ()) -> Iterator[list[InvalidInput]]:
    """Collects errors through `noting`; after the block raises SeveralInvalid with the first error of each place,
    because an unreadable value fails later checks too. `order`: the order of the fields in the form, if checks have
    another."""
    wrong: list[InvalidInput] = []
    with noting(wrong):
        yield wrong
    first: dict[str, InvalidInput] = {}
    for invalid in wrong:
        first.setdefault(invalid.place, invalid)
    if first:
        places = {name: index for index, name in enumerate(order)}
        raise SeveralInvalid(sorted(first.values(), key=lambda invalid: places.get(invalid.field, len(places))))


def quantity(name: str, typed: str, *, units_checked: bool = False) -> float:
    """A typed number, checked against the range of its field. Raises InvalidInput."""
    value = number(name, typed)
    if name == "poisson_ratio":
        return poisson_ratio(name, value, units_checked)
    return declared(name, value, units_checked) if name in LAB else value


def quantities(typed: Mapping[str, str], names: Iterable[str], *, units_checked: bool = False) -> dict[str, float]:
    """The same of several fields; raises SeveralInvalid with all that is wrong."""
    return all_of({name: partial(quantity, name, typed[name], units_checked=units_checked) for name in names})
