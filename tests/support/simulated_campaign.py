"""Campaigns with known d33 and the noise of every rig: gain and position scatter a recording, noise a line."""

from dataclasses import dataclass

import numpy as np

from underskin.physics import charge_response
from underskin.physics.charge_response import Indenter, Skin
from underskin.prediction.pressed_skin import transmission
from underskin.recordings.campaign import Campaign, FrfRecording, Sensor, SkinDescription
from underskin.surrogate.off_centre_sigma import positioned_sigma
from underskin.surrogate.sigma_table import ContactModel
from underskin.units import Floats

LARGEST_SCATTER_MM = 0.3
PITCH_MM = 8.0


@dataclass(frozen=True)
class Rig:
    """What a simulated campaign is made of; `d33` is each sensor's [pC/N]."""

    d33: Floats
    preloads_n: tuple[float, ...] = (0.5, 1.0, 1.5, 2.0, 3.0)
    indenters_mm: tuple[float, ...] = (4.0, 10.0)
    thickness_mm: float = 2.5
    modulus_mpa: float = 16.0
    sensor_radius_mm: float = 1.5
    gain: float = 0.03
    position_mm: float = 0.0
    largest_offset_mm: float = 0.0
    line: float = 0.01
    averages: float = 16.0
    frequency_hz: Floats | None = None


def simulate(table: ContactModel, rig: Rig, random: np.random.Generator) -> Campaign:
    """Every sensor under every indenter and preload, once."""
    sensors = tuple(
        Sensor(id=f"s{number}", x_mm=PITCH_MM * (number % 8), y_mm=PITCH_MM * (number // 8))
        for number in range(len(rig.d33))
    )
    design = [
        (number, radius, preload)
        for number in range(len(sensors))
        for radius in rig.indenters_mm
        for preload in rig.preloads_n
    ]
    number, radius, preload = (np.array(column) for column in zip(*design, strict=True))
    commanded = rig.largest_offset_mm * random.random(len(design))
    skin = Skin.from_lab(
        thickness_mm=rig.thickness_mm, youngs_modulus_mpa=rig.modulus_mpa, sensor_radius_mm=rig.sensor_radius_mm
    )
    felt = transmission(table, skin, Indenter.from_lab(indenter_radius_mm=radius), preload)
    missed = random.normal(0, rig.position_mm, (2, len(design)))
    true = np.hypot(commanded + missed[0], missed[1])
    rho = float(skin.rt_over_h)
    sigma = positioned_sigma(
        table,
        felt.small_strain_a_over_h,
        rho,
        felt.load_parameter,
        true / rig.thickness_mm,
        LARGEST_SCATTER_MM / rig.thickness_mm,
    ).sigma
    level = charge_response.frf(rig.d33[number], sigma, rho) * np.exp(random.normal(0, rig.gain, len(design)))
    frequency = np.geomspace(1, 130, 40) if rig.frequency_hz is None else rig.frequency_hz
    relative = rig.line * (1 + 1.0 * (frequency < 3))
    noise = np.abs(level)[:, None] * relative * random.normal(size=(2, len(design), len(frequency)))
    coherence = 1 / (1 + 2 * rig.averages * relative**2)
    recordings = tuple(
        FrfRecording(
            id=f"r{row}",
            sensor=sensors[number[row]].id,
            indenter_radius_mm=float(radius[row]),
            preload_n=float(preload[row]),
            dynamic_force_n=0.09,
            position_mm=(sensors[number[row]].x_mm + float(commanded[row]), sensors[number[row]].y_mm),
            frequency_hz=frequency,
            frf_re_pc_per_n=level[row] + noise[0, row],
            frf_im_pc_per_n=noise[1, row],
            coherence=coherence,
        )
        for row in range(len(design))
    )
    described = SkinDescription(
        poisson_ratio=0.5,
        thickness_mm=rig.thickness_mm,
        youngs_modulus_mpa=rig.modulus_mpa,
        sensor_radius_mm=rig.sensor_radius_mm,
        sensors=sensors,
    )
    return Campaign("simulated", described, recordings)
