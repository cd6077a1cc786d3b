"""A cache whose entries end with the object that they were worked out from."""

from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

P = ParamSpec("P")
T = TypeVar("T")


def cached_while_alive(function: Callable[P, T]) -> Callable[P, T]:
    """A decorator: keep results for as long as the first argument lives, and for each set of the others.

    The first argument is told apart by its hash, which for a dataclass without `eq` is its identity; a result must not
    hold it, or neither ends. All arguments are positional.
    """
    kept: WeakKeyDictionary[Any, dict[tuple[Hashable, ...], T]] = WeakKeyDictionary()

    @wraps(function)
    def cached(*arguments: P.args, **named: P.kwargs) -> T:
        first, others = arguments[0], arguments[1:]
        results = kept.setdefault(first, {})
        if others not in results:
            results[others] = function(*arguments, **named)
        return results[others]

    return cached
