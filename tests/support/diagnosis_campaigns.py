"""Campaigns made with the mechanisms' own models and the noise that a diagnosis assumes, to test its statistics."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.mechanisms import compose
from underskin.mechanisms.models.composition import SENSOR_SPREAD
from underskin.recordings.campaign import Campaign, FrfRecording, Sensor, SkinDescription
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes, Floats

PITCH_MM = 8.0


@dataclass(frozen=True)
class Made:
    """What a campaign is made of; `parameters` are those of the mechanisms, in order, in their units."""

    mechanisms: Sequence[str] = ()
    parameters: Sequence[float] = ()
    preloads_n: Sequence[float] = (0.3, 0.6, 1.2, 2.4)
    spheres_mm: Sequence[float] = (4.0, 8.0)
    offsets_mm: Sequence[float] = (0.0,)
    sensors: int = 2
    repeats: int = 1
    lines: int = 12
    highest_hz: float = 130.0
    modulus_mpa: float = 3.0
    thickness_mm: float = 2.0
    sensor_radius_mm: float = 1.0
    d33_pc_per_n: float = 15.0
    gain: float = 0.02
    line: float = 0.01
    position_mm: float = 0.0
    dynamic_forces_n: Sequence[float] = (0.05,)
    seed: int = 1


def design(made: Made) -> Campaign:
    """Every sensor under every sphere, preload and offset, with lines of 1."""
    sensors = tuple(Sensor(id=f"s{number}", x_mm=PITCH_MM * number, y_mm=0.0) for number in range(made.sensors))
    frequency = np.round(np.geomspace(1.0, made.highest_hz, made.lines), 4)
    recordings: list[FrfRecording] = []
    for _ in range(made.repeats):
        for sensor in sensors:
            for sphere in made.spheres_mm:
                for preload in made.preloads_n:
                    for offset in made.offsets_mm:
                        number = len(recordings)
                        recordings.append(
                            FrfRecording(
                                id=f"r{number}",
                                sensor=sensor.id,
                                indenter_radius_mm=sphere,
                                preload_n=preload,
                                dynamic_force_n=made.dynamic_forces_n[number % len(made.dynamic_forces_n)],
                                load_cycles=100 * (number + 1),
                                dwell_s=(1.0, 10.0, 100.0)[number % 3],
                                recorded_at=f"2020-01-{1 + number // 20:02d}T10:{number % 20:02d}:00Z",
                                position_mm=(sensor.x_mm + offset, sensor.y_mm),
                                frequency_hz=frequency,
                                frf_re_pc_per_n=np.ones(made.lines),
                                frf_im_pc_per_n=np.zeros(made.lines),
                            )
                        )
    skin = SkinDescription(
        poisson_ratio=0.5,
        thickness_mm=made.thickness_mm,
        youngs_modulus_mpa=made.modulus_mpa,
        sensor_radius_mm=made.sensor_radius_mm,
        sensors=sensors,
    )
    return Campaign("made", skin, tuple(recordings))


def campaign(made: Made, table: SigmaTable) -> Campaign:
    """The design with the model's lines, and noise: gain, position (to first order) and lines."""
    empty = design(made)
    model = compose(made.mechanisms, empty, table)
    fit = np.array([entry.start for entry in model.parameters])
    own = [entry.to_fit(value) for entry, value in zip(model.parameters, made.parameters, strict=False)]
    fit[: len(own)] = own
    fit[[entry.name for entry in model.parameters].index("d33")] = np.log(made.d33_pc_per_n)
    random = np.random.default_rng(made.seed)
    prediction = model.predict(fit)
    value = prediction.value.copy()
    count = len(empty.recordings)
    if prediction.position_slopes is not None and made.position_mm:
        missed = random.normal(0, 1e-3 * made.position_mm, (2, count))[:, model.recording]
        value += (prediction.position_slopes * missed).sum(axis=0)
    if prediction.pickup is not None:
        phase = (random.normal(size=count) + 1j * random.normal(size=count))[model.recording]
        value = value + np.sqrt(prediction.pickup_variance) * phase
    freed = [one.from_fit(at) for one, at in zip(model.parameters, fit, strict=True) if one.acts_on == "gain_spread"]
    spread = freed[0] if freed else SENSOR_SPREAD
    assert model.sensor is not None
    gain = random.normal(0, made.gain, count) + random.normal(0, spread, made.sensors)[model.sensor]
    value = value * np.exp(gain)[model.recording]
    scale = made.line * np.abs(value)
    value = value + scale * (random.normal(size=len(value)) + 1j * random.normal(size=len(value)))
    recordings = []
    for number, entry in enumerate(empty.recordings):
        assert isinstance(entry, FrfRecording)
        own_lines = 1e12 * value[model.recording == number]
        recordings.append(replace(entry, frf_re_pc_per_n=own_lines.real, frf_im_pc_per_n=own_lines.imag))
    return replace(empty, recordings=tuple(recordings))


def added(made: Campaign, charge: Callable[[Floats], Complexes]) -> Campaign:
    """With a complex charge over force [pC/N] added to each recording's lines, made of their real parts."""
    entries = []
    for entry in made.recordings:
        assert isinstance(entry, FrfRecording)
        assert entry.frf_re_pc_per_n is not None
        assert entry.frf_im_pc_per_n is not None
        more = charge(entry.frf_re_pc_per_n)
        entries.append(
            replace(
                entry,
                frf_re_pc_per_n=entry.frf_re_pc_per_n + more.real,
                frf_im_pc_per_n=entry.frf_im_pc_per_n + more.imag,
            )
        )
    return replace(made, recordings=tuple(entries))
