"""How often the d33 of the rig's time series lies within the interval that the inversion states."""

from typing import Any

import numpy as np

from rig.description import parse as experiment
from rig.output import campaign_of_series
from rig.time_domain import record_series
from underskin.inversion import invert
from underskin.recordings import campaign
from underskin.surrogate.sigma_table import SigmaTable


def description(number: int) -> dict[str, Any]:
    """Run `number`: the base model alone; d33, the rig's scatter and the electronics' noise differ."""
    random = np.random.default_rng([number, 99])
    return {
        "schema": "experiment/1",
        "name": f"run {number}",
        "seed": number,
        "skin": {
            "thickness_mm": 2.5,
            "youngs_modulus_mpa": 16.0,
            "sensor_radius_mm": 1.5,
            "d33_pc_per_n": float(random.uniform(8, 30)),
            "array": {"columns": 2, "rows": 1, "pitch_mm": 8.0},
        },
        "design": {"indenters_mm": [4.0, 10.0], "preloads_n": [0.5, 1.0, 3.0], "dynamic_forces_n": [0.09]},
        "drive": {
            "kind": "random",
            "low_hz": 2.0,
            "high_hz": 400.0,
            "sample_rate_hz": 1024.0,
            "duration_s": 4.0,
            "charge_noise_pc": float(np.exp(random.uniform(np.log(0.002), np.log(0.02)))),
        },
        "noise": {
            "gain": float(np.exp(random.uniform(np.log(0.01), np.log(0.05)))),
            "position_mm": float(random.uniform(0.05, 0.3)) if random.random() < 0.3 else 0.0,
        },
    }


def covered(number: int, table: SigmaTable) -> tuple[bool, float]:
    """Whether the interval of the array's d33 holds the rig's, and by how many of its uncertainties it is off."""
    planned = experiment(description(number))
    recorded = campaign.parse(campaign_of_series(*record_series(planned)))
    found = invert.invert(recorded, table).campaign_d33
    assert found is not None
    true = 1e-12 * planned.skin.d33_pc_per_n
    return bool(found.low <= true <= found.high), float((found.value - true) / found.uncertainty)
