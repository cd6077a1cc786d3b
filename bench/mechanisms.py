"""A model's predictions with derivatives, over all lines of a campaign, on one core."""

import time
from collections.abc import Sequence
from statistics import median

import numpy as np
from threadpoolctl import threadpool_limits

from bench.figures import Figure
from underskin.mechanisms import compose
from underskin.recordings.campaign import Campaign, FrfRecording, Sensor, SkinDescription
from underskin.surrogate.sigma_table import load_table
from underskin.units import Floats

SETS = (
    ("layered_contact", "moving_contact_edge", "contact_resonance"),
    ("interface_slip", "compressible_layer", "layered_contact"),
    ("adhesion", "moving_contact_edge", "contact_resonance"),
    ("contact_creep", "misalignment", "sensor_relaxation"),
    ("crosstalk", "preload_dependent_d33", "ageing"),
)
SIZES = ((650, 80, 20.0), (100, 60, None))  # recordings, lines, target in ms
ROUNDS = 31


def measure() -> list[Figure]:
    """Milliseconds of processor time of one prediction, for each set and size."""
    figures = []
    table = load_table()
    with threadpool_limits(1):
        for recordings, lines, target in SIZES:
            campaign = _campaign(recordings, lines)
            for names in SETS:
                model = compose(names, campaign, table)
                fit = np.array([parameter.start for parameter in model.parameters])
                model.predict(fit)
                times = []
                for _ in range(ROUNDS):
                    start = time.process_time()
                    model.predict(fit)
                    times.append(1e3 * (time.process_time() - start))
                name = f"{recordings} recordings × {lines} lines, {' + '.join(names)}"
                figures.append(Figure(name, median(times), "ms", target, "lower"))
    return figures


def _campaign(count: int, lines: int) -> Campaign:
    """Every sensor of an 8 × 8 array under two spheres and five preloads, each recording at a place of its own."""
    sensors = tuple(Sensor(f"s{number}", 8.0 * (number % 8), 8.0 * (number // 8)) for number in range(64))
    skin = SkinDescription(
        poisson_ratio=0.5, thickness_mm=2.5, youngs_modulus_mpa=16.0, sensor_radius_mm=1.5, sensors=sensors
    )
    random = np.random.default_rng(4)
    frequency = np.geomspace(1, 1000, lines)
    return Campaign("bench", skin, tuple(_recording(number, sensors, frequency, random) for number in range(count)))


def _recording(number: int, sensors: Sequence[Sensor], frequency: Floats, random: np.random.Generator) -> FrfRecording:
    sensor = sensors[number % len(sensors)]
    return FrfRecording(
        id=f"r{number}",
        sensor=sensor.id,
        indenter_radius_mm=(4.0, 10.0)[number % 2],
        preload_n=(0.5, 1.0, 1.5, 2.0, 3.0)[number % 5],
        dynamic_force_n=0.09,
        load_cycles=100 * number,
        dwell_s=(5.0, 60.0, 600.0)[number % 3],
        position_mm=(sensor.x_mm + random.uniform(0, 4), sensor.y_mm + random.uniform(0, 4)),
        frequency_hz=frequency,
        frf_re_pc_per_n=np.ones(len(frequency)),
        frf_im_pc_per_n=np.zeros(len(frequency)),
    )
