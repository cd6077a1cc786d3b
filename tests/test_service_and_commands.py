"""Server and command line answer the same columns: one set of checks, for good rows and for bad ones."""

import csv
import io
import math
import subprocess
from typing import Any

import httpx
import pytest

from tests.cli.commands import run

SKIN = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5, "indenter_radius_mm": 4.0}
FRF = {**SKIN, "preload_n": 1.0, "d33_pc_per_n": 14.0}
D33 = {**SKIN, "preload_n": 1.0, "frf_pc_per_n": 7.0, "frf_uncertainty_pc_per_n": 0.1}


def as_csv(columns: dict[str, Any]) -> str:
    count = max(len(values) if isinstance(values, list) else 1 for values in columns.values())
    lists = [values if isinstance(values, list) else [values] * count for values in columns.values()]
    return "\n".join(",".join(map(str, line)) for line in (columns, *zip(*lists, strict=True))) + "\n"


def by_command(command: str, columns: dict[str, Any], *options: str) -> subprocess.CompletedProcess[str]:
    return run(command, "--input", "-", "--csv", *options, given=as_csv(columns))


def columns_of(text: str) -> dict[str, list[str]]:
    header, *lines = csv.reader(io.StringIO(text))
    return dict(zip(header, map(list, zip(*lines, strict=True)), strict=True))


@pytest.mark.parametrize(
    ("command", "columns"),
    [
        ("frf", {**FRF, "preload_n": [0.5, 1.0, 3.0]}),
        ("frf", {**FRF, "preload_n": [1.0, 300.0]}),  # outside the table
        ("frf", {**FRF, "poisson_ratio": [0.5, 0.4]}),
        ("d33", {**D33, "frf_pc_per_n": [6.8, -6.9]}),
        ("d33", {name: values for name, values in D33.items() if name != "frf_uncertainty_pc_per_n"}),
        ("d33", {**D33, "frf_pc_per_n": [7.0, 7e12]}),  # far too large, and used
        ("d33", {**D33, "preload_n": [1.0, 300.0]}),
    ],
)
def test_rows_are_answered_alike(http: httpx.Client, command: str, columns: dict[str, Any]) -> None:
    headers = {"Content-Type": "text/csv", "Accept": "text/csv"}
    answer = http.post(f"/v1/{command}", content=as_csv(columns), headers=headers)
    assert answer.status_code == 200, answer.text
    done = by_command(command, columns)
    assert done.returncode == 0, done.stderr
    by_server, told = columns_of(answer.text), columns_of(done.stdout)
    assert by_server.keys() <= told.keys()
    assert {name: told[name] for name in by_server} == by_server


def test_a_result_that_is_not_finite_is_outside_for_both(http: httpx.Client) -> None:
    columns = {**D33, "frf_pc_per_n": [7.0, 1e308], "sensor_radius_mm": 0.05}
    answer = http.post("/v1/d33", json={**columns, "units_checked": True})
    assert answer.status_code == 200, answer.text
    done = by_command("d33", columns, "--units-checked")
    assert answer.json()["status"] == columns_of(done.stdout)["status"] == ["ok", "out_of_domain"]


@pytest.mark.parametrize(
    ("command", "columns", "field"),
    [
        ("frf", {**FRF, "preload_n": [1.0, -1.0]}, "preload_n"),
        ("frf", {**FRF, "d33_pc_per_n": [14.0, 0.0]}, "d33_pc_per_n"),
        ("frf", {**FRF, "d33_pc_per_n": [14.0, math.nan]}, "d33_pc_per_n"),
        ("frf", {**FRF, "thickness_mm": [2.5, 2500.0]}, "thickness_mm"),
        ("d33", {**D33, "frf_pc_per_n": [7.0, math.nan]}, "frf_pc_per_n"),
        ("d33", {**D33, "frf_pc_per_n": [7.0, math.inf]}, "frf_pc_per_n"),
        ("d33", {**D33, "frf_uncertainty_pc_per_n": [0.1, -0.1]}, "frf_uncertainty_pc_per_n"),
        ("d33", {**D33, "frf_uncertainty_pc_per_n": [math.nan, math.nan]}, "frf_uncertainty_pc_per_n"),
    ],
)
def test_rows_are_refused_alike(http: httpx.Client, command: str, columns: dict[str, Any], field: str) -> None:
    answer = http.post(f"/v1/{command}", content=as_csv(columns), headers={"Content-Type": "text/csv"})
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["field"] == field
    done = by_command(command, columns)
    assert done.returncode != 0
    assert done.stderr.strip().removeprefix("underskin: ") == answer.json()["detail"]
