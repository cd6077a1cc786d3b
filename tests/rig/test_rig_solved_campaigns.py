"""Campaigns of the solved rig against the rig's closed forms, against themselves, and what is told as their truth."""

from dataclasses import replace

import numpy as np
import pytest

from rig.contact import sphere_contact
from rig.layer import WAVENUMBERS, Layer, base_stress
from rig.layer_contacts import LayerContacts
from rig.solved.campaign import document, drawn, levels, measured
from rig.solved.charge import Skin, solve
from rig.solved.design import MODULUS_OFF, SENSOR_OFF, THICKNESS_OFF, Design, drawn_design
from rig.solved.layer import Material, Sublayer
from rig.solved.worlds import CREEP, EXACT, FINITE_SKIN, NEAREST, PLAIN, SHARES, World, drawn_world
from rig.solved_truth import truth_of_solved

COARSE = 1.0


def design_of(number: int, world: World) -> Design:
    return drawn_design(np.random.default_rng([8, number]), world)


@pytest.mark.slow
def test_disc() -> None:
    """At small strain a disc, centred or beside the axis, bears the exact share of the force, and a wide one
    less than the whole by the long tail of an incompressible layer."""
    course = solve(Skin((Sublayer(1.0, Material()),)), 40.0, 0.004, 0.01, COARSE)
    contact, force = sphere_contact(Layer()), np.array([0.008])
    a = contact.radius_of(force, np.full(1, 40.0), np.ones(1))
    spectrum = contact.shape(a, np.full(1, 40.0), np.ones(1), 0.0, WAVENUMBERS) * Layer().transmission(WAVENUMBERS)
    for sensor, offset in ((0.6, 0.0), (0.6, 1e-4), (0.6, 0.5), (0.6, 1.0), (4.0, 0.3)):
        exact = 1.5 * sensor**2 * base_stress(spectrum, sensor, np.array([offset]))[0]
        assert np.polyval(course.share(sensor, offset), np.cbrt(0.008)) == pytest.approx(exact, rel=4e-3)


@pytest.mark.slow
def test_plain_world() -> None:
    """The plain world is what closed forms of layered contact, its finite strain and a moving edge give, to 0.5 %."""
    drawn_one = design_of(3, World(PLAIN))
    rows = np.flatnonzero((drawn_one.sphere == drawn_one.sphere[0]) & (np.hypot(*drawn_one.offset.T) == 0))
    each = {name: getattr(drawn_one, name)[rows] for name in ("sensor", "sphere", "force", "offset")}
    still = replace(drawn_one, **each, dynamic=0.02 * each["force"], missed=0 * each["offset"], dwell_s=None)
    level, _ = levels(still, World(PLAIN), 1.5)
    true, charges = still.true, []
    for factor in (0.999, 1.001):
        force = factor * still.force
        pressed = LayerContacts(
            true.thickness, true.modulus, {"layered_contact": {}}, still.sphere, force, np.zeros(len(force))
        )
        charges.append(force * pressed.sigma(true.sensor_radius, np.zeros(len(force))))
    edge = (charges[1] - charges[0]) / (0.002 * still.force)
    assert level == pytest.approx(still.d33 * 1.5 * (true.sensor_radius / true.thickness) ** 2 * edge, rel=5e-3)


def test_designs() -> None:
    """Declared sizes are off by the tolerances; a lab has enough recordings, loads that a skin bears, and dwells."""
    off = []
    for number in range(200):
        world = drawn_world(np.random.default_rng(number), list(SHARES)[number % len(SHARES)])
        design = design_of(number, world)
        declared, true = design.declared, design.true
        off.append([np.log(getattr(true, name) / getattr(declared, name)) for name in vars(true)])
        assert 12 <= len(design.force) <= 84
        assert (design.dynamic <= design.force / 2).all()
        assert (world.effect == CREEP) <= (design.dwell_s is not None)
        assert not (world.effect == FINITE_SKIN and design.offset.any())
        assert (design.force <= 0.063 * design.sphere**2 * declared.modulus).all()
    assert np.std(off, axis=0) == pytest.approx([MODULUS_OFF, THICKNESS_OFF, SENSOR_OFF], rel=0.2)
    assert set(EXACT) == set(NEAREST) == set(SHARES)
    assert sum(SHARES.values()) == pytest.approx(1)


def test_creep_softens_from_the_modulus_at_once_to_its_relaxed_share() -> None:
    relaxed = World(CREEP, {"fraction": 0.4, "time_s": 10.0}).relaxed(np.array([0.0, 10.0, 1e4]))
    assert relaxed[0] == 1
    assert relaxed[1] < 0.8
    assert relaxed[2] == pytest.approx(0.6)


@pytest.mark.slow
def test_truth() -> None:
    """A campaign is the same whenever it is drawn; its truth fits it to its noise, which the base model does not."""
    campaign = drawn(5, 44, COARSE)  # creep, 42 recordings across a sensor
    content, truth = document(campaign), truth_of_solved(campaign, COARSE)
    assert content == document(drawn(5, 44, COARSE))
    assert len(content["recordings"]) == truth["recordings"] == 42
    assert truth["exact_name"] == "contact_creep"
    assert 20 < truth["chi2_of_truth"] < 70
    assert truth["chi2_gain_of_truth"] > truth["chi2_gain_over_plain_world"] > 20
    assert abs(truth["d33_error_of_truth"]) < 0.02
    real, _, variance = measured(campaign)
    scatter = (real - real.mean(axis=1, keepdims=True)) / np.sqrt(variance)
    assert np.mean(scatter**2) == pytest.approx(1, abs=0.1)
