"""Draws what was planned and noted: skin, sensors, spheres, sequence of recordings, conditions and noise levels.

Units: mm, N, MPa, Hz, s; `recorded_at` is in hours since the midnight before the first recording. The skin is linear,
so a design is drawn again until large strain would be invisible: the estimate of `layer.finite_strain_shift`, relative
to the gain error, stays below `FINITE_STRAIN_CHI2` over the whole campaign.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rig.unlisted.layer import finite_strain_shift, hertz_radius

Array = npt.NDArray[np.float64]
Generator = np.random.Generator

FINITE_STRAIN_CHI2 = 2.0
OPTIONAL = ("recorded_at", "load_cycles", "dwell_s", "position_mm", "dynamic_force_n")
LOGARITHMIC = ("dwell_s", "load_cycles", "indenter_radius_mm", "preload_n", "dynamic_force_n", "previous_preload_n")
WORDS = {"operator": ("ak", "jw", "mb", "rs"), "mount": ("left", "right"), "amplifier": ("a1", "a2", "a3")}
NUMBERS = ("temperature_c", "humidity_percent", "supply_v", "table_tilt_mrad")


@dataclass(frozen=True)
class Column:
    """One axis: numbers, or the codes of words."""

    values: Array
    words: tuple[str, ...] = ()
    logarithmic: bool = False


@dataclass(frozen=True)
class Noise:
    """Gain error and line noise.

    gain: standard deviation of the log of each recording's gain; line: rel, with Re and Im of variance
    rel^2 |G|^2 + floor^2; rel grows by `low` at the lowest and by `high` at the highest frequency.
    """

    gain: float
    line: float
    low: float
    high: float
    floor: float
    position_mm: float
    averages: int

    def relative(self, frequency_hz: Array) -> Array:
        """rel at each frequency."""
        f = frequency_hz
        return np.asarray(self.line * (1.0 + self.low * f[0] / f + self.high * (f / f[-1]) ** 2))


@dataclass(frozen=True)
class Design:
    """The plan of one campaign; recordings stand in the order in which they were made."""

    thickness_mm: float
    modulus_mpa: float
    sensor_radius_mm: float
    sensor_xy: Array
    sensor: npt.NDArray[np.int64]
    columns: dict[str, Column]
    frequency_hz: Array
    noise: Noise
    day: int
    finite_strain_chi2: float
    conditions: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()
    coherence: bool = True

    @property
    def count(self) -> int:
        """Number of recordings."""
        return int(self.sensor.size)

    def value(self, name: str) -> Array:
        """A column's values (recordings,)."""
        return self.columns[name].values

    @property
    def radius(self) -> Array:
        """Contact radius of the base model, mm."""
        return hertz_radius(self.value("preload_n"), self.value("indenter_radius_mm"), self.modulus_mpa)

    @property
    def offset_xy(self) -> Array:
        """Commanded position less the sensor's position, (n, 2), mm."""
        position = np.stack([self.value("x_mm"), self.value("y_mm")], axis=1)
        return np.asarray(position - self.sensor_xy[self.sensor])


def draw_noise(rng: Generator, careful: bool, thickness_mm: float, scattered: bool) -> Noise:
    """`careful` rigs have a gain error of 0.5-3 %, the others 0.5-8 %."""
    return Noise(
        gain=float(np.exp(rng.uniform(np.log(0.005), np.log(0.03 if careful else 0.08)))),
        line=float(np.exp(rng.uniform(np.log(0.003), np.log(0.02)))),
        low=float(rng.uniform(0.0, 3.0)),
        high=float(rng.uniform(0.0, 3.0)),
        floor=float(np.exp(rng.uniform(np.log(0.005), np.log(0.08)))),
        position_mm=float(rng.uniform(0.05, min(0.5, 0.15 * thickness_mm))) if scattered else 0.0,
        averages=int(rng.choice([8, 16, 32, 64])),
    )


def _loads(rng: Generator, count: int, levels: int, low: float, high: float) -> Array:
    """Preloads: random, blocks upward, or up and down."""
    ladder = np.geomspace(low, high, levels)
    pattern = rng.choice(["random", "random", "up", "up_down"])
    if pattern == "random":
        return np.asarray(rng.permutation(np.resize(ladder, count)))
    return np.asarray(np.resize(ladder if pattern == "up" else np.concatenate([ladder, ladder[-2:0:-1]]), count))


