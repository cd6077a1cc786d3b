"""Mechanisms of the contact: its edge, layer, adhesion, time and strain, against exact limits, published relations."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline
from scipy.optimize import brentq

from tablegen.linear_layer import transmission
from tests.mechanisms.mechanism_contacts import (
    LINEAR_MM,
    RHO,
    E,
    H,
    contacts_within_the_table,
    level,
    linear_contact,
)
from tests.support.mechanism_campaigns import SKIN, campaign, frf_recording, predicted, table
from tests.support.oracle import layer_rows
from tests.support.sphere_contact import SphereOnLayer
from underskin.mechanisms import compose
from underskin.physics import hertz
from underskin.physics.elastic_layer import Layer
from underskin.physics.hankel_transform import hertz_transform, normal_stress, punch_transform
from underskin.surrogate.hdf5_format import load_contact


def test_a_moving_edge_feels_the_flat_punch() -> None:
    rows = layer_rows("sigma_edge", poisson_ratio="0.5", glue_stiffness_h_over_2g="inf", rt_over_h="0.6")
    assert rows
    for row in rows:
        a, offset = float(row["a_over_h"]), float(row["offset_over_h"])
        if a <= 2:
            found = level(["moving_contact_edge"], linear_contact(a, offset_over_h=offset), mobile_fraction=1.0)
            assert found.real == pytest.approx(float(row["value"]), abs=2e-5)


def test_a_moving_edge_has_the_published_ratios() -> None:
    for a, ratio in ((0.1, 0.996), (0.3, 0.964), (0.6, 0.862), (1.0, 0.674), (1.5, 0.485), (2.0, 0.402)):
        recording = linear_contact(a)
        moving = level(["moving_contact_edge"], recording, mobile_fraction=1.0)
        assert (moving / level([], recording)).real == pytest.approx(ratio, abs=6e-4)


def test_a_contact_wider_than_the_table_is_continued_as_wide_contacts_transmit() -> None:
    """The pressure under a contact that is wide beside the thickness falls as 1/a²."""
    for a, allowed in ((3.0, 1e-4), (3.2, 2e-3), (3.6, 1e-2), (4.2, 3e-2)):
        exact = normal_stress(transmission, hertz_transform, a, RHO)
        assert level([], linear_contact(a)).real == pytest.approx(float(exact), rel=allowed)


def test_a_contact_wider_than_the_table_has_the_derivative_of_its_continuation() -> None:
    model = compose(["modulus_error"], campaign([linear_contact(3.5)]), table())
    fit = np.array([entry.start for entry in model.parameters])
    step = np.zeros_like(fit)
    step[[entry.name for entry in model.parameters].index("modulus_factor")] = 1e-5
    there = model.predict(fit)
    beside = model.predict(fit + step).value - model.predict(fit - step).value
    assert not there.inside.any()
    assert there.slopes[step > 0][0] == pytest.approx(beside / 2e-5, rel=1e-6)


def test_half_a_moving_edge_is_half_way() -> None:
    still, half, moving = (
        level(["moving_contact_edge"], frf_recording(), mobile_fraction=m).real for m in (0.0, 0.5, 1.0)
    )
    assert half == pytest.approx((still + moving) / 2, rel=1e-12)


def test_a_layered_contact_has_the_layers_radius_and_pressure() -> None:
    for row in contacts_within_the_table():
        a = row["a_over_h"]
        on_half_space = linear_contact(a)
        pressed = replace(on_half_space, preload_n=on_half_space.preload_n * row["force_over_hertz"])
        contact = SphereOnLayer(LINEAR_MM * 1e-3, E, H, Layer()).at_radius(a * H)
        assert contact.force == pytest.approx(pressed.preload_n, rel=2e-6)
        exact = normal_stress(transmission, contact.pressure_transform, a, RHO) / contact.force
        assert level(["layered_contact"], pressed).real == pytest.approx(float(exact), rel=1e-5)


def test_on_a_thick_layer_the_contact_is_hertz() -> None:
    """Where strain is small: of large ones the half space has a dead pressure's, the layer a sphere's."""
    skin = replace(SKIN, thickness_mm=60.0, sensor_radius_mm=30.0)
    recording = frf_recording(indenter_radius_mm=10.0, preload_n=1e-4, dynamic_force_n=1e-5)
    assert level(["layered_contact"], recording, skin).real == pytest.approx(level([], recording, skin).real, rel=1e-5)


def test_adhesion_is_jkr_on_the_half_space() -> None:
    w, radius = 0.5, 1e3
    force = 1e-2 * np.pi * w * radius
    a = np.cbrt(
        0.75
        * radius
        * 0.75
        / E
        * (force + 3 * np.pi * w * radius + np.sqrt(6 * np.pi * w * radius * force + (3 * np.pi * w * radius) ** 2))
    )
    sphere = 4 / 3 * E / 0.75 * a**3 / radius
    share = sphere / force
    h = 2 * a
    skin = replace(SKIN, thickness_mm=h * 1e3, sensor_radius_mm=RHO * h * 1e3)
    expected = share * normal_stress(transmission, hertz_transform, 0.5, RHO) + (1 - share) * normal_stress(
        transmission, punch_transform, 0.5, RHO
    )
    recording = frf_recording(indenter_radius_mm=radius * 1e3, preload_n=force, dynamic_force_n=force / 10)
    strain = table().sigma(0.5, RHO, force / (radius**2 * E)).sigma - table().sigma(0.5, RHO, 0.0).sigma
    found = level(["adhesion"], recording, skin, work_of_adhesion=w)
    assert found.real == pytest.approx(float(expected + strain), rel=1e-5)


def test_adhesion_and_layer_together_are_jkr_on_the_layer() -> None:
    w, recording = 0.3, frf_recording(preload_n=0.2)
    contact = SphereOnLayer(4e-3, E, H, Layer(), work_of_adhesion=w).at_force(0.2)
    a = contact.contact_radius / H
    load = hertz.load_parameter(0.2, 4e-3, E)
    exact = normal_stress(transmission, lambda s: contact.pressure_transform(s) / contact.force, a, RHO)
    found = level(["layered_contact", "adhesion"], recording, work_of_adhesion=w)
    assert found.real == pytest.approx(float(exact + strain_in_contact(a, float(load))), rel=1e-5)


def strain_in_contact(a_over_h: float, load_parameter: float) -> float:
    """What the contact table adds to σ of the linear layer."""
    solved = load_contact()
    x, weight = np.polynomial.legendre.leggauss(24)
    t = (1 + x) / 2
    mean = (solved.profile_over(RHO * t) * (weight * t)).sum(axis=-1)
    at = np.array([a_over_h]), np.array([np.cbrt(load_parameter)])
    return float(RectBivariateSpline(*solved.contact_axes, mean)(*at)[0, 0])


def test_a_sphere_takes_back_most_of_what_a_dead_pressure_adds() -> None:
    """PHYSICS.md, section 6: at L 0.09, R/h 1 a sphere's finite strain adds 2.3 % to σ, a dead pressure's 7.9 %."""
    skin = replace(SKIN, thickness_mm=4.0, sensor_radius_mm=RHO * 4.0)
    force = 0.09 * 4.0**2 * E * 1e-6
    strained = frf_recording(preload_n=force, indenter_radius_mm=4.0)
    contact = SphereOnLayer(4e-3, E, 4e-3, Layer()).at_force(force)
    a = contact.contact_radius / 4e-3
    linear = normal_stress(transmission, lambda s: contact.pressure_transform(s) / contact.force, a, RHO)
    assert level(["layered_contact"], strained, skin).real / linear == pytest.approx(1.023, abs=0.001)


@pytest.mark.parametrize("fraction", [0.2, 0.7])
def test_a_held_contact_creeps_as_a_solid_whose_modulus_relaxes_so(fraction: float) -> None:
    """a³ by the hereditary integral of a constant force, ∫ E(t − s) d(a³)(s) = const, in steps of time."""
    time = 30.0
    steps = np.linspace(0.0, 90.0, 3001)
    relaxed = 1 - fraction * (1 - np.exp(-steps / time))
    held = (relaxed[1:] + relaxed[:-1]) / 2  # of a step that grows evenly from one time to the next
    grown = np.zeros(len(steps) - 1)
    for number in range(len(grown)):
        before = relaxed[number + 1] + grown[:number] @ held[number:0:-1]
        grown[number] = (1 - before) / held[0]
    cube = 1 + np.concatenate([[0.0], np.cumsum(grown)])
    for place in (0, 1000, 3000):
        recordings = [frf_recording(dwell_s=float(steps[place])), frf_recording(id="other", dwell_s=7.0)]
        crept = predicted(["contact_creep"], campaign(recordings), relaxed_fraction=fraction, relaxation_time=time)
        softer = predicted(["modulus_error"], campaign(recordings), modulus_factor=1 / float(cube[place]))
        assert crept[0] == pytest.approx(softer[0], rel=1e-5)


def test_a_fast_oscillation_meets_the_unrelaxed_modulus_on_the_contact_that_crept() -> None:
    recordings = [frf_recording(dwell_s=1e6), frf_recording(id="other", dwell_s=0.0)]
    names = ["contact_creep", "contact_resonance"]
    crept = predicted(names, campaign(recordings), relaxed_fraction=0.4, relaxation_time=30.0, tip_mass=20.0)
    softer = replace(SKIN, youngs_modulus_mpa=0.6 * 2.0)
    grown = predicted(["contact_resonance"], campaign(recordings[:1], softer), tip_mass=0.6 * 20.0)
    assert crept[: len(grown)] == pytest.approx(grown, rel=1e-9)


def test_a_stiffening_contact_solves_its_own_strain() -> None:
    def misfit(factor: float) -> float:
        a = float(hertz.contact_radius(2.0, 4e-3, E * factor))
        return 1 + 5.0 * 0.2 * a / 4e-3 - factor

    recording = frf_recording(preload_n=2.0)
    stiffened = level(["strain_stiffening"], recording, stiffening=5.0)
    expected = level(["modulus_error"], recording, modulus_factor=float(brentq(misfit, 1.0, 3.0)))
    assert stiffened == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("dynamic", "error"), [(0.05, 1e-6), (0.33, 2e-5), (0.39, 1e-4), (0.8, 1e-5), (1.5, 0.01)])
def test_a_moving_edge_gives_the_first_harmonic_of_the_charge(dynamic: float, error: float) -> None:
    """Beyond the preload the sphere leaves the skin for a part of the cycle."""
    preload, phase = 1.0, (np.arange(512) + 0.5) * 2 * np.pi / 512
    force = np.maximum(preload + dynamic * np.sin(phase), 1e-9)
    a, load = hertz.contact_radius(force, 4e-3, E), hertz.load_parameter(force, 4e-3, E)
    charge = force * table().sigma(a / H, RHO, load).sigma
    first_harmonic = 2 * np.mean(charge * np.sin(phase)) / dynamic
    recording = frf_recording(preload_n=preload, dynamic_force_n=dynamic)
    moving = level(["moving_contact_edge"], recording, mobile_fraction=1.0)
    assert moving.real == pytest.approx(first_harmonic, rel=error)


def test_without_a_dynamic_force_a_moving_edge_gives_the_limit_of_a_small_one() -> None:
    """The derivative of the charge, and the flat punch's σ where finite strain adds nothing."""
    recording = replace(frf_recording(), dynamic_force_n=0.0)
    step = 1e-4
    charges = [f * level([], frf_recording(preload_n=f)).real for f in (1.0 - step, 1.0 + step)]
    limit = level(["moving_contact_edge"], recording, mobile_fraction=1.0).real
    assert limit == pytest.approx((charges[1] - charges[0]) / (2 * step), rel=1e-5)
