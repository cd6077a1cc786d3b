"""The experiment as its description (`experiment/1`, YAML or JSON) states it, in the lab's units: mm, N, MPa, pC, Hz.

These units fit together (N = MPa mm²), so the rig computes in them.
"""

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

from rig import checks, effects, feasible
from rig.effects import COMPRESSION, FRF, INDENTATION
from rig.errors import RigError

SCHEMA = "experiment/1"
MOST_RECORDINGS = 5000


@dataclass(frozen=True)
class Skin:
    """The skin as declared; `sensors` holds id and centre. d33 is the true one, told in the truth alone."""

    thickness_mm: float
    youngs_modulus_mpa: float
    sensor_radius_mm: float
    d33_pc_per_n: float
    sensors: tuple[tuple[str, float, float], ...]
    id: str | None = None
    width_mm: float | None = None
    length_mm: float | None = None


@dataclass(frozen=True)
class Design:
    """What is recorded: every combination of the lists; dwell times and dynamic forces are dealt out at random."""

    indenters_mm: tuple[float, ...] = (4.0,)
    preloads_n: tuple[float, ...] = (1.0,)
    dynamic_forces_n: tuple[float, ...] = (0.09,)
    offsets_mm: tuple[tuple[float, float], ...] = ((0.0, 0.0),)  # commanded, from the sensor's centre
    sensors: tuple[str, ...] = ()  # all of them where empty
    repeats: int = 1
    dwells_s: tuple[float, ...] = ()
    cycles_per_recording: float | None = None
    start: str | None = None  # time of the first recording
    minutes_per_recording: float = 5.0
    shuffled: bool = False
    most_recordings: int | None = None


@dataclass(frozen=True)
class Lines:
    """FRF lines, evenly spaced in the logarithm of the frequency."""

    low_hz: float
    high_hz: float
    count: int


@dataclass(frozen=True)
class Drive:
    """Time series: what the shaker does, and the electronics."""

    kind: str = "random"
    low_hz: float = 1.0
    high_hz: float = 130.0
    sample_rate_hz: float = 2048.0
    duration_s: float = 16.0
    steps: int = 20  # of the stepped sine
    charge_noise_pc: float = 0.005  # rms, white, over the whole band
    flicker_corner_hz: float = 1.0
    force_noise_n: float = 1e-5
    converter_bits: int = 24
    charge_range_pc: float = 500.0
    force_range_n: float = 20.0


@dataclass(frozen=True)
class Noise:
    """Gain and position scatter a recording; noise of FRF lines: rel² |G|² + floor² on each part.

    rel = `line` · (1 + `low` (low end)/f + `high` (f/(high end))²).
    """

    gain: float = 0.02
    position_mm: float = 0.0
    line: float = 0.01
    low: float = 0.5
    high: float = 0.5
    floor_pc_per_n: float = 0.02
    averages: float = 16.0
    coherence: bool = True


@dataclass(frozen=True)
class Curves:
    """Force–displacement curves of the elastomer, kinds indentation and compression."""

    indenters_mm: tuple[float, ...] = (4.0,)
    heights_mm: tuple[float, ...] = (10.0,)
    diameters_mm: tuple[float, ...] = (20.0,)
    largest_displacement_mm: float = 0.5
    tension: bool = False  # a compression machine also pulls
    samples: int = 200
    speeds_mm_per_s: tuple[float, ...] = (0.1,)
    repeats: int = 1
    hold_s: float = 0.0
    force_noise_n: float = 1e-3
    displacement_noise_mm: float = 0.0
    contact_point_mm: float = 0.02  # scatter of the zero of displacement
    modulus_declared: bool = True
    times: bool = True


@dataclass(frozen=True)
class Experiment:
    """A whole experiment; `document` is the description that it came from."""

    name: str
    seed: int
    kind: str
    skin: Skin
    design: Design
    lines: Lines | None
    drive: Drive | None
    curves: Curves | None
    noise: Noise
    effects: dict[str, effects.Values]
    document: Mapping[str, Any] = field(repr=False)