def _times(rng: Generator, count: int) -> Array:
    """Hours: a few working days, now and then a week apart, or one long session."""
    days = int(rng.integers(1, 9))
    per_day = -(-count // days)
    step = rng.uniform(0.6, 1.4) * min(10.0 / per_day, 0.5)
    calendar = np.cumsum(rng.choice([1, 1, 1, 2, 7], size=days)) - 1.0
    hours: list[float] = []
    for day in calendar:
        start = rng.uniform(7.0, 10.5)
        hours += list(24.0 * day + start + np.cumsum(rng.uniform(0.4, 1.6, size=per_day)) * step)
    first = 24.0 * np.floor(hours[0] / 24.0)
    return np.asarray(np.round((np.array(hours[:count]) - first) * 3600.0) / 3600.0)


def _number(rng: Generator, name: str, hours: Array) -> Array:
    count = hours.size
    if name == "temperature_c":
        if rng.random() < 0.5:
            return np.asarray(np.round(rng.uniform(14.0, 36.0, size=count), 1))
        swing = rng.uniform(1.0, 5.0) * np.sin(2.0 * np.pi * (hours - 9.5) / 24.0)
        return np.asarray(np.round(22.5 + swing + rng.normal(0.0, 1.2, size=count), 1))
    if name == "humidity_percent":
        return np.asarray(np.round(np.clip(45.0 + 12.0 * rng.standard_normal(count), 15.0, 85.0), 0))
    if name == "supply_v":
        return np.asarray(np.round(rng.uniform(11.0, 13.0, size=count), 2))
    return np.asarray(np.round(rng.uniform(-8.0, 8.0, size=count), 1))


def _plan(rng: Generator, needs: frozenset[str], careful: bool) -> Design:
    """One attempt; the strain limit is left to the caller."""
    prototype = rng.random() < 0.35
    h = 2.5 if prototype else float(np.round(np.exp(rng.uniform(np.log(0.8), np.log(4.0))), 2))
    r_t = 1.5 if prototype else float(np.round(h * rng.uniform(0.25, 1.1), 2))
    modulus = float(np.round(np.exp(rng.uniform(np.log(1.5), np.log(60.0))), 1))
    noise = draw_noise(rng, careful, h, rng.random() < 0.25)
    sensors = int(rng.choice([1, 2, 4, 6, 9])) if "sensor" not in needs else int(rng.choice([3, 4, 6, 9]))
    pitch = float(np.round(max(2.5 * r_t, 2.0 * h) + rng.uniform(0.0, 3.0)))
    side = int(np.ceil(np.sqrt(sensors)))
    grid = np.array([(i, j) for i in range(side) for j in range(side)], dtype=np.float64)[:sensors]
    xy = np.asarray((grid - grid.mean(axis=0).round()) * pitch)
    count = int(rng.integers(34, 66))
    chosen = rng.choice([3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0], size=10, replace=False)
    spheres = int(rng.choice([4, 5])) if "indenter_radius_mm" in needs else int(rng.choice([2, 2, 3]))
    radii = np.sort(chosen[:spheres])
    widest = h * rng.uniform(0.35, 1.0)
    top = 16.0 * modulus * widest**3 / (9.0 * radii[-1])
    scale = 10.0 ** (2 - np.floor(np.log10(top)))
    loads = np.round(_loads(rng, count, int(rng.integers(4, 10)), top / rng.uniform(3.5, 9.0), top) * scale) / scale
    by_block = rng.random() < 0.3
    sphere = np.sort(np.arange(count) % spheres) if by_block else rng.permutation(np.arange(count) % spheres)
    which = np.asarray(rng.permutation(np.arange(count) % sensors), dtype=np.int64)
    positions = xy[which]
    shown = {n for n in OPTIONAL if n in needs or rng.random() < 0.55}
    if needs & {"x_mm", "y_mm"} or ("position_mm" in shown and rng.random() < 0.7):
        shown.add("position_mm")
        positions = np.round(positions + rng.uniform(-0.6, 0.6, size=(count, 2)) * min(h, 1.5 * r_t), 2)
    hours = _times(rng, count)
    used = np.exp(rng.uniform(np.log(10.0), np.log(3e4), size=sensors))
    step = rng.exponential(1.0, size=count) * np.exp(rng.uniform(np.log(30.0), np.log(3e3)))
    cycles = np.array([used[s] + step[: i + 1][which[: i + 1] == s].sum() for i, s in enumerate(which)])
    amplitude = float(np.round(0.06 * loads.min(), 4))
    ladder = amplitude * (np.array([0.3, 0.6, 1.0, 2.0, 4.0]) if "dynamic_force_n" in shown else np.ones(1))
    previous = np.concatenate([[np.nan], loads[:-1]])
    values: dict[str, Array] = {
        "preload_n": loads,
        "indenter_radius_mm": radii[sphere],
        "dynamic_force_n": np.asarray(rng.permutation(np.resize(ladder, count))),
        "load_cycles": np.round(cycles),
        "dwell_s": np.asarray(rng.choice([2.0, 5.0, 10.0, 20.0, 60.0, 120.0, 300.0, 600.0], size=count)),
        "x_mm": positions[:, 0],
        "y_mm": positions[:, 1],
        "recorded_at": hours,
        "time_of_day": np.asarray(hours % 24.0),
        "order": np.arange(count, dtype=np.float64),
        "previous_preload_n": previous,
    }
    columns = {n: Column(v, logarithmic=n in LOGARITHMIC) for n, v in values.items()}
    columns["sensor"] = Column(which.astype(np.float64), words=tuple(f"s{i + 1:02d}" for i in range(sensors)))
    wanted = [n for n in (*NUMBERS, *WORDS) if n in needs]
    if rng.random() < 0.45:
        spare = [n for n in (*NUMBERS, *WORDS) if n not in wanted]
        wanted += list(rng.choice(spare, size=int(rng.integers(1, 4)), replace=False))
    for name in wanted:
        if name in WORDS:
            codes = rng.integers(0, len(WORDS[name]), size=count)
            if rng.random() < 0.3:
                codes = np.sort(codes)
            columns[name] = Column(np.asarray(codes, dtype=np.float64), words=WORDS[name])
        else:
            columns[name] = Column(_number(rng, name, hours))
    strain = finite_strain_shift(loads, radii[sphere], modulus) / noise.gain
    return Design(
        thickness_mm=h,
        modulus_mpa=modulus,
        sensor_radius_mm=r_t,
        sensor_xy=xy,
        sensor=which,
        columns=columns,
        frequency_hz=np.geomspace(1.0, float(rng.choice([130.0, 200.0, 400.0, 800.0])), int(rng.integers(20, 37))),
        noise=noise,
        day=int(rng.integers(0, 2500)),
        finite_strain_chi2=float(((strain - strain.mean()) ** 2).sum()),
        conditions=tuple(sorted(wanted)),
        shown=tuple(sorted(shown)),
        coherence=bool(rng.random() < 0.7),
    )


def draw_design(rng: Generator, needs: frozenset[str] = frozenset(), careful: bool = True) -> Design:
    """A design that has the axes in `needs` and in which large strain is invisible."""
    while True:
        design = _plan(rng, needs, careful)
        load = float(np.max(design.value("preload_n")))
        if design.finite_strain_chi2 <= FINITE_STRAIN_CHI2 and 0.2 < load < 60.0:
            return design


def add_random_columns(rng: Generator, design: Design, count: int) -> Design:
    """`count` further columns of irrelevant conditions: numbers, drifting numbers, or words."""
    columns, names = dict(design.columns), list(design.conditions)
    for index in range(count):
        name = f"note_{index + 1:02d}"
        kind = rng.choice(["number", "drift", "word"])
        if kind == "word":
            words = tuple(f"w{i}" for i in range(int(rng.integers(2, 5))))
            columns[name] = Column(rng.integers(0, len(words), size=design.count).astype(np.float64), words=words)
        else:
            steps = rng.standard_normal(design.count)
            columns[name] = Column(np.round(np.cumsum(steps) if kind == "drift" else 5.0 + steps, 3))
        names.append(name)
    return replace(design, columns=columns, conditions=tuple(sorted(names)))


def axes(design: Design) -> tuple[str, ...]:
    """The axes on which something varies and that a reader of the file can see."""
    hidden = {"dynamic_force_n"} & ({"dynamic_force_n"} - set(design.shown))
    hidden |= {n for n in ("load_cycles", "dwell_s") if n not in design.shown}
    if "recorded_at" not in design.shown:
        hidden |= {"recorded_at", "time_of_day"}
    visible_columns = [n for n in design.columns if n not in hidden]
    return tuple(n for n in visible_columns if np.unique(np.nan_to_num(design.value(n))).size > 1)
