"""A contact in time: JKR with any stage, pinning and hysteresis, Ting's way back, and the balance of forces."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from rig.contact_course import Body, contact_history
from rig.errors import RigError
from rig.layer import Floats
from rig.relaxation import Relaxation
from rig.sphere import sphere_law

pytestmark = pytest.mark.slow

R, E, DEPTH = 7.5e-3, 1.0, 1.5e-3  # mm, MPa, mm
W, W_S = 40e-6, 75e-6  # N/mm
PLANE = E / 0.75
LAW = sphere_law({}, R, 1.0, DEPTH)
STICKY = Body(LAW, E, approach=W, separation=W_S)
PULL_OFF = 1.5 * np.pi * W_S * R
RADII = np.geomspace(1e-5, 1e-2, 20000)


def there_and_back(body: Body, compliance: float, samples: int = 2000) -> tuple[Floats, Floats, Floats, Floats]:
    """Time, travel, depth and force, in 10 s with a hold at the peak."""
    peak = DEPTH + compliance * body.elastic(DEPTH)
    end = min(body.last_touch(compliance), 0.0) - 0.2 * peak
    time = np.linspace(0, 10, samples)
    travel = np.interp(time, [0, 4, 5, 10], [-0.2 * peak, peak, peak, end])
    return time, travel, *contact_history(body, time, travel, compliance)


def jkr(a: Floats, work: float) -> tuple[Floats, Floats]:
    return a**2 / R - np.sqrt(2 * np.pi * work * a / PLANE), 4 * PLANE * a**3 / (3 * R) - np.sqrt(
        8 * np.pi * work * PLANE * a**3
    )


@pytest.mark.parametrize("stage_n_per_mm", [3e-4, 3e-3, 3e-2, np.inf])
def test_branches_johnson_kendall_roberts_stage(
    stage_n_per_mm: float,
) -> None:
    """Both branches are those of johnson kendall and roberts and the stage is in balance."""
    compliance = 1 / stage_n_per_mm
    time, travel, depth, force = there_and_back(STICKY, compliance)
    assert travel == pytest.approx(depth + compliance * force, abs=1e-12)
    assert force.min() == pytest.approx(-PULL_OFF, rel=5e-3)
    for branch, work in ((time < 4, W), (time > 5, W_S)):
        touching = branch & (force != 0)
        depths, forces = jkr(RADII, work)
        stable = np.arange(len(RADII)) >= np.argmin(depths)
        along = np.interp(depth[touching], depths[stable], forces[stable])
        if work == W_S:  # the contact rests at first: nearly the flat punch, and never below the branch
            assert (force[touching] >= along - 1e-3 * PULL_OFF).all()
            late = np.flatnonzero(touching)[len(np.flatnonzero(touching)) // 2 :]
            assert force[late] == pytest.approx(np.interp(depth[late], depths[stable], forces[stable]), abs=2e-9)
        else:
            assert force[touching] == pytest.approx(along, abs=1e-3 * PULL_OFF)


def last_force(stage_n_per_mm: float) -> float:
    """The force of the last sample in contact over π w_s R."""
    *_, force = there_and_back(STICKY, 1 / stage_n_per_mm, 6000)
    return float(force[np.flatnonzero(force)[-1]] / (np.pi * W_S * R))


def test_pull_off_lies_between_the_limits_of_a_soft_and_a_stiff_stage() -> None:
    """−3/2 π w R under force control, −5/6 π w R under displacement control."""
    limits = [last_force(stage) for stage in (1e-4, 3e-3, np.inf)]
    assert limits[0] == pytest.approx(-1.5, abs=2e-3)
    assert limits[-1] == pytest.approx(-5 / 6, abs=6e-2)  # the force rises steeply there
    assert (np.diff(limits) > 0).all()
    assert -1.5 < limits[1] < -5 / 6


@pytest.mark.parametrize(("stage_n_per_mm", "low", "high"), [(3e3, -1.34, -1.32), (3e-4, -0.2, -0.05)])
def test_snap_in_happens_as_the_surfaces_meet(stage_n_per_mm: float, low: float, high: float) -> None:
    """To −(4/3) π w R under a stiff stage; a soft one springs in."""
    _, travel, depth, force = there_and_back(STICKY, 1 / stage_n_per_mm, 6000)
    first = int(np.flatnonzero(force)[0])
    assert travel[first - 1] <= 0 < travel[first]
    assert low < force[first] / (np.pi * W * R) < high
    assert depth[first] > travel[first]


def test_an_edge_at_rest_is_a_flat_punch() -> None:
    time, _, depth, force = there_and_back(STICKY, 0.0)
    turn = int(np.argmax(time > 5))
    a = float(np.interp(DEPTH, jkr(RADII, W)[0][RADII > 1e-3], RADII[RADII > 1e-3]))
    slope = (force[turn + 20] - force[turn]) / (depth[turn + 20] - depth[turn])
    assert slope == pytest.approx(2 * PLANE * a, rel=1e-4)


def test_the_cycle_dissipates_the_hysteresis() -> None:
    """Work over the cycle: (w_s − w) over the largest contact, and what snap-in and tear release at constant depth."""
    _, travel, _, force = there_and_back(STICKY, 0.0, 8000)
    work = float(np.sum((force[1:] + force[:-1]) / 2 * np.diff(travel)))

    def released(branch: float, depth: float) -> float:
        """w over the area of the contact less its elastic energy."""
        depths, _ = jkr(RADII, branch)
        stable = np.arange(len(RADII)) >= np.argmin(depths)
        a = float(np.interp(depth, depths[stable], RADII[stable]))
        sunk = a**2 / R - depth
        elastic = PLANE * (8 * a**5 / (15 * R**2) - 4 * a**3 * sunk / (3 * R) + a * sunk**2)
        return branch * np.pi * a**2 - elastic

    snap, tear = released(W, 0.0), -released(W_S, float(jkr(RADII, W_S)[0].min()))
    widest = float(np.interp(DEPTH, jkr(RADII, W)[0][RADII > 1e-3], RADII[RADII > 1e-3]))
    assert min(snap, tear) > 0
    assert work == pytest.approx((W_S - W) * np.pi * widest**2 + snap + tear, rel=5e-3)


@pytest.mark.parametrize("law", ["linear", "limited"])
def test_what_sticks_stiffens_as_far_as_its_contact_is_wide(law: str) -> None:
    """Stiffening goes on beyond the strain that a contact without adhesion would reach at the largest depth."""
    values: dict[str, float | str] = {"law": law, "coefficient": 4.0}
    stiff = sphere_law({"strain_stiffening": values}, R, 1.0, DEPTH)
    work = W
    time, _, depth, force = there_and_back(Body(stiff, E, approach=work, separation=work), 0.0)
    strain = 0.2 * RADII / R
    ratio = 1 + 4 * strain if law == "linear" else 1 / (1 - 4 * strain)
    kept = ratio > 0
    a, modulus_there = RADII[kept], PLANE * ratio[kept]
    depths = a**2 / R - np.sqrt(2 * np.pi * work * a / modulus_there)
    forces = 4 * modulus_there * a**3 / (3 * R) - np.sqrt(8 * np.pi * work * modulus_there * a**3)
    stable = np.arange(len(a)) >= np.argmin(depths)
    growing = (time < 4) & (force != 0)
    assert float(np.interp(DEPTH, depths[stable], a[stable])) > 1.05 * np.sqrt(R * DEPTH)
    expected = np.interp(depth[growing], depths[stable], forces[stable])
    assert force[growing] == pytest.approx(expected, abs=2e-3 * force.max())


def test_a_contact_that_sticks_up_to_where_its_law_locks_is_refused() -> None:
    coefficient = 0.88 / (0.2 * np.sqrt(DEPTH / R))
    stiff = sphere_law({"strain_stiffening": {"law": "limited", "coefficient": coefficient}}, R, 1.0, DEPTH)
    with pytest.raises(RigError, match="wider"):
        there_and_back(Body(stiff, E, approach=W, separation=W), 0.0)


def test_without_adhesion_the_contact_is_hertzian_and_with_little_nearly_so() -> None:
    _, _, depth, force = there_and_back(replace(STICKY, approach=0.0, separation=0.0), 0.0)
    hertz = 4 / 3 * PLANE * np.sqrt(R) * np.maximum(depth, 0) ** 1.5
    assert force == pytest.approx(hertz, abs=1e-5 * hertz.max())
    _, _, depth, force = there_and_back(replace(STICKY, approach=1e-12, separation=2e-12), 0.0)
    assert force == pytest.approx(4 / 3 * PLANE * np.sqrt(R) * np.maximum(depth, 0) ** 1.5, abs=1e-3 * hertz.max())


FRACTIONS, TIMES = (0.3, 0.2), (0.7, 4.0)


def modulus(elapsed: float) -> float:
    return 1 - sum(g * (1 - np.exp(-elapsed / tau)) for g, tau in zip(FRACTIONS, TIMES, strict=True))


def test_two_prony_pairs_follow_lee_and_radok_and_ting() -> None:
    """Independent integrals: in until 4 s, hold until 5 s, back until 9 s; t1 from ∫ E(t − s) dδ = 0."""
    time = np.linspace(0, 9, 4001)
    travel = np.interp(time, [0, 4, 5, 9], [0, DEPTH, DEPTH, 0])
    _, force = contact_history(Body(LAW, E, Relaxation(FRACTIONS, TIMES)), time, travel, 0.0)
    unit, rate = 4 / 3 * PLANE * np.sqrt(R), DEPTH / 4

    def until(end: float, at: float) -> float:
        return float(quad(lambda s: modulus(at - s) * 1.5 * rate**1.5 * np.sqrt(s), 0, end)[0]) * unit

    for at in (1.0, 2.5, 3.9):
        assert np.interp(at, time, force) == pytest.approx(until(at, at), rel=1e-3)
    assert np.interp(4.7, time, force) == pytest.approx(until(4.0, 4.7), rel=1e-3)

    def surplus(t1: float, at: float) -> float:
        return float(quad(lambda s: modulus(at - s), t1, 4)[0] - quad(lambda s: modulus(at - s), 5, at)[0])

    for at in (5.5, 6.3, 7.0):
        t1 = brentq(surplus, 0, 4, args=(at,))
        assert np.interp(at, time, force) == pytest.approx(until(t1, at), rel=1e-3, abs=1e-4 * force.max())
    assert surplus(0.0, 8.5) < 0
    assert np.interp(8.5, time, force) == 0  # the surface has not recovered yet


def test_in_a_hold_under_a_soft_stage_the_sphere_creeps_in() -> None:
    body = Body(LAW, E, Relaxation(FRACTIONS, TIMES))
    time, travel, depth, force = there_and_back(body, 100.0)
    held = (time > 4.02) & (time < 4.98)
    assert np.ptp(travel[held]) == 0
    assert (np.diff(depth[held]) > 0).all()
    assert (np.diff(force[held]) < 0).all()


def test_adhesion_and_creep_together_have_their_limits() -> None:
    """Creep that is over at once is an elastic body of the relaxed modulus whose edge sees the unrelaxed one."""
    slow = replace(STICKY, relaxation=Relaxation((0.3,), (1e7,)))
    elastic, unrelaxed = (there_and_back(body, 1 / 3e-3)[3] for body in (STICKY, slow))
    assert unrelaxed == pytest.approx(elastic, abs=1e-5 * elastic.max())
    creeping = there_and_back(replace(STICKY, relaxation=Relaxation((0.3,), (1.0,))), 1 / 3e-3)[3]
    assert creeping.max() < 0.95 * elastic.max()
    assert creeping.min() < 0
