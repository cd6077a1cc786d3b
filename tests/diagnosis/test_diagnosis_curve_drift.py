"""Drifts of a load cell along indentation curves: told by the air before contact, and from the foot of a contact."""

import numpy as np
import pytest

from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.recordings.campaign import Campaign, IndentationRecording, parse
from underskin.recordings.conditions import SkinDescription
from underskin.recordings.curve_course import course
from underskin.surrogate.sigma_table import SigmaTable


@pytest.mark.slow
def test_a_drift_as_large_as_the_force_is_told_by_the_samples_in_the_air(table: SigmaTable) -> None:
    """A slow curve runs off by nearly its own force, a fast one hardly; both show it before contact."""
    random = np.random.default_rng(6)
    depth = np.concatenate([np.linspace(-0.2, 0.2, 400), np.linspace(0.2, -0.2, 400)])
    hertz = 16 / 9 * 2.0 * np.sqrt(5.0) * np.maximum(depth, 0) ** 1.5
    recordings = []
    for number, (seconds, share) in enumerate(((10.0, 0.05), (200.0, 0.9))):
        time = np.linspace(0, seconds, len(depth))
        noise = random.normal(0, 1e-3 * hertz.max(), len(depth))
        force = hertz + share * hertz.max() * time / seconds + noise
        seen = course(depth, force, time)
        assert seen.drift == pytest.approx(share * hertz.max() / seconds, rel=0.1)
        assert depth[seen.air[-1]] == pytest.approx(0.0, abs=0.02)
        curve = {"displacement_mm": depth.tolist(), "force_n": force.tolist(), "time_s": time.tolist()}
        recordings.append({"id": f"c{number}", "kind": "indentation", "indenter_radius_mm": 5.0, **curve})
    skin = {"thickness_mm": 80.0, "youngs_modulus_mpa": 2.0, "poisson_ratio": 0.5}
    report = diagnosis_report(
        parse({"schema": "campaign/1", "name": "drift", "skin": skin, "recordings": recordings}), table
    )
    assert (report["verdict"], report["probability"] > 0.95) == ("no_mismatch", True)


@pytest.mark.parametrize("rate", [-1.2e-3, 1.2e-3])
@pytest.mark.parametrize("exponent", [1.5, 2.5])
def test_the_air_after_contact_tells_a_drift_where_that_before_is_too_short(rate: float, exponent: float) -> None:
    """Ten samples of air before contact and four hundred after it, of a law that rises otherwise than Hertz's."""
    random = np.random.default_rng(8)
    depth = np.concatenate([np.linspace(-0.01, 0.4, 400), np.linspace(0.4, -0.4, 800)])
    time = np.linspace(0, 300, len(depth))
    noise = 2e-3
    force = np.maximum(depth / 0.4, 0.0) ** exponent + rate * time + noise * random.normal(size=len(depth))
    assert course(depth, force, time).drift == pytest.approx(rate, rel=0.05)
    steady = course(depth, force - rate * time, time)
    assert steady.drift == 0.0
    seen = course(depth, force, time)
    assert len(seen.air) > 100
    assert depth[seen.air].max() < 0.1
    assert seen.zero == pytest.approx(0.0, abs=0.1 * abs(rate) * 300)
    # A tail that ends where the force did not begin is no drift of the cell.
    sticking = force - rate * time + 0.3 * np.maximum(time - 150, 0.0) / 150
    assert course(depth, sticking, time).drift in (0.0, pytest.approx(0.3 / 150, rel=0.05))


def test_a_drift_after_contact_counts_where_no_sample_lies_before_it() -> None:
    random = np.random.default_rng(9)
    depth = np.concatenate([np.linspace(0.05, 0.4, 60), np.linspace(0.4, -0.4, 120)])
    time = np.linspace(0, 300, len(depth))
    force = np.maximum(depth / 0.4, 0.0) ** 1.5 + 2e-3 * random.normal(size=len(depth))
    rate = float(force[0] - force[-1]) / 300 + 2e-3  # leads from the first reading to the last, a contact's each
    curve = IndentationRecording("i", 5.0, depth, force + rate * time, time_s=time)
    seen = course(curve.displacement_mm, curve.force_n, time)
    assert seen.has_air
    assert seen.drift == pytest.approx(rate, rel=0.05)
    lines = curve_lines(Campaign("c", SkinDescription(poisson_ratio=0.5), (curve,)), "indentation")
    assert lines.smooth is not None
    assert np.abs(lines.smooth.columns[:, 1]).max() == pytest.approx(rate * 300, rel=0.1)


