"""The campaigns on which diagnoses are measured: our rig presses two spheres on sensors of the prototype's skin."""

from collections.abc import Mapping, Sequence
from typing import Any

from rig.description import parse as experiment
from rig.recorded import campaign, record_lines
from underskin.recordings.campaign import Campaign, parse

Effects = Mapping[str, Mapping[str, float | str]]


def recorded(
    effects: Effects, *, columns: int, preloads_n: Sequence[float], lines: int, position_mm: float = 0.0
) -> Campaign:
    """2 × `columns` × preloads recordings of `lines` lines each, beside the sensor's centre if positions scatter."""
    return parse(document(effects, columns=columns, preloads_n=preloads_n, lines=lines, position_mm=position_mm))


def document(
    effects: Effects, *, columns: int, preloads_n: Sequence[float], lines: int, position_mm: float = 0.0, seed: int = 5
) -> dict[str, Any]:
    """The same as `campaign/1`."""
    description = {
        "schema": "experiment/1",
        "name": "bench",
        "seed": seed,
        "kind": "frf",
        "skin": {
            "thickness_mm": 2.5,
            "youngs_modulus_mpa": 16,
            "sensor_radius_mm": 1.5,
            "d33_pc_per_n": 14,
            "array": {"columns": columns, "rows": 1, "pitch_mm": 8},
        },
        "design": {
            "indenters_mm": [4, 10],
            "preloads_n": list(preloads_n),
            "dynamic_forces_n": [0.09],
            "offsets_mm": [[1.2, 0.0] if position_mm else [0.0, 0.0]],
            "cycles_per_recording": 50,
        },
        "lines": {"low_hz": 1, "high_hz": 1000, "count": lines},
        "noise": {"gain": 0.02, "line": 0.01, "averages": 16, "position_mm": position_mm},
        "effects": effects,
    }
    return campaign(record_lines(experiment(description)))
