"""Mechanisms of the FRF together: each acts at its stage, whatever the order in which they are named."""

from dataclasses import replace

import numpy as np
import pytest

from tests.mechanisms.mechanism_contacts import H, level
from tests.support.mechanism_campaigns import SKIN, campaign, frf_recording, predicted
from underskin.physics import charge_response

INSIDE: dict[str, dict[str, float]] = {
    "layered_contact": {},
    "strain_stiffening": {"stiffening": 4.0},
    "thickness_error": {"thickness_factor": 0.9},
    "adhesion": {"work_of_adhesion": 0.3},
    "misalignment": {"offset_x": 0.3, "offset_y": 0.2},
}
VALUES = {name: value for values in INSIDE.values() for name, value in values.items()}


def test_the_moving_edge_has_all_that_shapes_contact_and_stress_inside_its_derivative() -> None:
    preload, step = 1.0, 1e-3
    charge = [
        force * level(list(INSIDE), frf_recording(preload_n=force, position_mm=(0.5, 0.0)), SKIN, **VALUES)
        for force in (preload - step, preload + step)
    ]
    still = level(list(INSIDE), frf_recording(preload_n=preload, position_mm=(0.5, 0.0)), SKIN, **VALUES)
    expected = 0.3 * still + 0.7 * (charge[1] - charge[0]) / (2 * step)
    found = level(
        ["moving_contact_edge", *INSIDE],
        replace(frf_recording(preload_n=preload, position_mm=(0.5, 0.0)), dynamic_force_n=0.0),
        SKIN,
        mobile_fraction=0.7,
        **VALUES,
    )
    assert found == pytest.approx(expected, rel=1e-5)


def test_the_first_harmonic_has_them_inside_too() -> None:
    preload, dynamic, phase = 1.0, 0.6, (np.arange(64) + 0.5) * 2 * np.pi / 64
    forces = preload + dynamic * np.sin(phase)
    charges = [
        force * level(list(INSIDE), frf_recording(preload_n=float(force), position_mm=(0.5, 0.0)), SKIN, **VALUES).real
        for force in forces
    ]
    expected = 2 * np.mean(np.array(charges) * np.sin(phase)) / dynamic
    recording = frf_recording(preload_n=preload, dynamic_force_n=dynamic, position_mm=(0.5, 0.0))
    found = level(["moving_contact_edge", *INSIDE], recording, SKIN, mobile_fraction=1.0, **VALUES)
    assert found.real == pytest.approx(expected, rel=1e-4)


def test_makes_charge_stress_acts_sensor_sensor() -> None:
    """What makes charge of stress acts sensor by sensor then on the recording then on its lines."""
    place, preload = (1.5, 1.0), 2.0

    def own_charge(sensor: str) -> float:
        recording = frf_recording(sensor=sensor, position_mm=place, preload_n=preload)
        stress = 1e-6 * charge_response.mean_stress(preload, level([], recording).real, H)
        oscillating = level(["moving_contact_edge"], recording, SKIN, mobile_fraction=0.8).real
        return float(oscillating * (1 + 2.0 * stress / (1 + stress / 0.5)))

    aged = 1 - 0.1 * np.log10(1 + 5000 / 1000)
    expected = aged * (own_charge("s1") + 0.2 * (own_charge("s2") + own_charge("s3")))
    recordings = [
        frf_recording(position_mm=place, preload_n=preload, load_cycles=5000),
        frf_recording(id="other", load_cycles=7),
    ]
    names = ["timing_delay", "ageing", "crosstalk", "preload_dependent_d33", "moving_contact_edge"]
    found = predicted(
        names,
        campaign(recordings),
        d33=1e12,
        delay=100.0,
        loss=0.1,
        onset=1000.0,
        saturation=0.0,
        fraction=0.2,
        stress_coefficient=2.0,
        saturation_stress=0.5,
        mobile_fraction=0.8,
    )[:13] / (1.5 * 0.6**2)
    frequency = frf_recording().frequency_hz
    assert frequency is not None
    assert found == pytest.approx(expected * np.exp(-2j * np.pi * 1e-4 * frequency), rel=1e-6)
