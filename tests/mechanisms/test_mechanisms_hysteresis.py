"""Contacts that part at another price than they were made at, relax over decades of time, or move in a liquid."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import beta, betainc

from tests.mechanisms.indentation_loops import E_MPA, NO_CREEP, R_MM, REDUCED, TIME, R, force_at, jkr, recorded
from tests.support.mechanism_campaigns import SKIN, hertz_force, predicted, table
from underskin.mechanisms import Unsupported, compose
from underskin.mechanisms.laws import contact_creep
from underskin.mechanisms.models.sphere_contact import Sphere, Stiffening
from underskin.recordings.campaign import Campaign, IndentationRecording
from underskin.units import Floats

HYSTERESIS = {"work_of_adhesion": 0.2, "work_of_separation": 2.5}  # the second in multiples of the first


def of_jkr(depth: Floats, work: float) -> Floats:
    """F of the stable branch."""
    a = np.linspace(1e-5, 2e-3, 400_001)
    along, force = jkr(a, work)
    least = int(np.argmin(along))
    return np.interp(depth, along[least:], force[least:])


def test_the_edge_rests_until_it_costs_the_work_of_separation_then_recedes() -> None:
    depth = np.concatenate([np.linspace(-0.05, 0.3, 71), np.linspace(0.3, -0.1, 401)[1:]])
    found = force_at(["adhesion"], depth, **HYSTERESIS)
    into = (depth[:71] >= 0).nonzero()[0]
    assert found[into] == pytest.approx(of_jkr(depth[into] * 1e-3, 0.2), abs=2e-5)
    a = brentq(lambda a: float(jkr(np.asarray(a), 0.2)[0]) - 0.3e-3, 1e-4, 2e-3)
    flat = found[70] - 2 * REDUCED * a * (0.3e-3 - depth[71:] * 1e-3)
    receding = of_jkr(depth[71:] * 1e-3, 0.5)
    back, resting = found[71:], flat > receding
    assert 10 < resting.sum() < 200
    assert back[resting] == pytest.approx(flat[resting], abs=2e-5)
    held = back != 0
    assert back[~resting & held] == pytest.approx(receding[~resting & held], abs=2e-5)
    release = (4 * REDUCED * a**3 / (3 * R) - flat[resting][-1]) ** 2 / (8 * np.pi * REDUCED * a**3)
    assert release == pytest.approx(0.5, rel=0.03)


def test_hysteresis_loses_work_and_none_without_it() -> None:
    depth = np.concatenate([np.linspace(0.0, 0.3, 301), np.linspace(0.3, 0.0, 301)[1:]])

    def lost(separation: float) -> float:
        force = force_at(["adhesion"], depth, work_of_adhesion=0.2, work_of_separation=separation)
        return float(np.trapezoid(force, depth))

    assert lost(1.0) == pytest.approx(0.0, abs=1e-6)
    assert 1e-4 < lost(1.5) < lost(3.0)


def test_creep_leaves_the_hysteresis_of_a_body_that_does_not_relax() -> None:
    depth = np.concatenate([np.linspace(-0.05, 0.3, 71), np.linspace(0.3, -0.1, 81)[1:]])
    expected = force_at(["adhesion"], depth, **HYSTERESIS)
    found = force_at(["adhesion", "contact_creep"], depth, **HYSTERESIS, **NO_CREEP)
    assert found == pytest.approx(expected, abs=5e-5 * expected.max())


def test_power_law_relaxes_as_lee_and_radok() -> None:
    """A sphere pressed in at a constant speed and held is that of the hereditary integral in closed form.

    E(t) = E (t/1 s)^(−n) and δ = vt give F ∝ ∫₀^t (t−s)^(−n) d(s^(3/2)), an incomplete Beta function.
    """
    ramp, depth_mm = 0.2, 0.3
    time = np.concatenate([np.linspace(0, ramp, 400), ramp + np.geomspace(1e-3, 30.0, 60)])
    depth = np.minimum(time / ramp, 1.0) * depth_mm
    recording = IndentationRecording("i", R_MM, depth, hertz_force(depth, R_MM, E_MPA), time_s=time)
    campaign = Campaign("one", SKIN, (recording,))
    for n in (0.05, 0.15, 0.4):
        values = {"relaxed_fraction": 0.0, "relaxation_exponent": n}
        found = predicted(["contact_creep"], campaign, **{"contact_point i": 0.0}, **values)
        reached = np.minimum(ramp / np.maximum(time, 1e-12), 1.0)
        integral = 1.5 * time ** (1.5 - n) * beta(1.5, 1 - n) * betainc(1.5, 1 - n, reached)
        exact = hertz_force(np.array([depth_mm]), R_MM, E_MPA)[0] * integral / ramp**1.5
        assert found[20:] == pytest.approx(exact[20:], rel=5e-3)
    assert contact_creep.meaning({"relaxation_exponent": 0.1}, campaign).startswith(
        "From each time to one ten times as long"
    )
    assert not contact_creep.meaning({"relaxation_exponent": 0.0}, campaign)


def test_power_law_and_pair_multiply() -> None:
    """After a step both forms together leave (1 − g (1 − e^(−t/τ))) t^(−n) of the force; at n = 0 the pair alone."""
    ages = np.geomspace(1e-2, 1e2, 9)
    time = np.concatenate([np.linspace(0, 1e-3, 200), 1e-3 + ages])
    depth = np.append(np.linspace(0, 0.3, 200), np.full(9, 0.3))
    recording = IndentationRecording("i", R_MM, depth, hertz_force(depth, R_MM, E_MPA), time_s=time)
    for n in (0.0, 0.12):
        values = {"relaxed_fraction": 0.4, "relaxation_time": 2.0, "relaxation_exponent": n}
        found = predicted(["contact_creep"], Campaign("one", SKIN, (recording,)), **{"contact_point i": 0.0}, **values)
        left = (1 - 0.4 * (1 - np.exp(-ages / 2.0))) * ages**-n
        assert found[-9:] == pytest.approx(recording.force_n[-1] * left, rel=1e-2)


def test_drag_adds_its_coefficient_times_the_speed() -> None:
    """On each way and in the air, with a step where the motion turns, whatever the noise of the displacement."""
    depth = np.concatenate([np.linspace(-0.2, 0.3, 60), np.linspace(0.3, -0.3, 90)[1:]])
    speed = np.where(np.arange(len(depth)) < 59.5, 0.5 / (59 * TIME), -0.6 / (89 * TIME))
    drag = force_at(["liquid_drag"], depth, drag_coefficient=0.7) - force_at([], depth)
    turn = np.isin(np.arange(len(depth)), (59, 60))
    assert drag[~turn] == pytest.approx(0.7 * speed[~turn], rel=1e-6)
    with pytest.raises(Unsupported, match="one way at one speed"):
        compose(["liquid_drag"], recorded(depth[:60]), table())


def test_the_radius_at_a_travel_has_that_travel_also_where_a_stiffening_law_ends() -> None:
    random = np.random.default_rng(8)
    count = 400

    def drawn(low: float, high: float) -> Floats:
        return np.exp(random.uniform(np.log(low), np.log(high), (count, 1, 1)))

    law = Stiffening(drawn(0.1, 20), random.uniform(-2, 2, (count, 1, 1)), random.uniform(1, 2, (count, 1, 1)))
    sphere = Sphere(drawn(1e5, 1e7), np.full((1, 1), 7.5e-6), stiffening=law, compliance=1 / drawn(1, 1e3))
    work = drawn(1e-3, 1.0)
    least, lowest = sphere.pull_off(work)
    travel = lowest + np.linspace(0.01, 1, 40) * (2e-6 - np.minimum(lowest, 0))
    found = sphere.travel(sphere.radius_at(travel, work, least), work)
    assert np.abs(found - travel).max() < 1e-6 * np.ptp(travel)


def test_a_sphere_that_does_not_stick_has_no_contact_before_the_surface_and_hertzs_beyond() -> None:
    sphere = Sphere(np.full((1, 1, 1), 2e6), np.full((1, 1), 1e-3), compliance=np.full((1, 1, 1), 1e-5))
    travel = np.array([[[-1e-4, -1e-9, 0.0, 1e-6, 2e-5, 3e-5, -1e-5, 1e-4]]])
    a = sphere.radius_at(travel, None)
    away = travel <= 0
    assert a[away].max() < 1e-12
    force, depth, _, _ = sphere.at(a)
    assert force[away].max() < 1e-24
    assert (depth + 1e-5 * force)[~away] == pytest.approx(travel[~away], rel=1e-9)
