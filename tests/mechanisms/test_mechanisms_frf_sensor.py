"""Mechanisms of sensor, tip and electronics, against exact limits and published relations."""

from dataclasses import replace

import numpy as np
import pytest

from tests.mechanisms.mechanism_contacts import E, H, contacts_within_the_table, level, linear_contact
from tests.support.mechanism_campaigns import campaign, fit_of, frf_recording, predicted, table
from underskin.mechanisms import compose
from underskin.physics import charge_response


def test_d33_changes_with_the_stress_on_the_sensor_and_saturates() -> None:
    recording = frf_recording(preload_n=2.0)
    base = level([], recording)
    stress_mpa = 1e-6 * charge_response.mean_stress(2.0, base.real, H)
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


def test_the_tip_resonates_on_the_layers_contact() -> None:
    for row in contacts_within_the_table():
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
    ratio = predicted(["amplifier_high_pass"], recorded, corner=30.0, high_pass_order=1.0) / predicted([], recorded)
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
        pickup = np.sqrt(answer.pickup_variance).reshape(2, -1)
        assert frequency[pickup[0].argmax()] == mains
        assert pickup[0].max() == pytest.approx(0.02e-12 / 0.1)
        assert pickup[1] == pytest.approx(pickup[0] / 2)
        assert (answer.value == predicted([], campaign(recordings))).all()


def test_pick_up_weak_noise_mains_lines_stray() -> None:
    """A pick up as weak as the noise is at the mains whose lines stray more than the others.

    More lines lie near 50 Hz and its harmonics here than near those of 60 Hz: noise alone would point to 50.
    """
    frequency = np.array(
        [10.0, 20.0, 30.0, 49.5, 55.0, 60.5, 67.0, 80.0, 100.5, 125.0, 150.0, 165.0, 200.0, 220.0, 250.0]
    )
    for seed in range(5):
        random = np.random.default_rng(seed)
        noise = 0.25 * (random.normal(size=(30, len(frequency))) + 1j * random.normal(size=(30, len(frequency))))
        picked = 0.5 * np.exp(2j * np.pi * random.random(30))
        measured = 5.0 + noise + np.where(frequency == 60.5, 1.0, 0.0) * picked[:, None]
        recordings = [
            frf_recording(id=f"r{n}", frequency_hz=frequency, frf_re_pc_per_n=row.real, frf_im_pc_per_n=row.imag)
            for n, row in enumerate(measured)
        ]
        model = compose(["mains_pickup"], campaign(recordings), table())
        pickup = model.predict(fit_of(model, pickup_charge=0.02)).pickup_variance
        assert frequency[pickup[: len(frequency)].argmax()] == 60.5
