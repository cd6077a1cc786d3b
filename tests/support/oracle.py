"""The exact values beside the repository (`UNDERSKIN_ORACLE`), computed independently of this project."""

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from underskin.units import Floats

NEEDS_ORACLE = pytest.mark.skipif(
    "UNDERSKIN_ORACLE" not in os.environ, reason="UNDERSKIN_ORACLE does not name the folder of exact values"
)


def linear_layer_values(quantity: str) -> tuple[Floats, Floats, Floats, Floats]:
    """rt_over_h, a_over_h, offset_over_h and value of the bonded, incompressible rows of one quantity."""
    with (Path(os.environ["UNDERSKIN_ORACLE"]) / "linear_layer.csv").open(newline="") as file:
        rows = [
            row
            for row in csv.DictReader(file)
            if row["quantity"] == quantity
            and row["poisson_ratio"] == "0.5"
            and row["glue_stiffness_h_over_2g"] == "inf"
        ]
    names = ("rt_over_h", "a_over_h", "offset_over_h", "value")
    rho, a, offset, value = (np.array([float(row[name] or "nan") for row in rows]) for name in names)
    return rho, a, offset, value
