"""Each mechanism of the FRF against exact limits, published relations and independent values."""

import csv
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.mechanism_campaigns import SKIN, campaign, fit_of, frf_recording, predicted, table
from tests.oracle import NEEDS_ORACLE
from underskin import hertz, response
from underskin.contact import SphereOnLayer
from underskin.hankel import hertz_transform, normal_stress, punch_transform
from underskin.layer import Layer
from underskin.linear_layer import transmission
from underskin.mechanisms import compose
from underskin.offset import positioned_sigma
from underskin.recordings.campaign import FrfRecording, SkinDescription

H, RT, E = 2.5e-3, 1.5e-3, 2e6
RHO = 0.6
LINEAR_MM = 1e12  # a sphere so large that L, and with it finite strain, vanishes at any a/h


def level(names: list[str], recording: FrfRecording, skin: SkinDescription = SKIN, **values: float) -> complex:
    """The first line of a recording for d33 = 1 C/N, in units of (3/2) ρ²: the σ that is felt."""
    assert skin.sensor_radius_mm is not None
    assert skin.thickness_mm is not None
    first = predicted(names, campaign([recording], skin), d33=1e12, **values)[0]
    return complex(first / (1.5 * (skin.sensor_radius_mm / skin.thickness_mm) ** 2))


def linear_contact(a_over_h: float, poisson_ratio: float = 0.5, offset_over_h: float = 0.0) -> FrfRecording:
    """A contact of this Hertz radius at vanishing L; the preload follows from a³ = 3FR(1 − ν²)/(4E)."""
    a = a_over_h * H
    preload = a**3 * 4 * E / (3 * LINEAR_MM * 1e-3 * (1 - poisson_ratio**2))
    return frf_recording(
        indenter_radius_mm=LINEAR_MM,
        preload_n=preload,
        dynamic_force_n=preload / 1e3,
        position_mm=(offset_over_h * H * 1e3, 0.0),
    )


def oracle_rows(quantity: str, **fixed: str) -> list[dict[str, str]]:
    """Rows of the linear layer's independent values."""
    with (Path(os.environ["UNDERSKIN_ORACLE"]) / "linear_layer.csv").open(newline="") as file:
        return [
            row
            for row in csv.DictReader(file)
            if row["quantity"] == quantity and all(row[name] == value for name, value in fixed.items())
        ]


def sphere_on_layer() -> list[dict[str, float]]:
    """The independent contact values with a/h up to 2."""
    with (Path(os.environ["UNDERSKIN_ORACLE"]) / "sphere_on_layer.csv").open(newline="") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    return [row for row in rows if row["a_over_h"] <= 2]


def test_the_base_model_is_the_table_at_hertz_radius() -> None:
    for preload, radius in ((0.5, 4.0), (2.0, 10.0)):
        a = hertz.contact_radius(preload, radius * 1e-3, E)
        load = hertz.load_parameter(preload, radius * 1e-3, E)
        expected = response.frf(14e-12, table().sigma(a / H, RHO, load).sigma, RHO)
        found = predicted([], campaign([frf_recording(preload_n=preload, indenter_radius_mm=radius)]), d33=14.0)
        assert found == pytest.approx(np.full(len(found), complex(expected)), rel=1e-5)


def test_the_base_model_beside_the_sensor_is_the_profile_averaged_over_its_disc() -> None:
    a, load = hertz.contact_radius(1.0, 4e-3, E), hertz.load_parameter(1.0, 4e-3, E)
    for offset_mm in (0.7, 2.0, 4.5):
        e = np.array([offset_mm * 1e-3 / H])
        expected = positioned_sigma(table(), np.array([a / H]), RHO, np.array([load]), e, 0.01).sigma[0]
        found = level([], frf_recording(position_mm=(0.0, offset_mm)))
        assert found.real == pytest.approx(expected, abs=1e-5)


@NEEDS_ORACLE
def test_a_moving_edge_feels_the_flat_punch() -> None:
    rows = oracle_rows("sigma_edge", poisson_ratio="0.5", glue_stiffness_h_over_2g="inf", rt_over_h="0.6")
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


def test_half_a_moving_edge_is_half_way() -> None:
    still, half, moving = (
        level(["moving_contact_edge"], frf_recording(), mobile_fraction=m).real for m in (0.0, 0.5, 1.0)
    )
    assert half == pytest.approx((still + moving) / 2, rel=1e-12)


@NEEDS_ORACLE
@pytest.mark.parametrize("poisson_ratio", ["0.48", "0.45", "0.4", "0.3"])
def test_a_compressible_layer_transmits_as_the_exact_one(poisson_ratio: str) -> None:
    rows = oracle_rows("sigma_hertz", poisson_ratio=poisson_ratio, glue_stiffness_h_over_2g="inf", rt_over_h="0.6")
    assert rows
    for row in rows:
        a, nu = float(row["a_over_h"]), float(poisson_ratio)
        if a <= 2:
            recording = linear_contact(a, nu, float(row["offset_over_h"]))
            found = level(["compressible_layer"], recording, poisson_ratio=nu)
            assert found.real == pytest.approx(float(row["value"]), abs=2e-5)


