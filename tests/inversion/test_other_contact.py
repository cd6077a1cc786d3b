"""d33 of an array by the solved contact, beside the paper's."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.simulated_campaign import Rig, simulate
from underskin.inversion.invert import array_d33_by_other, invert
from underskin.surrogate.sigma_table import load_table
from underskin.surrogate.solved_contact import solved_contact

D33 = 14.0  # pC/N
THIN = Rig(np.full(3, D33), preloads_n=(1.0, 2.0), thickness_mm=0.6, sensor_radius_mm=0.4, gain=0.01)
TABLE, SOLVED = load_table(), solved_contact()


def test_a_thin_skin_in_contact_with_itself() -> None:
    """Recordings of the solved contact give their d33 by it; the paper's is off, and the other is stated."""
    campaign = simulate(SOLVED, THIN, np.random.default_rng(2))
    paper, solved = (invert(campaign, model) for model in (TABLE, SOLVED))
    assert paper.absolute_d33 is not None
    assert solved.absolute_d33 is not None
    assert 1e12 * float(solved.absolute_d33.value) == pytest.approx(D33, rel=0.02)
    assert 1e12 * float(paper.absolute_d33.value) > 1.04 * D33
    other = array_d33_by_other(campaign, TABLE, paper)
    assert other is not None
    assert float(other.value) == pytest.approx(float(solved.absolute_d33.value), rel=1e-12)


def test_a_thick_skin() -> None:
    """Where the two differ by less than 1 % nothing is stated."""
    thick = replace(THIN, thickness_mm=2.5, sensor_radius_mm=1.5, preloads_n=(0.3, 0.6))
    campaign = simulate(TABLE, thick, np.random.default_rng(2))
    assert array_d33_by_other(campaign, TABLE, invert(campaign, TABLE)) is None
