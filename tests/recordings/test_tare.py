"""The part of a curve over which its force is 0: one level, or past the contact."""

import numpy as np
import pytest

from underskin.recordings.tare import rise_of

_NOISE = 0.01


def curve(contact: int) -> np.ndarray:
    """400 samples, pressed from `contact` on."""
    number = np.arange(400)
    return _NOISE * np.random.default_rng(1).normal(size=400) + np.maximum(number - contact, 0.0) ** 1.5 / 100


def test_a_level_in_the_air_is_no_rise() -> None:
    assert rise_of(curve(contact=80), 80) is None
    assert rise_of(curve(contact=80), 8) is None  # too few to tell


def test_past_contact_told_begins() -> None:
    """What is past the contact is told with where it begins."""
    found = rise_of(curve(contact=50), 80)
    assert found is not None
    assert 50 < found.start < 60
    assert found.height == pytest.approx(27.0**1.5 / 100, rel=0.1)
    assert found.level == pytest.approx(0, abs=_NOISE)
