"""The exact values beside the repository (`UNDERSKIN_ORACLE`), computed independently of this project.

A test that asks for them is skipped where the folder is not named.
"""

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from underskin.units import Floats


def _rows(name: str) -> list[dict[str, str]]:
    """As texts by the names in the file's header."""
    folder = os.environ.get("UNDERSKIN_ORACLE")
    if not folder:
        pytest.skip("UNDERSKIN_ORACLE does not name the folder of exact values")
    with (Path(folder) / name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def layer_rows(*quantities: str, **fixed: str) -> list[dict[str, str]]:
    """Of the linear layer; κ is twice `glue_stiffness_h_over_2g`."""
    return [
        row
        for row in _rows("linear_layer.csv")
        if row["quantity"] in quantities and all(row[name] == value for name, value in fixed.items())
    ]


def sphere_rows() -> list[dict[str, float]]:
    """Of a sphere on the bonded, incompressible layer."""
    return [{name: float(value) for name, value in row.items()} for row in _rows("sphere_on_layer.csv")]


def linear_layer_values(quantity: str) -> tuple[Floats, Floats, Floats, Floats]:
    """rt_over_h, a_over_h, offset_over_h and value of the bonded, incompressible rows of one quantity."""
    rows = layer_rows(quantity, poisson_ratio="0.5", glue_stiffness_h_over_2g="inf")
    names = ("rt_over_h", "a_over_h", "offset_over_h", "value")
    rho, a, offset, value = (np.array([float(row[name] or "nan") for row in rows]) for name in names)
    return rho, a, offset, value