def test_samples_that_share_a_coarse_time_show_no_drift() -> None:
    random = np.random.default_rng(10)
    depth = np.concatenate([np.linspace(-0.2, 0.4, 300), np.linspace(0.4, -0.4, 400)])
    force = np.maximum(depth / 0.4, 0.0) ** 2.5 + 2e-3 * random.normal(size=len(depth))
    for time in (np.zeros(len(depth)), np.repeat([0.0, 1.0], len(depth) // 2)):
        assert abs(course(depth, force, time).drift) * max(np.ptp(time), 1.0) < 0.02


@pytest.mark.parametrize("exponent", [1.5, 2.0, 2.5])
@pytest.mark.parametrize("noise", [1e-4, 1e-2])
def test_the_foot_of_a_contact_is_no_drift(exponent: float, noise: float) -> None:
    random = np.random.default_rng(7)
    for begin in (0.0, -0.2):  # in contact from the first sample, or air without a drift
        depth = np.concatenate([np.linspace(begin, 0.2, 400), np.linspace(0.2, begin, 400)])
        force = np.maximum(depth / 0.2, 0) ** exponent + noise * random.normal(size=len(depth))
        seen = course(depth, force, np.linspace(0, 10, len(depth)))
        assert 10 * abs(seen.drift) < 5 * noise
        curve = IndentationRecording("i", 5.0, depth, force)
        lines = curve_lines(Campaign("c", SkinDescription(poisson_ratio=0.5), (curve,)), "indentation")
        assert lines.smooth is not None
        assert np.abs(lines.smooth.columns[:, 1:]).max() < 0.03 * force.max()


@pytest.mark.slow
def test_a_drift_in_time_is_no_mismatch_where_the_file_has_no_times(table: SigmaTable) -> None:
    """Way in, hold and way back at a steady rate; the zero runs off by 3 % of the largest force."""
    random = np.random.default_rng(5)
    depth = np.concatenate([np.linspace(-0.3, 0.2, 250), np.full(80, 0.2), np.linspace(0.2, -0.3, 250)])
    hertz = 16 / 9 * 2.0 * np.sqrt(5.0) * np.maximum(depth, 0) ** 1.5
    recordings = []
    for number in range(3):
        drift = 0.03 * hertz.max() * np.linspace(0, 1, len(depth)) + random.normal(0, 1e-3 * hertz.max(), len(depth))
        curve = {"displacement_mm": (depth + 0.05 * number).tolist(), "force_n": (hertz + drift).tolist()}
        recordings.append({"id": f"c{number}", "kind": "indentation", "indenter_radius_mm": 5.0, **curve})
    skin = {"thickness_mm": 80.0, "youngs_modulus_mpa": 2.0, "poisson_ratio": 0.5}
    document = {"schema": "campaign/1", "name": "drift", "skin": skin, "recordings": recordings}
    report = diagnosis_report(parse(document), table)
    assert (report["verdict"], report["probability"] > 0.95) == ("no_mismatch", True)


def test_a_drift_is_believed_where_the_way_back_ends_as_soon_as_contact_has() -> None:
    """Noise of 0.4 % hides how straight the air is; the force where the sphere is free again does not. The foot of a
    law that rises otherwise than Hertz's is gone there."""
    random = np.random.default_rng(8)
    depth = np.concatenate([np.linspace(-0.4, 0.4, 600), np.linspace(0.4, -0.05, 340)])
    time, rate = np.linspace(0, 300, len(depth)), 7e-4
    noise = 4e-3 * random.normal(size=len(depth))
    pressed = {power: np.maximum(depth / 0.4, 0.0) ** power + noise for power in (1.5, 2.5)}
    assert course(depth, pressed[1.5] + rate * time, time).drift == pytest.approx(rate, rel=0.1)
    assert [course(depth, force, time).drift for force in pressed.values()] == [0.0, 0.0]
