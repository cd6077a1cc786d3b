"""Reads the description of an experiment (`experiment/1`, YAML or JSON) and checks every field of it."""

from dataclasses import MISSING, fields
from typing import Any

from rig import checks, effects, feasibility
from rig.effects import COMPRESSION, FRF, INDENTATION
from rig.errors import RigError
from rig.experiment import (
    MOST_RECORDINGS,
    SCHEMA,
    CurveDesign,
    DeclaredSkin,
    Drive,
    Experiment,
    LineGrid,
    Noise,
    RecordingDesign,
)

_RANGES: dict[str, tuple[float, float]] = {
    "thickness_mm": (1e-3, 100), "youngs_modulus_mpa": (1e-3, 1e4), "sensor_radius_mm": (0.05, 50),
    "d33_pc_per_n": (-5000, 5000), "width_mm": (0.1, 1e4), "length_mm": (0.1, 1e4),
    "indenters_mm": (1e-3, 200), "preloads_n": (1e-6, 1e4), "dynamic_forces_n": (1e-6, 1e3), "dwells_s": (0, 1e7),
    "cycles_per_recording": (0, 1e9), "minutes_per_recording": (0, 1e5),
    "low_hz": (1e-3, 1e6), "high_hz": (1e-3, 1e6), "sample_rate_hz": (1, 1e6), "duration_s": (1e-3, 3600),
    "charge_noise_pc": (0, 1e6), "flicker_corner_hz": (0, 1e5), "force_noise_n": (0, 100),
    "charge_range_pc": (1e-6, 1e9), "force_range_n": (1e-6, 1e6),
    "gain": (0, 0.5), "position_mm": (0, 10), "line": (0, 1), "low": (0, 100), "high": (0, 100),
    "floor_pc_per_n": (0, 1e3), "averages": (1, 1e6),
    "heights_mm": (0.1, 1e3), "diameters_mm": (0.1, 1e3), "largest_displacement_mm": (1e-6, 500),
    "speeds_mm_per_s": (1e-7, 1e4), "hold_s": (0, 1e6), "displacement_noise_mm": (0, 10), "contact_point_mm": (0, 100),
    "modulus_scatter": (0, 0.5), "approach_mm": (0, 1e3), "retreat_mm": (0, 1e3),
    "stage_stiffness_n_per_mm": (1e-6, 1e6), "cell_gain": (0, 0.5), "force_zero_n": (0, 1e3),
    "drift_n_per_s": (0, 100), "drift_n_per_mm": (0, 1e3), "force_step_n": (0, 100), "displacement_step_mm": (0, 10),
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
    allowed = ("schema", "name", "seed", "kind", "skin", "design", "lines", "drive", "curves", "noise", "effects")
    entries = checks.mapping("experiment", document, allowed)
    checks.choice("schema", entries.get("schema"), (SCHEMA,))
    kind = checks.choice("kind", entries.get("kind", FRF), (FRF, INDENTATION, COMPRESSION))
    for name in ("lines", "drive", "design") if kind != FRF else ("curves",):
        if name in entries:
            raise RigError(name, entries[name], f"not for recordings of kind {kind}")
    lines = _part(LineGrid, "lines", entries["lines"]) if "lines" in entries else None
    drive = _part(Drive, "drive", entries["drive"]) if "drive" in entries else None
    curves = _part(CurveDesign, "curves", entries.get("curves", {})) if kind != FRF else None
    if kind == FRF and (lines is None) == (drive is None):
        raise RigError("lines", entries.get("lines"), "give either lines (FRF) or drive (time series)")
    for band, part in (("lines", lines), ("drive", drive)):
        if part is not None and not part.low_hz < part.high_hz:
            raise RigError(f"{band}.high_hz", part.high_hz, f"must be above low_hz, {part.low_hz:g} Hz")
    if drive is not None:
        checks.choice("drive.kind", drive.kind, ("random", "sweep", "stepped_sine"))
        checks.number("drive.high_hz", drive.high_hz, 0, drive.sample_rate_hz / 2.56)
        checks.number(
            "drive.samples (duration_s · sample_rate_hz)", drive.duration_s * drive.sample_rate_hz, 256, 2**24
        )
    skin = _skin(entries.get("skin"))
    design = _part(RecordingDesign, "design", entries.get("design", {}))
    for index, name in enumerate(design.sensors):
        checks.choice(f"design.sensors[{index}]", name, [sensor[0] for sensor in skin.sensors])
    if kind == FRF:
        feasibility.check_skin(skin)
        feasibility.check_presses(design, skin)
    return Experiment(
        name=checks.text("name", entries.get("name")),
        seed=checks.integer("seed", entries.get("seed", 0), 0, 2**63 - 1),
        kind=kind,
        skin=skin,
        design=design,
        lines=lines,
        drive=drive,
        curves=curves,
        noise=_part(Noise, "noise", entries.get("noise", {})),
        effects=effects.checked(kind, entries.get("effects", {})),
        document=entries,
    )


def _part(model: Any, prefix: str, document: Any) -> Any:
    """A dataclass from its part of the description; every field is checked by its name or its default."""
    entries = fields(model)
    values_given = checks.mapping(prefix, document, [part_field.name for part_field in entries])
    values = {}
    for part_field in entries:
        path = f"{prefix}.{part_field.name}"
        if values_given.get(part_field.name) is not None:
            values[part_field.name] = _value(part_field.name, path, values_given[part_field.name], str(part_field.type))
        elif part_field.default is MISSING:
            raise RigError(path, None, "required")
    return model(**values)


def _value(name: str, path: str, value: Any, kind: str) -> Any:
    if name == "offsets_mm":
        return tuple(
            checks.pair(f"{path}[{index}]", corner, -1e3, 1e3) for index, corner in enumerate(_list(path, value))
        )
    if name == "sensors":
        return tuple(checks.text(f"{path}[{index}]", element) for index, element in enumerate(_list(path, value)))
    if name in _COUNTS:
        return checks.integer(path, value, *_COUNTS[name])
    if "bool" in kind:
        return checks.flag(path, value)
    if "str" in kind:
        return checks.text(path, value)
    return (checks.numbers if kind.startswith("tuple") else checks.number)(path, value, *_RANGES[name])


def _list(path: str, value: Any) -> list[Any]:
    if not isinstance(value, list | tuple) or not value:
        raise RigError(path, value, "must be a list of at least one entry")
    return list(value)


def _skin(document: Any) -> DeclaredSkin:
    """The skin, its sensors listed or as `array`: columns, rows and pitch_mm."""
    names = [skin_field.name for skin_field in fields(DeclaredSkin)]
    given = dict(checks.mapping("skin", document, [*names, "array"]))
    array = checks.mapping("skin.array", given.pop("array", {}), ("columns", "rows", "pitch_mm"))
    if array and "sensors" in given:
        raise RigError("skin.array", dict(array), "give either array or sensors")
    if "sensors" in given:
        sensors = tuple(_sensor(index, sensor) for index, sensor in enumerate(_list("skin.sensors", given["sensors"])))
    else:
        columns, rows = (
            checks.integer(f"skin.array.{name}", array.get(name, 1), 1, 64) for name in ("columns", "rows")
        )
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
    return DeclaredSkin(**values)


def _sensor(index: int, document: Any) -> tuple[str, float, float]:
    path = f"skin.sensors[{index}]"
    given = checks.mapping(path, document, ("id", "x_mm", "y_mm"))
    x, y = (checks.number(f"{path}.{name}", given.get(name), -1e3, 1e3) for name in ("x_mm", "y_mm"))
    return checks.text(f"{path}.id", given.get("id")), x, y
