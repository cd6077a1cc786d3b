"""Young's modulus of curves: its interval against integrals over what curves leave open."""

import numpy as np
import pytest
from scipy.stats import norm

from tests.support.lean_reports import beside, lean_report
from underskin import SkinDescription
from underskin.recordings.campaign import Campaign, IndentationRecording
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

SHARED_CELL = 0.01  # sd of the logarithm of the gain that all curves share


def log_prior(log_scatter: Floats) -> Floats:
    """Of the scatter of gains: even in its logarithm from 1 to 5 %, half Gaussians beside."""
    below, above = (np.log(0.01) - log_scatter) / 0.6, (log_scatter - np.log(0.05)) / 0.35
    return -0.5 * (np.maximum(below, 0) + np.maximum(above, 0)) ** 2


def interval(gains: Floats) -> tuple[float, float]:
    """95 % of ln E − its most probable value, of exact curves with these log gains, integrated numerically."""
    scatter = np.exp(np.linspace(np.log(1e-3), np.log(0.5), 400))
    centre, x = gains.mean(), np.linspace(-1, 1, 20001)
    square = ((gains - centre) ** 2).sum()
    weight = log_prior(np.log(scatter)) - (len(gains) - 1) * np.log(scatter) - 0.5 * square / scatter**2
    weight = np.exp(weight - weight.max())
    deviation = np.hypot(scatter / np.sqrt(len(gains)), SHARED_CELL)
    below = (weight[:, None] * norm.cdf(x / deviation[:, None])).sum(axis=0) / weight.sum()
    low, high = np.interp([0.025, 0.975], below, x)
    return float(low), float(high)


@pytest.mark.parametrize("gains", [(0.0,), (-0.02, 0.02), (0.01, -0.01, 0.03, -0.03, 0.02, -0.02)])
def test_modulus_integrates_over_the_scatter_of_gains(gains: tuple[float, ...], table: SigmaTable) -> None:
    """The interval is that over all scatters: of one curve as wide as gains usually are, of few that of Student's t."""
    depth = np.linspace(-0.05, 0.2, 300)
    force = 16 / 9 * 2.0 * np.sqrt(5.0) * np.maximum(depth, 0.0) ** 1.5
    noise = 2e-4 * force.max() * np.random.default_rng(3).normal(size=(len(gains), len(depth)))
    curves = tuple(
        IndentationRecording(f"i{number}", 5.0, depth, np.exp(gain) * force + noise[number])
        for number, gain in enumerate(gains)
    )
    skin = SkinDescription(poisson_ratio=0.5, thickness_mm=80.0, youngs_modulus_mpa=None, sensor_radius_mm=1.0)
    report = lean_report(Campaign("one", skin, curves, units_checked=True), table, *beside("instrument_compliance"))
    modulus = report["fit"]["before"]["youngs_modulus"]
    low, high = interval(np.array(gains))
    assert np.log(modulus["high"] / modulus["low"]) == pytest.approx(high - low, rel=0.1)
    assert modulus["low"] < 2.0 * np.exp(np.mean(gains)) < modulus["high"]
