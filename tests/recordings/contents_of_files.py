"""What is read from files."""

import pytest

from tests.support.instrument_files import (
    CHARGE,
    FORCE,
)
from underskin.recordings import read_contents, read_file
from underskin.recordings.campaign import to_dict
from underskin.recordings.channels import Contents
from underskin.recordings.rig_description import RigDescription


def the_time_series(data: bytes, name: str, rig: RigDescription, rate: float = 1000.0) -> list[str]:
    """Asserts that a file holds FORCE and CHARGE as that rig wrote them; returns the warnings."""
    reading = read_file(data, name, rig)
    assert not reading.problems
    for recording in to_dict(reading.campaign)["recordings"]:
        assert recording["sample_rate_hz"] == pytest.approx(rate)
        assert recording["force_n"] == pytest.approx(FORCE)
        assert recording["charge_pc"] == pytest.approx(CHARGE)
    return reading.warnings


def contents(data: bytes, name: str) -> Contents:
    found = read_contents(data, name)
    assert isinstance(found, Contents)
    return found
