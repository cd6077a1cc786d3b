"""A cache whose entries end with the object that they were worked out from."""

import gc
import weakref

import numpy as np

from underskin.units import Floats
from underskin.weak_cache import cached_while_alive


class Made:
    """What results are worked out from."""

    number = 1


def test_result_worked_out_once_object_argument() -> None:
    """A result is worked out once for each object and argument and ends with the object."""
    calls: list[int] = []

    @cached_while_alive
    def worked_out(made: Made, size: int) -> Floats:
        calls.append(size)
        return np.zeros(size * made.number)

    first, second = Made(), Made()
    result = worked_out(first, 3)
    assert worked_out(first, 3) is result
    assert worked_out(first, 4).shape == (4,)
    assert worked_out(second, 3) is not result
    assert calls == [3, 4, 3]
    ends = weakref.ref(result)
    del result, first
    gc.collect()
    assert ends() is None
    assert worked_out(second, 3).shape == (3,)
    assert calls == [3, 4, 3]
