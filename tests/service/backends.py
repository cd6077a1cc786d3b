"""The databases that tests of stores run on."""

import pytest

from bench.soak import SOAK

BACKENDS = ("sqlite", "postgresql")


def on(backend: str) -> pytest.MarkDecorator:
    """A test of minutes whose `place` is of one database; `make soak` runs it on both."""
    return pytest.mark.parametrize("place", BACKENDS if SOAK else [backend], indirect=True)