@NEEDS_ORACLE
@pytest.mark.parametrize("glue", ["10.0", "1.0"])
def test_a_yielding_glue_line_transmits_as_the_exact_one(glue: str) -> None:
    rows = oracle_rows("sigma_hertz", poisson_ratio="0.5", glue_stiffness_h_over_2g=glue, rt_over_h="0.6")
    assert rows
    for row in rows:
        a = float(row["a_over_h"])
        if a <= 2:
            recording = linear_contact(a, offset_over_h=float(row["offset_over_h"]))
            found = level(["interface_slip"], recording, glue_stiffness=2 * float(glue))
            assert found.real == pytest.approx(float(row["value"]), abs=2e-5)


def test_finite_strain_stays_when_the_layer_changes() -> None:
    recording = frf_recording(preload_n=2.0)
    a, load = hertz.contact_radius(2.0, 4e-3, E), hertz.load_parameter(2.0, 4e-3, E)
    extra = table().sigma(a / H, RHO, load).sigma - table().sigma(a / H, RHO, 0.0).sigma
    glued = normal_stress(lambda k: Layer(0.5, 0.5).transmission(k).value, hertz_transform, a / H, RHO)
    found = level(["interface_slip"], recording, glue_stiffness=1.0)
    assert found.real == pytest.approx(float(glued + extra), rel=1e-5)


@NEEDS_ORACLE
def test_a_layered_contact_has_the_layer_s_radius_and_pressure() -> None:
    for row in sphere_on_layer():
        a = row["a_over_h"]
        on_half_space = linear_contact(a)
        pressed = replace(on_half_space, preload_n=on_half_space.preload_n * row["force_over_hertz"])
        contact = SphereOnLayer(LINEAR_MM * 1e-3, E, H, Layer()).at_radius(a * H)
        assert contact.force == pytest.approx(pressed.preload_n, rel=2e-6)
        exact = normal_stress(transmission, contact.pressure_transform, a, RHO) / contact.force
        assert level(["layered_contact"], pressed).real == pytest.approx(float(exact), rel=1e-5)


def test_on_a_thick_layer_the_contact_is_hertz() -> None:
    skin = replace(SKIN, thickness_mm=60.0, sensor_radius_mm=30.0)
    recording = frf_recording(indenter_radius_mm=10.0)
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
    strain = table().sigma(a, RHO, load).sigma - table().sigma(a, RHO, 0.0).sigma
    found = level(["layered_contact", "adhesion"], recording, work_of_adhesion=w)
    assert found.real == pytest.approx(float(exact + strain), rel=1e-5)


def test_creep_is_the_relaxed_modulus() -> None:
    for dwell in (0.0, 30.0, 1e5):
        recordings = [frf_recording(dwell_s=dwell), frf_recording(id="other", dwell_s=7.0)]
        factor = 1 - 0.4 * (1 - np.exp(-dwell / 30.0))
        crept = predicted(["contact_creep"], campaign(recordings), relaxed_fraction=0.4, relaxation_time=30.0)
        softer = predicted(["modulus_error"], campaign(recordings), modulus_factor=factor)
        assert crept[0] == pytest.approx(softer[0], rel=1e-12)


def test_a_stiffening_contact_solves_its_own_strain() -> None:
    def misfit(factor: float) -> float:
        a = float(hertz.contact_radius(2.0, 4e-3, E * factor))
        return 1 + 5.0 * 0.2 * a / 4e-3 - factor

    recording = frf_recording(preload_n=2.0)
    stiffened = level(["strain_stiffening"], recording, stiffening=5.0)
    expected = level(["modulus_error"], recording, modulus_factor=float(brentq(misfit, 1.0, 3.0)))
    assert stiffened == pytest.approx(expected, rel=1e-12)


def test_a_wrong_modulus_or_thickness_is_the_declared_one_changed() -> None:
    recording = frf_recording(position_mm=(1.0, 0.5))
    softer = level([], recording, replace(SKIN, youngs_modulus_mpa=1.4))
    assert level(["modulus_error"], recording, modulus_factor=0.7) == pytest.approx(softer, rel=1e-6)
    thinner = level([], recording, replace(SKIN, thickness_mm=2.0))
    found = level(["thickness_error"], recording, thickness_factor=0.8) * 0.8**2
    assert found == pytest.approx(thinner, rel=2e-5)


