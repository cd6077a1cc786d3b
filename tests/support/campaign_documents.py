"""Campaign documents with every field, one recording of a kind."""

from typing import Any

SKIN: dict[str, Any] = {
    "id": "palm-3",
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "poisson_ratio": 0.5,
    "sensor_radius_mm": 1.5,
    "d33_pc_per_n": None,
    "width_mm": 20.0,
    "length_mm": 40.0,
    "sensors": [{"id": "s01", "x_mm": 0.0, "y_mm": 0.0}, {"id": "s02", "x_mm": 8.0, "y_mm": -8.0}],
}
FRF: dict[str, Any] = {
    "id": "r1",
    "sensor": "s01",
    "indenter_radius_mm": 4.0,
    "preload_n": 1.0,
    "dynamic_force_n": 0.09,
    "recorded_at": "2017-05-03T09:00:00Z",
    "load_cycles": 12000,
    "dwell_s": 0.0,
    "position_mm": [0.0, 0.0],
    "frequency_hz": [10.0, 20.0, 30.0],
    "frf_re_pc_per_n": [7.1, 7.2, 7.0],
    "frf_im_pc_per_n": [-0.5, -0.6, -0.7],
    "coherence": [0.99, 1.0, 0.0],
}
TIME_SERIES: dict[str, Any] = {
    **{name: FRF[name] for name in ("sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n")},
    "id": "r2",
    "sample_rate_hz": 1000.0,
    "force_n": [1.0, 1.1, 0.9, 1.0],
    "charge_pc": [0.0, 0.7, -0.7, 0.0],
    "estimator": "Hv",
}
INDENTATION: dict[str, Any] = {
    "id": "r3",
    "kind": "indentation",
    "indenter_radius_mm": 2.5,
    "displacement_mm": [0.0, 0.1, 0.05],
    "force_n": [0.0, 0.2, -0.01],
    "time_s": [0.0, 1.0, 1.0],
}
COMPRESSION: dict[str, Any] = {
    "id": "r4",
    "kind": "compression",
    "sample_height_mm": 10.0,
    "sample_diameter_mm": 20.0,
    "displacement_mm": [0.0, -0.1],
    "force_n": [0.0, -3.0],
}


def document(*recordings: Any, **changes: Any) -> dict[str, Any]:
    skin = {**SKIN, **changes.pop("skin", {})}
    return {"schema": "campaign/1", "name": "c", "skin": skin, "recordings": list(recordings), **changes}


EVERYTHING = document(FRF, TIME_SERIES, INDENTATION, COMPRESSION, units_checked=True)
