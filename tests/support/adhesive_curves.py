"""Two spheres on an elastomer that sticks, as the virtual rig records them, with what is true of each."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import plotly.graph_objects as go

from rig.description import parse
from rig.elastomer import campaign_of_curves, record_curves
from tests.support.lean_reports import beside
from tests.support.report_pages import figures_in, written

WORK_J_PER_M2, MODULUS_MPA, NOISE_N = 0.6, 0.5, 2e-4
_DESCRIPTION: dict[str, Any] = {
    "schema": "experiment/1", "name": "curves", "seed": 3, "kind": "indentation",
    "skin": {"thickness_mm": 8.0, "youngs_modulus_mpa": MODULUS_MPA, "sensor_radius_mm": 1.5, "d33_pc_per_n": 14.0},
    "curves": {
        "indenters_mm": [2.5, 4.0], "largest_displacement_mm": 0.6, "samples": 2000, "force_noise_n": NOISE_N,
        "contact_point_mm": 0.0,
    },
}  # fmt: skip


@dataclass(frozen=True)
class Truth:
    """The surfaces meet at displacement 0; the first and the last sample in contact."""

    first: int
    last: int


@cache
def adhesive_curves(work_j_per_m2: float = WORK_J_PER_M2) -> tuple[dict[str, Any], dict[str, Truth]]:
    """The campaign (`campaign/1`), and of each recording the truth."""
    experiment = parse(_DESCRIPTION | {"effects": {"adhesion": {"work_j_per_m2": work_j_per_m2}}})
    recorded = record_curves(experiment)
    truth = {}
    for curve in recorded:
        touching = np.flatnonzero(curve.exact_force_n)
        truth[curve.entry["id"]] = Truth(int(touching[0]), int(touching[-1]))
    return campaign_of_curves(experiment, recorded), truth


@cache
def adhesive_page() -> tuple[dict[str, Any], str]:
    """Their report, with Hertz's law before and adhesion after, and its page."""
    return written([adhesive_curves()[0]], without=beside("adhesion", "instrument_compliance"))


@cache
def adhesive_figure() -> go.Figure:
    """Of both curves."""
    return figures_in(adhesive_page()[1])["curve"]
