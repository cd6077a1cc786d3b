"""Young's modulus of curves: its interval against integrals over what curves leave open."""

from math import pi

import numpy as np
import pytest
from scipy.stats import norm

import underskin
from rig.description import parse as experiment
from rig.draw_curves import drawn_curves
from rig.effects import INDENTATION
from rig.elastomer import campaign_of_curves, record_curves
from tests.support.lean_reports import beside, lean_report, quick_diagnosis
from underskin import SkinDescription
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording, parse
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

pytestmark = pytest.mark.slow

_FRAME = "instrument_compliance"
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


MODULUS_MPA = 1.5
PRESSED = experiment(
    {
        "schema": "experiment/1", "name": "curves", "seed": 4, "kind": "indentation",
        "effects": {"contact_creep": {"fraction": 0.1, "time_s": 0.05}},
        "skin": {
            "thickness_mm": 4.0, "youngs_modulus_mpa": MODULUS_MPA, "sensor_radius_mm": 1.0, "d33_pc_per_n": 10.0
        },
        "curves": {
            "indenters_mm": [0.09], "largest_displacement_mm": 7e-3, "samples": 600, "speeds_mm_per_s": [0.02],
            "repeats": 2, "hold_s": 3.0, "retract": True, "approach_mm": 0.02, "retreat_mm": 6e-3, "times": True,
            "modulus_declared": False, "units_checked": True, "contact_point_mm": 0.02, "force_zero_n": 7e-6,
            "gain": 0.01, "cell_gain": 0.01, "force_noise_n": 3e-7,
        },
    }
)  # fmt: skip


def test_modulus_of_a_relaxation_at_the_foot(table: SigmaTable) -> None:
    """A weak relaxation much faster than the loading is found: what it changes at the foot is not the modulus."""
    report = lean_report(
        parse(campaign_of_curves(PRESSED, record_curves(PRESSED))),
        table,
        *beside("contact_creep", "instrument_compliance"),
    )
    modulus = report["fit"]["after"]["youngs_modulus"]
    assert [entry["name"] for entry in report["mechanisms"]] == ["contact_creep"]
    assert modulus["low"] < MODULUS_MPA < modulus["high"]


def test_stiffening_with_strain_is_as_likely_as_with_the_invariant(table: SigmaTable) -> None:
    """Of a modulus that grows with the contact's strain the exponent is 1, or else E takes up a tenth of it."""
    campaign = parse(campaign_of_curves(*drawn_curves(51764, 10, INDENTATION, "single")))
    report = lean_report(campaign, table, *beside("strain_stiffening", "instrument_compliance"))
    (stiffening,) = report["mechanisms"]
    exponent = next(entry for entry in stiffening["parameters"] if entry["name"] == "stiffening_exponent")
    assert exponent["low"] == pytest.approx(1.0, abs=0.01)


def test_no_modulus_where_nothing_describes_the_curve(table: SigmaTable) -> None:
    """A force that falls in a hold without a time cannot be described by any law; then no modulus is stated."""
    depth = np.concatenate([np.linspace(-0.1, 0.2, 300), np.full(300, 0.2)])
    force = 16 / 9 * 2.0 * np.sqrt(5.0) * np.maximum(depth, 0.0) ** 1.5
    force[300:] *= 1 - 0.1 * np.log1p(np.arange(300.0))
    force += 1e-3 * force.max() * np.random.default_rng(2).normal(size=len(force))
    skin = SkinDescription(poisson_ratio=0.5, thickness_mm=80.0, youngs_modulus_mpa=None, sensor_radius_mm=1.0)
    curve = IndentationRecording("i", 5.0, depth, force)
    report = lean_report(Campaign("one", skin, (curve,), units_checked=True), table, *beside("instrument_compliance"))
    assert report["verdict"] == "unexplained"
    assert "youngs_modulus" not in report["fit"]["after"]


def on_frame(stiffness: float, noise: float, *heights: float, largest: float = 0.4) -> underskin.Report:
    """The report on blocks of 3 MPa and 10 mm diameter on a frame of so many N/mm, whose E holds 3 MPa."""
    strain, blocks = np.linspace(0.0, largest, 200), []
    for number, height in enumerate(heights):
        force = pi / 4 * 10.0**2 * ((1 - strain) ** -2 - (1 - strain))
        force += noise * force.max() * np.random.default_rng(number).normal(size=len(force))
        blocks.append(CompressionRecording(f"b{number}", height, 10.0, height * strain + force / stiffness, force))
    report = quick_diagnosis(Campaign("frame", SkinDescription(poisson_ratio=0.5), tuple(blocks)))
    assert report.fit is not None
    modulus = report.fit.after.youngs_modulus
    assert modulus is not None
    assert modulus.low is not None
    assert modulus.high is not None
    assert modulus.low < 3.0 < modulus.high
    return report


@pytest.mark.parametrize("stiffness", [100.0, 1000.0])
def test_a_frame_that_gives_is_a_rival_of_softening(stiffness: float) -> None:
    """One block cannot tell the frame from a softer solid: neither is named alone, and steel is to be pressed."""
    report = on_frame(stiffness, 5e-4, 10.0)
    assert report.verdict == "ambiguous"
    rivals = [list(answer.mechanisms) for answer in report.alternatives if answer.probability > 0.1]
    assert [[mechanism.name for mechanism in report.mechanisms], *rivals] == [[_FRAME], ["strain_stiffening"]]
    assert "a block of steel" in report.statement
    assert report.next_experiment is not None
    assert "A block of steel" in report.next_experiment.statement


@pytest.mark.parametrize("largest", [0.06, 0.12])
def test_a_soft_frame_is_no_softening_of_a_slightly_pressed_block(largest: float) -> None:
    """A desktop tester of 100 N/mm: the block is not said to soften."""
    assert on_frame(100.0, 2e-3, 10.0, largest=largest).verdict == "ambiguous"


def test_blocks_of_two_heights_tell_a_frame_that_gives() -> None:
    """The frame gives by the force, the solid by the strain: E and k are both told."""
    report = on_frame(100.0, 5e-4, 5.0, 20.0)
    assert (report.verdict, [mechanism.name for mechanism in report.mechanisms]) == ("explained", [_FRAME])
    (stiffness,) = report.mechanisms[0].parameters
    assert stiffness.low is not None
    assert stiffness.high is not None
    assert stiffness.low < 100.0 < stiffness.high
