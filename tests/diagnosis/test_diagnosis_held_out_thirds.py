"""What is held out where a law that nobody listed leads."""

import numpy as np
import pytest

from tests.support.diagnosis_campaigns import Made, design
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.validation.cross_validation import thirds


@pytest.mark.parametrize("recordings", [1, 2, 5, 6, 20])
def test_thirds_hold_out_every_row_once_and_leave_the_rest(recordings: int) -> None:
    """Of a campaign of two recordings a third of them was none, and the diagnosis failed."""
    preloads = np.geomspace(0.3, 3.0, recordings).tolist()
    measured = lines(design(Made(sensors=1, spheres_mm=(4.0,), preloads_n=preloads)))
    held_out = list(thirds(measured, np.arange(recordings, dtype=float)).values())
    assert all(rows.any() and not rows.all() for rows in held_out)
    assert np.array_equal(np.sum(held_out, axis=0), np.ones(len(measured.value)))
    for rows in held_out:
        measured.part(~rows)
        measured.part(rows)


@pytest.mark.parametrize(("count", "groups"), [(1, 0), (2, 2), (3, 3)])
def test_of_few_recordings_with_few_lines_none_is_all_or_nothing(count: int, groups: int) -> None:
    measured = lines(design(Made(sensors=1, spheres_mm=(4.0,), preloads_n=(0.3, 0.5, 1.0, 2.0, 3.0), lines=count)))
    held_out = list(thirds(measured, np.arange(5.0)).values())
    assert len(held_out) == groups
    assert all(rows.any() and not rows.all() for rows in held_out)
