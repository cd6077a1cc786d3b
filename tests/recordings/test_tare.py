"""The part of a curve over which its force is 0: one level, or past the contact."""

import numpy as np
import pytest

from underskin.recordings.rig_mapping import rise_of

_NOISE = 0.01


def curve(contact: int) -> np.ndarray:
    """400 samples, pressed from `contact` on."""
    number = np.arange(400)
    return _NOISE * np.random.default_rng(1).normal(size=400) + np.maximum(number - contact, 0.0) ** 1.5 / 100


def test_a_level_in_the_air_is_no_rise() -> None:
    assert rise_of(curve(contact=80), 80) is None
    assert rise_of(curve(contact=80), 8) is None  # too few to tell


def test_what_is_past_the_contact_is_told_with_where_it_begins() -> None:
    found = rise_of(curve(contact=50), 80)
    assert found is not None
    assert 50 < found.start < 60
    assert found.height == pytest.approx(27.0**1.5 / 100, rel=0.1)
    assert found.level == pytest.approx(0, abs=_NOISE)