def test_misalignment_is_a_moved_position() -> None:
    moved = level([], frf_recording(position_mm=(1.3, -0.2)))
    found = level(["misalignment"], frf_recording(position_mm=(0.8, 0.1)), offset_x=0.5, offset_y=-0.3)
    assert found == pytest.approx(moved, rel=1e-6)


def test_where_every_press_is_centred_misalignment_has_a_length_only() -> None:
    moved = level([], frf_recording(position_mm=(0.0, 0.9)))
    assert level(["misalignment"], frf_recording(), offset=0.9) == pytest.approx(moved, rel=1e-6)


def test_neighbours_tell_in_which_direction_a_centred_press_is_misaligned() -> None:
    names = ["misalignment", "crosstalk"]
    for sensor, (x, y) in {"s1": (0.0, 0.0), "s2": (4.0, 0.0)}.items():
        moved = level(["crosstalk"], frf_recording(sensor=sensor, position_mm=(x - 0.4, y + 0.7)), fraction=0.2)
        centred = frf_recording(sensor=sensor, position_mm=(x, y))
        assert level(names, centred, offset_x=-0.4, offset_y=0.7, fraction=0.2) == pytest.approx(moved, rel=1e-6)
        other = level(names, centred, offset_x=0.4, offset_y=0.7, fraction=0.2)
        assert abs(other / moved - 1) > 0.005


def test_a_small_amplitude_is_a_moving_edge() -> None:
    recording = frf_recording(dynamic_force_n=0.01)
    small = level(["amplitude_nonlinearity"], recording, edge_mobility=0.8)
    assert small == pytest.approx(level(["moving_contact_edge"], recording, mobile_fraction=0.8), rel=1e-5)


def test_a_large_amplitude_is_the_first_harmonic_of_the_charge() -> None:
    preload, dynamic, phase = 1.0, 0.8, (np.arange(512) + 0.5) * 2 * np.pi / 512
    force = preload + dynamic * np.sin(phase)
    a, load = hertz.contact_radius(force, 4e-3, E), hertz.load_parameter(force, 4e-3, E)
    charge = force * table().sigma(a / H, RHO, load).sigma
    first_harmonic = 2 * np.mean(charge * np.sin(phase)) / dynamic
    recording = frf_recording(preload_n=preload, dynamic_force_n=dynamic)
    assert level(["amplitude_nonlinearity"], recording, edge_mobility=1.0).real == pytest.approx(
        first_harmonic, rel=1e-5
    )


def test_d33_changes_with_the_stress_on_the_sensor_and_saturates() -> None:
    recording = frf_recording(preload_n=2.0)
    base = level([], recording)
    stress_mpa = 1e-6 * response.mean_stress(2.0, base.real, H)
    linear = level(["preload_dependent_d33"], recording, stress_coefficient=2.0, saturation_stress=1e12)
    assert (linear / base).real == pytest.approx(1 + 2.0 * stress_mpa, rel=1e-9)
    saturated = level(["preload_dependent_d33"], recording, stress_coefficient=2.0, saturation_stress=1e-6)
    assert (saturated / base).real == pytest.approx(1 + 2e-6, rel=1e-6)


@pytest.mark.parametrize("cycles", [0, 10, 1000, 100000])
def test_ageing_holds_both_laws(cycles: int) -> None:
    recordings = [frf_recording(load_cycles=cycles), frf_recording(id="other", load_cycles=7)]
    base = predicted([], campaign(recordings))[0]
    aged = predicted(["ageing"], campaign(recordings), loss=0.1, onset=100.0, saturation=0.0)[0]
    assert (aged / base).real == pytest.approx(1 - 0.1 * np.log10(1 + cycles / 100))
    aged = predicted(["ageing"], campaign(recordings), loss=0.2, onset=500.0, saturation=0.9999)[0]
    assert (aged / base).real == pytest.approx(1 - 0.2 * (1 - np.exp(-cycles / 500)), rel=1e-3)


def test_an_aged_response_dies_out_and_never_changes_its_sign() -> None:
    recordings = [frf_recording(id=f"r{n}", load_cycles=10**n) for n in range(10)]
    base = predicted([], campaign(recordings))
    for saturation in (0.0, 0.5, 0.95):
        for onset in (1.0, 1000.0, 1e6):
            aged = predicted(["ageing"], campaign(recordings), loss=0.95, onset=onset, saturation=saturation)
            left = (aged / base).real.reshape(len(recordings), -1)[:, 0]
            assert (left > 0).all()
            assert (np.diff(left) < 1e-12).all()


