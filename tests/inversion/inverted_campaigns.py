"""Campaigns drawn or changed for the tests of the inversion, and how often intervals cover."""

from dataclasses import replace
from typing import Any

import numpy as np

from tests.support.simulated_campaign import LARGEST_SCATTER_MM, Rig
from underskin.inversion.mixed_model import Estimate
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.units import Complexes, Floats


def drawn(random: np.random.Generator) -> tuple[Rig, float]:
    """A rig like the paper's, and the array's d33 [pC/N] (one sensor: its own)."""
    count = int(random.choice([1, 2, 4, 9, 16]))
    spread = float(random.choice([0.0, 0.0, 0.0, 0.01, random.uniform(0.05, 0.15)]))
    array = float(random.uniform(8, 30))
    d33 = array * (1 + spread * random.normal(size=count))
    rig = Rig(
        d33=d33,
        preloads_n=tuple(np.linspace(0.5, random.uniform(1.5, 3), int(random.integers(2, 7))).tolist()),
        thickness_mm=float(random.uniform(1.5, 3.8)),
        modulus_mpa=float(random.uniform(4, 16)),
        sensor_radius_mm=float(random.uniform(0.6, 2.5)),
        gain=float(np.exp(random.uniform(np.log(0.01), np.log(0.05)))),
        position_mm=float(random.uniform(0.1, LARGEST_SCATTER_MM)) if random.random() < 0.3 else 0.0,
        largest_offset_mm=1.0 if random.random() < 0.3 else 0.0,
        line=float(random.uniform(0.003, 0.03)),
        averages=float(random.choice([8, 16, 32])),
    )
    return rig, array if count > 1 else float(d33[0])


def covered(estimate: Estimate | None, truth_pc_per_n: Floats) -> Floats:
    """Of each true d33 whether the interval holds it; an estimate that is not given fails."""
    assert estimate is not None
    truth = truth_pc_per_n * 1e-12
    return np.asarray((estimate.low <= truth) & (truth <= estimate.high), dtype=float)


def times(recording: FrfRecording, factor: complex | Floats | Complexes) -> FrfRecording:
    """The recording with its FRF times this."""
    value = factor * (np.asarray(recording.frf_re_pc_per_n) + 1j * np.asarray(recording.frf_im_pc_per_n))
    return replace(recording, frf_re_pc_per_n=value.real, frf_im_pc_per_n=value.imag)


def moved(campaign: Campaign, row: int, **changes: Any) -> Campaign:
    recording = replace(campaign.recordings[row], **changes)
    return replace(campaign, recordings=(*campaign.recordings[:row], recording, *campaign.recordings[row + 1 :]))


def scaled(campaign: Campaign, row: int, factor: float | Floats) -> Campaign:
    recording = campaign.recordings[row]
    assert isinstance(recording, FrfRecording)
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_im_pc_per_n is not None
    real, imaginary = factor * recording.frf_re_pc_per_n, factor * recording.frf_im_pc_per_n
    return moved(campaign, row, frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary)
