"""What a lab of the solved rig declares and does: skin, spheres, preloads, positions, times, and noise.

True modulus, thickness and sensor radius differ from the declared ones by the tolerances of such measurements.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.solved.layer import Floats
from rig.solved.worlds import CREEP, FINITE_SKIN, World, evenly_in_log

MODULUS_OFF, THICKNESS_OFF, SENSOR_OFF = 0.01, 0.005, 0.005  # standard deviations of the logarithms
_SPHERES = np.array([2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])  # mm
_WIDEST, _HARDEST = 1.5, 0.06  # a/h of Hertz and F/(R²E), to which a lab goes
_LEAST, _MOST = 12, 84  # recordings: fewer are repeated
_PITCH = 8.0  # mm
_DWELLS = np.array([1.0, 5.0, 20.0, 60.0, 300.0])  # s


@dataclass(frozen=True)
class Noise:
    """Gain scatter of a recording; relative noise of a line and how it grows at both ends of the band; floor [pC/N];
    scatter of position [mm]; averages; and whether the coherence is written."""

    gain: float
    line: float
    low: float
    high: float
    floor: float
    position_mm: float
    averages: float
    coherence: bool

    def of_line(self, frequency_hz: Floats) -> Floats:
        """Relative noise of each part of each line."""
        low, high = frequency_hz[0], frequency_hz[-1]
        return self.line * (1 + self.low * low / frequency_hz + self.high * (frequency_hz / high) ** 2)


@dataclass(frozen=True)
class Sizes:
    """Modulus [MPa], thickness and sensor radius [mm]."""

    modulus: float
    thickness: float
    sensor_radius: float


@dataclass(frozen=True)
class Design:
    """Declared and true sizes; d33 [pC/N]; sensors (sensors, 2); and one value a recording, in order.

    Attributes
    ----------
    offset : ndarray, (rows, 2)
        Commanded place from the sensor's centre [mm].
    missed : ndarray, (rows, 2)
        Error of position [mm].
    minutes : float
        Between recordings; 0 where no times are written.
    """

    declared: Sizes
    true: Sizes
    d33: float
    sensors: Floats
    sensor: NDArray[np.intp]
    sphere: Floats
    force: Floats
    dynamic: Floats
    offset: Floats
    missed: Floats
    dwell_s: Floats | None
    minutes: float
    frequency_hz: Floats
    noise: Noise

    @property
    def distance(self) -> Floats:
        """True distance of the sphere's axis from the sensor's centre [mm]."""
        return np.hypot(*(self.offset + self.missed).T)


def drawn_design(random: np.random.Generator, world: World) -> Design:
    """A lab's design suited to the world."""
    declared = _declared(random)
    off = np.exp(random.normal(size=3) * (MODULUS_OFF, THICKNESS_OFF, SENSOR_OFF))
    true = Sizes(
        float(declared.modulus * off[0]), float(declared.thickness * off[1]), float(declared.sensor_radius * off[2])
    )
    spheres, preloads = _loads(random, declared, world)
    sensors, places, dwells = _places(random, declared, world), np.zeros((1, 2)), np.array([0.0])
    if world.effect != FINITE_SKIN and random.random() < 0.4:
        places, sensors = _scan(random, declared.thickness), sensors[:1]
    if world.effect == CREEP or random.random() < 0.25:
        dwells = _DWELLS[: int(random.integers(3, 6))]
    grid = np.stack(
        np.meshgrid(np.arange(len(sensors)), spheres, preloads, np.arange(len(places)), indexing="ij"), axis=-1
    ).reshape(-1, 4)
    grid = np.tile(grid, (-(-_LEAST // len(grid)), 1))
    rows = grid[random.permutation(len(grid))[:_MOST]]
    noise = _noise(random)
    dynamic = min(evenly_in_log(random, 0.02, 0.15), 0.5 * float(preloads.min()))
    return Design(
        declared,
        true,
        evenly_in_log(random, 8.0, 30.0),
        sensors,
        rows[:, 0].astype(np.intp),
        rows[:, 1].astype(float),
        rows[:, 2].astype(float),
        np.full(len(rows), dynamic),
        places[rows[:, 3].astype(int)],
        noise.position_mm * random.normal(size=(len(rows), 2)),
        random.choice(dwells, len(rows)) if len(dwells) > 1 else None,
        float(random.choice([3, 5, 10])) if random.random() < 0.5 else 0.0,
        np.round(np.geomspace(1.0, 130.0, int(random.integers(24, 41))), 5),
        noise,
    )


def _declared(random: np.random.Generator) -> Sizes:
    if random.random() < 0.1:
        return Sizes(16.0, 2.5, 1.5)  # the prototype
    thickness = round(float(random.uniform(1.0, 3.0)), 1)
    radius = round(thickness * float(random.uniform(0.35, 1.15)), 2)
    return Sizes(float(f"{evenly_in_log(random, 0.4, 2.5):.2g}"), thickness, radius)


def _loads(random: np.random.Generator, declared: Sizes, world: World) -> tuple[Floats, Floats]:
    """Spheres [mm] and preloads [N], up to what the softened skin bears."""
    h = declared.thickness
    suitable = _SPHERES[1.5 * h < _SPHERES]
    count = min(len(suitable), int(random.choice([1, 2, 2, 3])))
    spheres = np.sort(random.choice(suitable, count, replace=False))
    softest = declared.modulus * float(world.relaxed(_DWELLS[-1:])[0])
    bearable = min((_WIDEST * h) ** 3 * softest / (0.5625 * spheres[-1]), _HARDEST * spheres[0] ** 2 * softest)
    highest = min(bearable, float(random.uniform(1.5, 4.0)))
    lowest = highest * float(random.uniform(0.06, 0.2))
    forces = np.geomspace(lowest, highest, int(random.integers(5, 10)))
    return spheres, np.array(sorted({float(f"{force:.2g}") for force in forces}))


def _places(random: np.random.Generator, declared: Sizes, world: World) -> Floats:
    """Centres of the sensors (sensors, 2)."""
    columns, rows = ((1, 1), (1, 1), (2, 2), (4, 2))[int(random.integers(4))] if world.effect != FINITE_SKIN else (1, 1)
    pitch = max(_PITCH, 2.5 * declared.sensor_radius)
    x, y = np.meshgrid(pitch * (np.arange(columns) - (columns - 1) / 2), pitch * (np.arange(rows) - (rows - 1) / 2))
    return np.stack([x.ravel(), y.ravel()], axis=1)


def _scan(random: np.random.Generator, thickness: float) -> Floats:
    """Commanded positions of a line across the sensor (places, 2)."""
    angle, reach = float(random.uniform(0, 2 * math.pi)), 1.2 * thickness
    along = reach * np.linspace(-1, 1, int(random.choice([5, 7])))
    return np.round(along[:, None] * (math.cos(angle), math.sin(angle)), 2)


def _noise(random: np.random.Generator) -> Noise:
    return Noise(
        evenly_in_log(random, 0.005, 0.02),
        evenly_in_log(random, 0.003, 0.012),
        float(random.uniform(0, 1.2)),
        float(random.uniform(0, 1.0)),
        evenly_in_log(random, 0.005, 0.1),
        evenly_in_log(random, 0.03, 0.12) if random.random() < 0.3 else 0.0,
        float(random.choice([8, 16, 32])),
        bool(random.random() < 0.7),
    )
