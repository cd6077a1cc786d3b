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


def oracle_rows(name: str) -> list[dict[str, str]]:
    """The rows of one file, as texts by the names in its header; a test is skipped where the folder is not named."""
    folder = os.environ.get("UNDERSKIN_ORACLE")
    if not folder:
        pytest.skip("UNDERSKIN_ORACLE does not name the folder of exact values")
    with (Path(folder) / name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def linear_layer_values(quantity: str) -> tuple[Floats, Floats, Floats, Floats]:
    """rt_over_h, a_over_h, offset_over_h and value of the bonded, incompressible rows of one quantity."""
    rows = [
        row
        for row in oracle_rows("linear_layer.csv")
        if row["quantity"] == quantity and row["poisson_ratio"] == "0.5" and row["glue_stiffness_h_over_2g"] == "inf"
    ]
    names = ("rt_over_h", "a_over_h", "offset_over_h", "value")
    rho, a, offset, value = (np.array([float(row[name] or "nan") for row in rows]) for name in names)
    return rho, a, offset, value
