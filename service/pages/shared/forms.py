"""Forms: read, rejected unless made for this session, and all errors at once in the labels that the reader sees instead
of the request's field names, with each invalid field marked."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any
from urllib.parse import parse_qs

from fastapi import Depends, Request
from fastapi.responses import RedirectResponse

from service.auth import session
from service.dependencies import sender
from service.problems import Refusal
from service.store import Conflict, Missing
from service.usecases import changes
from underskin.errors import (
    UNITS_CHECKED,
    InvalidInput,
    Mention,
    Requirement,
    SeveralInvalid,
    UnderskinError,
    all_of,
    errors_of,
    noting,
    out_of_range,
    required,
    wrong_type,
)
from underskin.recordings.readers import text
from underskin.recordings.validation import declared, poisson_ratio
from underskin.units import LAB

TOKEN = "form_token"  # noqa: S105 -- the name of the field
UNLIKELY = "or tick “These values are right, unusual as they are”"
_LARGEST_BYTES = 100_000
_LONGEST_NAME = 100  # characters
_MOST_FIELDS = 1500  # a file of many channels has a row of fields for each, and so has an upload of many files
_WITH_UNIT = re.compile(r"\S*\d\s*[^\W\d_].*")
_BETWEEN = re.compile(r"[;\s]+|,(?:\s+|$)")  # numbers in a line: a comma without a space may be a decimal one
_LOAD_PATH = re.compile(r"contacts\[(\d+)\](?:\.(\w+))?(?:\[(\d)\])?")  # of `POST /v1/stress`
_OF_LOAD = {"x_mm": "x", "y_mm": "y", "indenter_radius_mm": "R", "normal_force_n": "F"}
_TANGENTIAL = ("Fx", "Fy")
_LABELS = {
    "name": "Name",
    "title": "Name",
    "remark": "Notes",
    "tags": "Tags",
    "reason": "Reason",
    "who": "Your name",
    "skin_id": "Id of the other skin",
}  # of forms that change stored data
_MOST_LISTED_ERRORS = 20


async def _fields(request: Request) -> dict[str, str]:
    """The fields of a form, the first of each name; raises Refusal if another site may have made it."""
    body = b""
    async for chunk in request.stream():
        body += chunk
        if len(body) > _LARGEST_BYTES:
            raise Refusal(413, f"The form exceeds {_LARGEST_BYTES / 1e6:g} MB.", title="Body too large")
    try:
        values = parse_qs(body.decode("utf-8", "replace"), keep_blank_values=True, max_num_fields=_MOST_FIELDS)
    except ValueError:
        raise Refusal(400, "The form has too many fields.") from None
    fields = {name: entries[0] for name, entries in values.items()}
    require_form_token(request, fields.get(TOKEN, ""))
    return fields


def require_form_token(request: Request, token: str) -> None:
    """Rejects a form that was not sent from a page of this session."""
    if not session.is_form_token(session.cookie_of(request), token):
        raise Refusal(403, "This form was not made for your session, or the session has ended: go back and reload it.")


Form = Annotated[dict[str, str], Depends(_fields)]


FORM_OF_SESSION = Depends(_fields)  # of a route that needs no field, only that the form is of this session


def reason(sent: dict[str, str]) -> str:
    """The reason typed in a form; raises InvalidInput."""
    why = sent.get("reason", "").strip()
    if not 0 < len(why) <= 1000:
        raise out_of_range("reason", why[:80], "must say why in 1 to 1000 characters")
    return why


def signed(request: Request, sent: Mapping[str, str]) -> str | None:
    """Who sent a form: the name of the API key or, without one, the name that was typed; None where there is neither.
    Raises InvalidInput."""
    typed = sent.get("who", "").strip()
    if request.scope["key"] is not None or not typed:
        return sender(request)
    if len(typed) > _LONGEST_NAME or not typed.isprintable():
        raise out_of_range("who", typed[:80], f"must be a name of up to {_LONGEST_NAME} characters, in one line")
    return typed


def annotated(sent: Mapping[str, str]) -> dict[str, str | None]:
    """Remark and tags of a form as they are kept, None where empty. Raises InvalidInput."""
    return {"remark": changes.remark(sent.get("remark")), "tags": changes.tags([sent.get("tags", "")])}


def see(path: str) -> RedirectResponse:
    """After a form, the page that shows what it did."""
    return RedirectResponse(path, 303)


@dataclass(frozen=True)
class RefusedForm:
    """A rejected form: which one of its page, the reason, the typed values, and the status of the answer."""

    form: str
    why: str
    sent: Mapping[str, str]
    status: int


NOT_ASKED = Depends(lambda: None)  # of what no address gives, but a form that was rejected and is shown again
Refused = Annotated[RefusedForm | None, NOT_ASKED]


def attempted(form: str, sent: Mapping[str, str], do: Callable[[], object]) -> RefusedForm | None:
    """Do the action of a form; if it fails, the form with the reason."""
    try:
        do()
    except InvalidInput as error:
        return RefusedForm(form, in_form_words(error, _LABELS), sent, 422)
    except (Conflict, Missing) as error:
        return RefusedForm(form, str(error.args[0]), sent, 409 if isinstance(error, Conflict) else 404)
    except Refusal as refusal:
        return RefusedForm(form, refusal.detail, sent, refusal.status)
    return None


def number(name: str, typed: str) -> float:
    """A typed number with decimal point or comma; raises InvalidInput, also if it is empty."""
    if not typed.strip():
        raise required(name, "fill it in")
    value = _value(typed)
    if value is None:
        in_unit = " alone, in the unit next to its field" if _WITH_UNIT.fullmatch(typed.strip()) else ""
        raise wrong_type(name, typed.strip()[:80], f"must be a number{in_unit}")
    return value


def number_or_text(typed: str) -> float | str | None:
    """The same; text that is not a number is left to later checks, which name it. None if empty."""
    value = _value(typed)
    return typed.strip() or None if value is None else value


def _value(typed: str) -> float | None:
    return text.number(typed, "," if "," in typed else ".")


def numbers(name: str, line: str, parts: Sequence[str] = ()) -> list[float]:
    """The numbers of a line that somebody typed, with decimal points or with decimal commas; raises InvalidInput.

    Between them are spaces, tabs, semicolons, or commas and a space: `7,06` is one number. `parts`: what each of them
    is, in the words of an error.
    """
    typed = [cell for cell in _BETWEEN.split(line) if cell]
    decimal = "," if any("," in cell for cell in typed) else "."
    values = [text.number(cell, decimal) for cell in typed]
    if decimal == "," and None in values:
        allowed = "must be numbers with spaces between them, with decimal points or with decimal commas, not both"
        raise wrong_type(name, line[:80], allowed)
    names = [*(f"{name}, {part}" for part in parts), *[name] * len(typed)]
    wrong: list[InvalidInput] = []
    read: list[float] = []
    for field_name, cell, value in zip(names, typed, values, strict=False):
        with noting(wrong):
            read.append(number(field_name, cell) if value is None else value)
    if wrong:
        raise SeveralInvalid(wrong)
    return read


def labels_of(fields: Iterable[tuple[Any, ...]]) -> dict[str, str]:
    """The labels of a form, with the unit, from rows that begin with field, words and unit."""
    return {name: f"{words} [{unit}]" if unit else words for name, words, unit, *_ in fields}


def in_form_words(
    error: UnderskinError, labels: Mapping[str, str], lines: Sequence[int] = (), unlikely: str = ""
) -> str:
    """An error; `labels`: of fields as the form has them, `lines`: of the loads in its text, from 1; `unlikely`: how
    the form takes an unlikely magnitude, where it does."""
    if not isinstance(error, InvalidInput):
        return str(error)
    allowed = unsigned(error.field, worded(error.allowed, lambda field: label_of(field, labels, lines), unlikely))
    value = "" if error.value is None else f": {error.value}"
    return f"{label_of(error.field, labels, lines)}{value} – {allowed}"


def unsigned(field: str, allowed: str) -> str:
    """What is allowed, without the words on its magnitude where a field has no sign, or is one of a single file."""
    quantity = LAB.get(field.rpartition(".")[2])
    return allowed if quantity is not None and quantity.signed else allowed.replace(" in magnitude", "")


def worded(allowed: str, label: Callable[[str], str], unlikely: str) -> str:
    """What is allowed, its fields by the labels of a form; `unlikely` as for `in_form_words`."""

    def word(mention: Mention) -> str:
        if mention == UNITS_CHECKED:
            return f" ({unlikely})" if unlikely else ""
        return label(mention.field)

    return allowed.worded(word) if isinstance(allowed, Requirement) else allowed


def label_of(field: str, labels: Mapping[str, str], lines: Sequence[int] = ()) -> str:
    """A field as the form calls it; of a path its known parts."""
    load = _LOAD_PATH.fullmatch(field)
    return _load(load, lines) if load else ".".join(labels.get(part, part) for part in field.split("."))


def _load(path: re.Match[str], lines: Sequence[int]) -> str:
    """`contacts[0].normal_force_n` as `load in line 1, F`."""
    number, field, part = int(path[1]), path[2], path[3]
    load = f"load in line {lines[number] if number < len(lines) else number + 1}"
    if field is None:
        return load
    name = _TANGENTIAL[int(part)] if field == "tangential_force_n" and part is not None else _OF_LOAD.get(field, field)
    return f"{load}, {name}"


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