def test_crosstalk_adds_what_the_neighbours_feel() -> None:
    place = (2.0, 1.0)  # between s1, s2 and s3; s2 and s3 are further apart than 1.2 pitches
    own, right, above = (level([], frf_recording(sensor=name, position_mm=place)) for name in ("s1", "s2", "s3"))
    for sensor, expected in (("s1", own + 0.2 * (right + above)), ("s2", right + 0.2 * own)):
        found = level(["crosstalk"], frf_recording(sensor=sensor, position_mm=place), fraction=0.2)
        assert found == pytest.approx(expected, rel=1e-6)


@NEEDS_ORACLE
def test_the_tip_resonates_on_the_layer_s_contact() -> None:
    for row in sphere_on_layer():
        recording = linear_contact(row["a_over_h"])
        stiffness = 2 * E / 0.75 * row["a_over_h"] * H * row["stiffness_over_hertz"]
        frequency = np.sqrt(stiffness / 5e-3) / (2 * np.pi)
        at_resonance = replace(recording, frequency_hz=np.full(13, frequency))
        felt = level(["contact_resonance"], at_resonance, tip_mass=5.0, damping_ratio=0.05)
        assert felt / level([], recording) == pytest.approx(1 / (2j * 0.05), rel=1e-4)


def test_below_resonance_the_tip_adds_force_and_above_it_takes_it() -> None:
    names = ["contact_resonance"]
    ratio = predicted(names, campaign([frf_recording()]), tip_mass=20.0) / predicted([], campaign([frf_recording()]))
    assert abs(ratio[0]) == pytest.approx(1.0, abs=1e-3)
    assert abs(ratio[-1]) < 0.5
    assert (np.angle(ratio) < 0).all()  # the charge lags, in the convention e^(+iωt)


def test_a_relaxing_sensor_falls_and_lags_as_a_power_law_or_a_step() -> None:
    recorded = campaign([frf_recording()])
    frequency = frf_recording().frequency_hz
    assert frequency is not None
    base = predicted([], recorded)
    power = predicted(["sensor_relaxation"], recorded, exponent=0.1, step=0.0) / base
    assert np.abs(power) == pytest.approx((frequency / 30) ** -0.1)
    assert np.angle(power) == pytest.approx(np.full(len(power), -0.05 * np.pi))
    step = predicted(["sensor_relaxation"], recorded, exponent=0.0, step=0.5, step_frequency=30.0) / base
    assert step[3] == pytest.approx(1 + 0.5 / (1 + 1j))
    assert abs(step[0]) == pytest.approx(1.5, abs=1e-3)
    assert abs(step[-1]) == pytest.approx(1.0, abs=2e-3)


def test_at_its_corner_the_amplifier_passes_half_the_power_and_leads_by_45_degrees() -> None:
    recorded = campaign([frf_recording()])
    ratio = predicted(["amplifier_high_pass"], recorded, corner=30.0) / predicted([], recorded)
    assert abs(ratio[3]) == pytest.approx(np.sqrt(0.5))
    assert np.angle(ratio[3]) == pytest.approx(np.pi / 4)


def test_a_delay_is_a_lag_proportional_to_frequency() -> None:
    recorded = campaign([frf_recording()])
    ratio = predicted(["timing_delay"], recorded, delay=100.0) / predicted([], recorded)
    assert np.abs(ratio) == pytest.approx(np.ones(len(ratio)))
    frequency = frf_recording().frequency_hz
    assert frequency is not None
    assert np.angle(ratio) == pytest.approx(-2 * np.pi * 1e-4 * frequency)


def test_pick_up_is_charge_over_dynamic_force_at_the_mains_that_stands_out() -> None:
    frequency = np.arange(1.0, 200.0)
    for mains in (50.0, 60.0):
        measured = np.where(frequency == mains, 8.0, 5.0)
        recordings = [
            frf_recording(
                id=f"r{force}",
                dynamic_force_n=force,
                frequency_hz=frequency,
                frf_re_pc_per_n=measured,
                frf_im_pc_per_n=0 * measured,
            )
            for force in (0.1, 0.2)
        ]
        model = compose(["mains_pickup"], campaign(recordings), table())
        answer = model.predict(fit_of(model, pickup_charge=0.02))
        assert answer.pickup is not None
        pickup = answer.pickup.reshape(2, -1)
        assert frequency[pickup[0].argmax()] == mains
        assert pickup[0].max() == pytest.approx(0.02e-12 / 0.1)
        assert pickup[1] == pytest.approx(pickup[0] / 2)
        assert (answer.value == predicted([], campaign(recordings))).all()


def test_a_spread_of_the_sensors_is_what_its_parameter_says() -> None:
    recordings = [frf_recording(), frf_recording(id="other", sensor="s2")]
    model = compose(["sensor_spread"], campaign(recordings), table())
    assert model.sensor_spread_of(fit_of(model, spread=0.13))[0] == pytest.approx(0.13)
    plain = compose([], campaign(recordings), table())
    assert plain.sensor_spread_of(fit_of(plain))[0] == 0.01