_RANGES: dict[str, tuple[float, float]] = {
    "thickness_mm": (0.05, 100), "youngs_modulus_mpa": (1e-3, 1e4), "sensor_radius_mm": (0.05, 50),
    "d33_pc_per_n": (-5000, 5000), "width_mm": (0.1, 1e4), "length_mm": (0.1, 1e4),
    "indenters_mm": (0.05, 200), "preloads_n": (1e-6, 1e4), "dynamic_forces_n": (1e-6, 1e3), "dwells_s": (0, 1e7),
    "cycles_per_recording": (0, 1e9), "minutes_per_recording": (0, 1e5),
    "low_hz": (1e-3, 1e6), "high_hz": (1e-3, 1e6), "sample_rate_hz": (1, 1e6), "duration_s": (1e-3, 3600),
    "charge_noise_pc": (0, 1e6), "flicker_corner_hz": (0, 1e5), "force_noise_n": (0, 100),
    "charge_range_pc": (1e-6, 1e9), "force_range_n": (1e-6, 1e6),
    "gain": (0, 0.5), "position_mm": (0, 10), "line": (0, 1), "low": (0, 100), "high": (0, 100),
    "floor_pc_per_n": (0, 1e3), "averages": (1, 1e6),
    "heights_mm": (0.1, 1e3), "diameters_mm": (0.1, 1e3), "largest_displacement_mm": (1e-4, 500),
    "speeds_mm_per_s": (1e-6, 1e4), "hold_s": (0, 1e6), "displacement_noise_mm": (0, 10), "contact_point_mm": (0, 10),
}  # fmt: skip
_COUNTS = {
    "repeats": (1, 1000),
    "most_recordings": (1, MOST_RECORDINGS),
    "count": (1, 10000),
    "steps": (1, 200),
    "converter_bits": (8, 32),
    "samples": (10, 100000),
}


def parse(document: Any) -> Experiment:
    """The experiment of a description; raises RigError that names the field, the value and what is allowed."""
    known = ("schema", "name", "seed", "kind", "skin", "design", "lines", "drive", "curves", "noise", "effects")
    given = checks.mapping("experiment", document, known)
    checks.one_of("schema", given.get("schema"), (SCHEMA,))
    kind = checks.one_of("kind", given.get("kind", FRF), (FRF, INDENTATION, COMPRESSION))
    for name in ("lines", "drive", "design") if kind != FRF else ("curves",):
        if name in given:
            raise RigError(name, given[name], f"not for recordings of kind {kind}")
    lines = _part(Lines, "lines", given["lines"]) if "lines" in given else None
    drive = _part(Drive, "drive", given["drive"]) if "drive" in given else None
    curves = _part(Curves, "curves", given.get("curves", {})) if kind != FRF else None
    if kind == FRF and (lines is None) == (drive is None):
        raise RigError("lines", given.get("lines"), "give either lines (FRF) or drive (time series)")
    for band, part in (("lines", lines), ("drive", drive)):
        if part is not None and not part.low_hz < part.high_hz:
            raise RigError(f"{band}.high_hz", part.high_hz, f"must be above low_hz, {part.low_hz:g} Hz")
    if drive is not None:
        checks.one_of("drive.kind", drive.kind, ("random", "sweep", "stepped_sine"))
        checks.number("drive.high_hz", drive.high_hz, 0, drive.sample_rate_hz / 2.56)
        checks.number(
            "drive.samples (duration_s · sample_rate_hz)", drive.duration_s * drive.sample_rate_hz, 256, 2**24
        )
    skin = _skin(given.get("skin"))
    design = _part(Design, "design", given.get("design", {}))
    for index, name in enumerate(design.sensors):
        checks.one_of(f"design.sensors[{index}]", name, [sensor[0] for sensor in skin.sensors])
    if kind == FRF:
        feasible.check_skin(skin)
        feasible.check_presses(design, skin)
    return Experiment(
        name=checks.text("name", given.get("name")),
        seed=checks.whole("seed", given.get("seed", 0), 0, 2**63 - 1),
        kind=kind,
        skin=skin,
        design=design,
        lines=lines,
        drive=drive,
        curves=curves,
        noise=_part(Noise, "noise", given.get("noise", {})),
        effects=effects.checked(kind, given.get("effects", {})),
        document=given,
    )


