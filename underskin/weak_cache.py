"""A cache whose results are dropped with the object that they were computed from."""

from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

P = ParamSpec("P")
T = TypeVar("T")


def cached_while_alive(function: Callable[P, T]) -> Callable[P, T]:
    """A decorator: keep results as long as the first argument lives, for each set of the other arguments.

    The first argument is identified by its hash, which for a dataclass without `eq` is its identity; a result must
    not refer to it, or neither is freed. All arguments are positional.
    """
    cache: WeakKeyDictionary[Any, dict[tuple[Hashable, ...], T]] = WeakKeyDictionary()

    @wraps(function)
    def cached(*arguments: P.args, **keywords: P.kwargs) -> T:
        first, others = arguments[0], arguments[1:]
        results = cache.setdefault(first, {})
        if others not in results:
            results[others] = function(*arguments, **keywords)
        return results[others]

    return cached
