"""Mains pick-up is told as such however wide its lines are, and whatever their shape and harmonics."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, added, campaign
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

MADE = Made(sensors=3, preloads_n=(0.5, 1.2, 2.4), lines=60, line=0.005)


def picked_up(quiet: Campaign, line: Floats, share: float) -> Campaign:
    """A charge of random phase in each recording, `share` of the response at the middle of a line of this shape."""
    random = np.random.default_rng(4)
    return added(
        quiet, lambda real: share * np.median(real) * np.exp(2j * np.pi * random.random()) * line.astype(complex)
    )


@pytest.mark.slow
@pytest.mark.parametrize("share", first(1, [0.1, 0.7]))
@pytest.mark.parametrize(("shape", "width_hz"), [("bell", 1.0), ("bell", 3.0), ("resonance", 2.0)])
def test_mains_are_named(shape: str, width_hz: float, share: float, table: SigmaTable) -> None:
    """With a third of it at the third harmonic: strong pick-up was `unexplained` where lines were not 1.5 Hz wide."""
    quiet = campaign(replace(MADE, highest_hz=200.0), table)
    first = quiet.recordings[0]
    assert isinstance(first, FrfRecording)
    assert first.frequency_hz is not None
    frequency = first.frequency_hz
    away = (frequency[:, None] - np.array([50.0, 150.0])) / width_hz
    lines = np.exp(-0.5 * away**2) if shape == "bell" else 1 / (1 + away**2)
    report = diagnosis_report(picked_up(quiet, lines @ np.array([1.0, 1 / 3]), share), table)
    assert report["verdict"] == "explained"
    (found,) = report["mechanisms"]
    assert found["name"] == "mains_pickup"
    assert found["explains_percent"] > 80.0 or share < 0.5
    assert all(entry["low"] < entry["value"] < entry["high"] for entry in found["parameters"])
    if shape == "bell":
        _, width, _ = found["parameters"]
        assert width["value"] == pytest.approx(width_hz, rel=0.35)
