"""What tests of the diagnosis share: the table of σ."""

import pytest

from underskin.surrogate.sigma_table import SigmaTable, load_table


@pytest.fixture(scope="session")
def table() -> SigmaTable:
    """The one that comes with the library."""
    return load_table()
