"""Several errors of one input, reported together so that its author can correct all at once."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from underskin.errors import InvalidInput


class SeveralInvalid(InvalidInput):
    """The first of several `errors`, for callers that report one; as a text it is all of them."""

    def __init__(self, errors: Sequence[InvalidInput]) -> None:
        first = errors[0]
        super().__init__(first.field, first.value, first.allowed, first.index, code=first.code)
        self.errors = errors
        self.args = ("; ".join(map(str, errors)),)


def errors_of(error: InvalidInput) -> Sequence[InvalidInput]:
    """All errors of a SeveralInvalid, or the single one."""
    return error.errors if isinstance(error, SeveralInvalid) else [error]


@contextmanager
def noting(errors: list[InvalidInput]) -> Iterator[None]:
    """Append errors raised in the block to `errors`, and continue after it."""
    try:
        yield
    except InvalidInput as error:
        errors += errors_of(error)


def all_of(readings: Mapping[str, Callable[[], Any]]) -> dict[str, Any]:
    """The results of all readings; raises SeveralInvalid with the errors of any of them."""
    values: dict[str, Any] = {}
    wrong: list[InvalidInput] = []
    for name, reading in readings.items():
        with noting(wrong):
            values[name] = reading()
    if wrong:
        raise SeveralInvalid(wrong)
    return values