def _part(model: Any, prefix: str, document: Any) -> Any:
    """A dataclass from its part of the description; every field is checked by its name or its default."""
    entries = fields(model)
    given = checks.mapping(prefix, document, [entry.name for entry in entries])
    values = {}
    for entry in entries:
        path = f"{prefix}.{entry.name}"
        if given.get(entry.name) is not None:
            values[entry.name] = _value(entry.name, path, given[entry.name], str(entry.type))
        elif entry.default is MISSING:
            raise RigError(path, None, "required")
    return model(**values)


def _value(name: str, path: str, value: Any, kind: str) -> Any:
    if name == "offsets_mm":
        return tuple(
            checks.pair(f"{path}[{index}]", entry, -1e3, 1e3) for index, entry in enumerate(_list(path, value))
        )
    if name == "sensors":
        return tuple(checks.text(f"{path}[{index}]", entry) for index, entry in enumerate(_list(path, value)))
    if name in _COUNTS:
        return checks.whole(path, value, *_COUNTS[name])
    if "bool" in kind:
        return checks.flag(path, value)
    if "str" in kind:
        return checks.text(path, value)
    return (checks.numbers if kind.startswith("tuple") else checks.number)(path, value, *_RANGES[name])


def _list(path: str, value: Any) -> list[Any]:
    if not isinstance(value, list | tuple) or not value:
        raise RigError(path, value, "must be a list of at least one entry")
    return list(value)


def _skin(document: Any) -> Skin:
    """The skin, its sensors listed or as `array`: columns, rows and pitch_mm."""
    names = [entry.name for entry in fields(Skin)]
    given = dict(checks.mapping("skin", document, [*names, "array"]))
    array = checks.mapping("skin.array", given.pop("array", {}), ("columns", "rows", "pitch_mm"))
    if array and "sensors" in given:
        raise RigError("skin.array", dict(array), "give either array or sensors")
    if "sensors" in given:
        sensors = tuple(_sensor(index, entry) for index, entry in enumerate(_list("skin.sensors", given["sensors"])))
    else:
        columns, rows = (checks.whole(f"skin.array.{name}", array.get(name, 1), 1, 64) for name in ("columns", "rows"))
        pitch = checks.number("skin.array.pitch_mm", array.get("pitch_mm", 8.0), 0.1, 1e3)
        sensors = tuple(
            (f"s{row * columns + column + 1:02d}", pitch * column, pitch * row)
            for row in range(rows)
            for column in range(columns)
        )
    values: dict[str, Any] = {"sensors": sensors}
    for name in names:
        if name == "sensors" or (given.get(name) is None and name in ("id", "width_mm", "length_mm")):
            continue
        path = f"skin.{name}"
        if given.get(name) is None:
            raise RigError(path, None, "required")
        values[name] = (
            checks.text(path, given[name]) if name == "id" else checks.number(path, given[name], *_RANGES[name])
        )
    return Skin(**values)


def _sensor(index: int, document: Any) -> tuple[str, float, float]:
    path = f"skin.sensors[{index}]"
    given = checks.mapping(path, document, ("id", "x_mm", "y_mm"))
    x, y = (checks.number(f"{path}.{name}", given.get(name), -1e3, 1e3) for name in ("x_mm", "y_mm"))
    return checks.text(f"{path}.id", given.get("id")), x, y
