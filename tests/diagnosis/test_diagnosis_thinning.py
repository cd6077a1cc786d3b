"""Curves thinned to means over blocks: each lies on the curve to within its deviation."""

import numpy as np
import pytest

from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.recordings.campaign import Campaign, IndentationRecording
from underskin.recordings.conditions import SkinDescription
from underskin.recordings.curve_course import course
from underskin.units import Floats


@pytest.mark.parametrize("unsteady", [0.0, 1e-3])
@pytest.mark.parametrize("steeper", [1.0, 2.0])
def test_thinned_samples_lie_on_the_curve_to_within_their_deviation(unsteady: float, steeper: float) -> None:
    """Also where the displacement is noisier than it moves between samples, where a slope between two of them is noise;
    and where the way back is steeper than the way in, whose blocks are no neighbours of it."""
    random = np.random.default_rng(3)
    way = np.concatenate([np.linspace(-0.1, 0.3, 2000), np.linspace(0.3, -0.1, 2000)[1:]])
    turn = 1999
    skin = SkinDescription(poisson_ratio=0.5)
    left, near = [], []
    for _ in range(8):
        noisy = hysteretic(way, turn, steeper) + 1e-4 * random.normal(size=len(way))
        read = way + unsteady * random.normal(size=len(way))
        lines = curve_lines(Campaign("c", skin, (IndentationRecording("i", 1.0, read, noisy),)), "indentation")
        (entry,) = lines.campaign.recordings
        assert isinstance(entry, IndentationRecording)
        assert len(lines.value) < 200
        back = int(np.argmax(entry.displacement_mm))
        depth = np.maximum(entry.displacement_mm, 0.0)
        error = (entry.force_n + course(read, noisy).zero - hysteretic(depth, back, steeper)) / lines.deviation
        left.append(error)
        near.append(error[back - 15 : back + 15])
        of_one_sample = np.hypot(1e-4, unsteady * 1.5 * np.sqrt(depth + 0.02))
        assert steeper > 1 or (lines.deviation < 1.5 * of_one_sample).all()  # the steeper way back has kinks
    every, turning = np.concatenate(left), np.concatenate(near)
    assert abs(every.mean()) < 0.2
    assert np.sqrt((every**2).mean()) == pytest.approx(1.0, abs=0.25)
    assert np.sqrt((turning**2).mean()) < 1.5


def hysteretic(displacement: Floats, turn: int, steeper: float) -> Floats:
    """d^(3/2) on the way in to 0.3, with that sample; on the way back less, as a slope so much steeper has it, by a
    fifth of the largest force at most."""
    lost = (steeper - 1) * 1.5 * np.sqrt(0.3) * np.maximum(0.3 - displacement, 0.0)
    back = (np.arange(len(displacement)) > turn) & (displacement > 0)
    force = np.maximum(displacement, 0.0) ** 1.5
    return np.asarray(force - np.where(back, np.minimum(np.minimum(lost, 0.2 * 0.3**1.5), force), 0.0))


@pytest.mark.parametrize("seed", range(4))
def test_a_displacement_much_noisier_than_its_steps_makes_no_hold_and_no_bias(seed: int) -> None:
    """Noise of fifty steps, a twenty-fifth of the depth: where a sphere turns it seems to rest, and single samples at
    the foot of a contact lie beside the curve."""
    random = np.random.default_rng(seed)
    way = np.concatenate([np.linspace(-0.02, 0.1, 1500), np.linspace(0.1, -0.02, 1500)])
    read = way + 4e-3 * random.normal(size=len(way))
    force = np.maximum(way, 0.0) ** 1.5 + 5e-5 * random.normal(size=len(way))
    seen = course(read, force)
    assert abs(seen.turn - 1500) < 60
    assert seen.arrive == seen.turn
    skin = SkinDescription(poisson_ratio=0.5)
    lines = curve_lines(Campaign("c", skin, (IndentationRecording("i", 1.0, read, force),)), "indentation")
    (entry,) = lines.campaign.recordings
    assert isinstance(entry, IndentationRecording)
    error = (entry.force_n + seen.zero - np.maximum(entry.displacement_mm, 0.0) ** 1.5) / lines.deviation
    assert np.sqrt((error**2).mean()) < 2
    assert abs(error.mean()) < 0.5
