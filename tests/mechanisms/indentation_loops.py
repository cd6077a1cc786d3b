"""A loop of indentation on one skin, and its force by composed models and by JKR's two equations."""

from collections.abc import Sequence

import numpy as np

from tests.support.mechanism_campaigns import SKIN, hertz_force, predicted
from underskin.recordings.campaign import Campaign, IndentationRecording
from underskin.units import Floats

E_MPA, R_MM, H_MM = 2.0, 4.0, 2.5
R, REDUCED = R_MM * 1e-3, E_MPA * 1e6 / 0.75
TIME = 0.2
LOOP = np.concatenate([np.linspace(-0.02, 0.4, 60), np.full(14, 0.4), np.linspace(0.4, -0.1, 70)[1:]])
CREEP = {"relaxed_fraction": 0.5, "relaxation_time": 3.0}
NO_CREEP = {"relaxed_fraction": 0.0, "relaxation_time": 3.0}


def recorded(depth_mm: Floats) -> Campaign:
    time = TIME * np.arange(float(len(depth_mm)))
    recording = IndentationRecording("i", R_MM, depth_mm, hertz_force(depth_mm, R_MM, E_MPA), time_s=time)
    return Campaign("one", SKIN, (recording,))


def force_at(names: Sequence[str], depth_mm: Floats, **values: float) -> Floats:
    """[N], with the contact beginning at 0."""
    return predicted(names, recorded(depth_mm), **{"contact_point i": 0.0, **values})


def jkr(a: Floats, work: float) -> tuple[Floats, Floats]:
    """δ and F on the half space."""
    return a**2 / R - np.sqrt(2 * np.pi * work * a / REDUCED), 4 / 3 * REDUCED * a**3 / R - np.sqrt(
        8 * np.pi * work * REDUCED * a**3
    )
