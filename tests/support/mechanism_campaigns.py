"""Campaigns for the tests of mechanisms: one of each kind that supports every mechanism, and single contacts."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from underskin.mechanisms import Model, compose
from underskin.recordings.campaign import (
    Campaign,
    CompressionRecording,
    FrfRecording,
    IndentationRecording,
    Sensor,
    SkinDescription,
)
from underskin.surrogate.sigma_table import SigmaTable, load_table
from underskin.units import Floats

FREQUENCY = np.array([1.0, 3.0, 10.0, 30.0, 47.0, 49.0, 50.0, 51.0, 60.0, 100.0, 150.0, 400.0, 1000.0])
SKIN = SkinDescription(
    poisson_ratio=0.5,
    thickness_mm=2.5,
    youngs_modulus_mpa=2.0,
    sensor_radius_mm=1.5,
    sensors=(Sensor("s1", 0.0, 0.0), Sensor("s2", 4.0, 0.0), Sensor("s3", 0.0, 4.0)),
)


@cache
def table() -> SigmaTable:
    """The shipped table, read once."""
    return load_table()


def frf_recording(**changes: Any) -> FrfRecording:
    """One recording on s1."""
    plain = FrfRecording(
        id="r",
        sensor="s1",
        indenter_radius_mm=4.0,
        preload_n=1.0,
        dynamic_force_n=0.09,
        frequency_hz=FREQUENCY,
        frf_re_pc_per_n=np.full(len(FREQUENCY), 5.0),
        frf_im_pc_per_n=np.zeros(len(FREQUENCY)),
    )
    return replace(plain, **changes)


def campaign(recordings: Sequence[FrfRecording], skin: SkinDescription = SKIN) -> Campaign:
    """A campaign of these recordings."""
    return Campaign("test", skin, tuple(recordings))


def frf_campaign() -> Campaign:
    """Sensors, places, preloads, spheres, times, cycles and amplitudes that vary."""
    sensors = {sensor.id: sensor for sensor in SKIN.sensors}
    recordings = []
    for number in range(12):
        sensor = sensors[("s1", "s2", "s3")[number % 3]]
        recordings.append(
            frf_recording(
                id=f"r{number}",
                sensor=sensor.id,
                indenter_radius_mm=(4.0, 10.0)[number // 3 % 2],
                preload_n=(0.5, 1.0, 2.0)[number // 6 + (number % 2)],
                dynamic_force_n=(0.03, 0.3)[number % 2],
                position_mm=(sensor.x_mm + 0.3 * (number % 4), sensor.y_mm + 0.2 * (number % 5)),
                load_cycles=300 * number,
                dwell_s=(2.0, 60.0, 600.0)[number % 3],
            )
        )
    return campaign(recordings)


def indentation_campaign() -> Campaign:
    """Two spheres pressed in, held a moment and drawn back."""
    depth = np.concatenate([np.linspace(-0.05, 0.4, 46), np.full(10, 0.4), np.linspace(0.39, -0.1, 50)])
    time = np.arange(0.0, 0.2 * len(depth) - 0.1, 0.2)
    recordings = tuple(
        IndentationRecording(
            id=f"i{number}",
            indenter_radius_mm=radius,
            displacement_mm=depth,
            force_n=hertz_force(depth, radius, 2.0),
            time_s=time,
        )
        for number, radius in enumerate((2.5, 4.0))
    )
    return Campaign("indentations", SKIN, recordings)


def hertz_force(depth_mm: Floats, radius_mm: float, modulus_mpa: float) -> Floats:
    """[N], incompressible."""
    return 4 / 3 * modulus_mpa / 0.75 * np.sqrt(radius_mm) * np.maximum(depth_mm, 0.0) ** 1.5


def compression_campaign() -> Campaign:
    """Two cylinders of different shape, loaded and unloaded twice."""
    recordings = []
    for number, height in enumerate((30.0, 15.0)):
        displacement = height * np.tile(np.concatenate([np.linspace(0, 0.4, 40), np.linspace(0.39, 0, 40)]), 2)
        stretch = 1 - displacement / height
        recordings.append(
            CompressionRecording(
                id=f"c{number}",
                sample_height_mm=height,
                sample_diameter_mm=30.0,
                displacement_mm=displacement,
                force_n=2.0 * np.pi / 4 * 30.0**2 * (stretch**-2 - stretch) / 3,
                time_s=np.linspace(0.0, 79.5, len(displacement)),
            )
        )
    return Campaign("cylinders", SKIN, tuple(recordings))


def fit_of(model: Model, **values: float) -> Floats:
    """Every parameter at its prior's centre, those given at a value in their units (also 0 or ∞ of a logarithm).

    A sphere's contact is linear where no `finite_strain` is given: most exact solutions are.
    """
    names = [parameter.name for parameter in model.parameters]
    if "finite_strain" in names:
        values.setdefault("finite_strain", 0.0)
    assert set(values) <= set(names), names
    with np.errstate(divide="ignore"):
        return np.array(
            [
                np.clip(parameter.to_fit(values[parameter.name]), -60.0, 60.0)
                if parameter.name in values and parameter.scale == "log"
                else values.get(parameter.name, parameter.start)
                for parameter in model.parameters
            ]
        )


def predicted(names: Sequence[str], recorded: Campaign, **values: float) -> Floats:
    """The prediction of a composed model at parameter values; nuisances and the rest at their priors' centres."""
    model = compose(names, recorded, table())
    value = model.predict(fit_of(model, **values)).value
    return np.asarray(value)
