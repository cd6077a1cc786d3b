"""Errors of one input told together, so that its author puts all right at once."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from underskin.errors import InvalidInput


class SeveralInvalid(InvalidInput):
    """The first of several `errors`, for who tells one only; as a text it is all of them."""

    def __init__(self, errors: Sequence[InvalidInput]) -> None:
        first = errors[0]
        super().__init__(first.field, first.value, first.allowed, first.index, code=first.code)
        self.errors = errors
        self.args = ("; ".join(map(str, errors)),)


def errors_of(error: InvalidInput) -> Sequence[InvalidInput]:
    """All of several, or the one."""
    return error.errors if isinstance(error, SeveralInvalid) else [error]


@contextmanager
def noting(errors: list[InvalidInput]) -> Iterator[None]:
    """Appends what is raised inside to `errors`, and goes on after the block."""
    try:
        yield
    except InvalidInput as error:
        errors += errors_of(error)


def all_of(readings: Mapping[str, Callable[[], Any]]) -> dict[str, Any]:
    """What each gives; raises SeveralInvalid with what is wrong in any of them."""
    values: dict[str, Any] = {}
    wrong: list[InvalidInput] = []
    for name, reading in readings.items():
        with noting(wrong):
            values[name] = reading()
    if wrong:
        raise SeveralInvalid(wrong)
    return values
