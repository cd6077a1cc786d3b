"""Waiting for what comes by itself: a busy machine is slow and fails no test for it, so that a hang alone is ended."""

import time
from collections.abc import Callable

LIMIT_S = 240.0


def until(is_so: Callable[[], object], told: object = "") -> None:
    """Return once something is so; AssertionError with what `told` says (a callable: by then) if it never is."""
    deadline = time.monotonic() + LIMIT_S
    while not is_so():
        assert time.monotonic() < deadline, told() if callable(told) else told
        time.sleep(0.05)
