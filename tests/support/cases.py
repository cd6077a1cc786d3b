"""Cases of tests that take long: all in `make soak`, otherwise the first few, which show what the test is about."""

from collections.abc import Iterable
from typing import TypeVar

from bench.soak import SOAK

_Case = TypeVar("_Case")


def first(count: int, cases: Iterable[_Case]) -> list[_Case]:
    """The first `count` cases; in `make soak` all."""
    return list(cases)[: None if SOAK else count]
