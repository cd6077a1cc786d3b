"""FRF lines of an experiment, with the rig's noise.

Each recording has a gain factor e^N(0, gain²), an error of position, and on each part of a line noise of variance
rel² |G|² + floor². Coherence γ² = 1/(1 + 2 n v), v the variance over |G|².
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rig import effects
from rig.effects import Values
from rig.experiment import Experiment, Noise
from rig.layer import Floats
from rig.linear_filters import Complexes
from rig.plan import recordings
from rig.true_response import TrueResponse

_MAINS_WIDTH_HZ = 1.5
_HARMONICS = ((1, 1.0), (3, 1 / 3))


@dataclass(frozen=True)
class RecordedLines:
    """`response` is the true one; `exact` its lines, `measured` the lines with noise and mains (rows, lines) [pC/N]."""

    response: TrueResponse
    frequency_hz: Floats
    exact: Complexes
    measured: Complexes
    line_variance: Floats  # of each part [pC²/N²]
    pickup: Complexes  # mains' share of `measured`
    coherence: Floats | None


def make_response(experiment: Experiment, sensor_gains: Floats | None = None) -> TrueResponse:
    """The true response of an experiment, its scatter of positions drawn, and of sensors unless gains are given."""
    plan = recordings(experiment)
    random = np.random.default_rng([experiment.seed, 1])
    missed = experiment.noise.position_mm * random.normal(size=(len(plan.preload_n), 2))
    if sensor_gains is None:
        spread = effects.of(experiment.effects, "sensor_spread", "sd")
        sensor_gains = np.exp(spread * random.normal(size=len(experiment.skin.sensors)))
    return TrueResponse(experiment, plan, missed, sensor_gains)


def recording_gains(experiment: Experiment, rows: int) -> Floats:
    """Gain factor of each recording (rows,), log-normal."""
    return np.exp(experiment.noise.gain * np.random.default_rng([experiment.seed, 2]).normal(size=rows))


def record_lines(experiment: Experiment, sensor_gains: Floats | None = None) -> RecordedLines:
    """Carry out an experiment that records FRF lines, on sensors of given gains (sensors,) or of drawn ones."""
    assert experiment.lines is not None
    response = make_response(experiment, sensor_gains)
    grid = np.geomspace(experiment.lines.low_hz, experiment.lines.high_hz, experiment.lines.count)
    frequency = np.unique(np.round(grid, 4))
    exact = response.lines(frequency)
    random = np.random.default_rng([experiment.seed, 3])
    actual = exact * recording_gains(experiment, len(exact))[:, None]
    variance = line_noise(experiment.noise, frequency) ** 2 * np.abs(actual) ** 2 + experiment.noise.floor_pc_per_n**2
    noise = random.normal(size=(2, *exact.shape)) * np.sqrt(variance)
    pickup = mains_pickup(experiment.effects, response.plan.dynamic_n, frequency, random)
    size = np.maximum(np.abs(actual) ** 2, 1e-300)
    coherence = 1 / (1 + 2 * experiment.noise.averages * variance / size) if experiment.noise.coherence else None
    return RecordedLines(
        response, frequency, exact, actual + noise[0] + 1j * noise[1] + pickup, variance, pickup, coherence
    )


def line_noise(noise: Noise, frequency_hz: Floats) -> Floats:
    """Relative noise rel of each line (lines,)."""
    low, high = frequency_hz[0], frequency_hz[-1]
    return noise.line * (1 + noise.low * low / frequency_hz + noise.high * (frequency_hz / high) ** 2)


def mains_pickup(
    on: dict[str, Values], dynamic_n: Floats, frequency_hz: Floats, random: np.random.Generator
) -> Complexes:
    """Mains pick-up on the lines near its frequency, with a random phase in each recording (rows, lines) [pC/N]."""
    if "mains_pickup" not in on:
        return np.zeros((len(dynamic_n), len(frequency_hz)), dtype=complex)
    charge, mains = (effects.of(on, "mains_pickup", name) for name in ("charge_pc", "mains_hz"))
    shape = sum(
        share / (1 + ((frequency_hz - harmonic * mains) / _MAINS_WIDTH_HZ) ** 2) for harmonic, share in _HARMONICS
    )
    phase = np.exp(2j * np.pi * random.random(len(dynamic_n)))
    return np.multiply.outer(charge / dynamic_n * phase, shape)


def campaign(recorded: RecordedLines) -> dict[str, Any]:
    """The campaign (`campaign/1`) of recorded lines, with what the lab knows of them."""
    entries = recording_headers(recorded.response)
    for row, header in enumerate(entries):
        header["frequency_hz"] = recorded.frequency_hz.tolist()
        header["frf_re_pc_per_n"] = _rounded(recorded.measured[row].real)
        header["frf_im_pc_per_n"] = _rounded(recorded.measured[row].imag)
        if recorded.coherence is not None:
            header["coherence"] = np.round(recorded.coherence[row], 8).tolist()
    return campaign_document(recorded.response.experiment, entries)


def _rounded(values: Floats) -> list[float]:
    return [float(f"{value:.7g}") for value in values]


def campaign_document(experiment: Experiment, entries: list[dict[str, Any]]) -> dict[str, Any]:
    """A campaign of the experiment's skin and these recordings."""
    return {"schema": "campaign/1", "name": experiment.name, "skin": skin_document(experiment), "recordings": entries}


def skin_document(experiment: Experiment) -> dict[str, Any]:
    """The skin as the lab declares it, without d33."""
    skin = experiment.skin
    declared = {
        name: getattr(skin, name) for name in ("id", "width_mm", "length_mm") if getattr(skin, name) is not None
    }
    return {
        **declared,
        "thickness_mm": skin.thickness_mm,
        "youngs_modulus_mpa": skin.youngs_modulus_mpa,
        "poisson_ratio": 0.5,
        "sensor_radius_mm": skin.sensor_radius_mm,
        "d33_pc_per_n": None,
        "sensors": [{"id": name, "x_mm": x, "y_mm": y} for name, x, y in skin.sensors],
    }


def recording_headers(response: TrueResponse) -> list[dict[str, Any]]:
    """Id and conditions of each recording, in order."""
    plan, skin, times = response.plan, response.experiment.skin, response.plan.recorded_at
    moved = bool(np.any(plan.offset_mm != 0))
    entries = []
    for row, number in enumerate(plan.sensor):
        name, x, y = skin.sensors[number]
        header: dict[str, Any] = {
            "id": f"r{row + 1:03d}",
            "sensor": name,
            "indenter_radius_mm": float(plan.indenter_mm[row]),
            "preload_n": float(plan.preload_n[row]),
            "dynamic_force_n": float(plan.dynamic_n[row]),
        }
        if times is not None:
            header["recorded_at"] = times[row]
        if plan.cycles is not None:
            header["load_cycles"] = int(plan.cycles[row])
        if plan.dwell_s is not None:
            header["dwell_s"] = float(plan.dwell_s[row])
        if moved:
            header["position_mm"] = [float(x + plan.offset_mm[row, 0]), float(y + plan.offset_mm[row, 1])]
        entries.append(header)
    return entries
