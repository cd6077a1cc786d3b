"""Charge on every sensor of an array: over HTTP, in Python and on the command line, and what is refused."""

import csv
import io
import json
import subprocess
import sys
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from service.stress import EXAMPLE
from underskin import Client, layer
from underskin.half_space import stress as half_space_stress
from underskin.influence import load_influence
from underskin.layer import Layer
from underskin.stress_request import answer, read_request

TABLE = load_influence()
COMMAND = Path(sys.executable).with_name("underskin")
Document = dict[str, Any]

SKIN: Document = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "d33_pc_per_n": 14.0,
    "sensors": [{"id": f"s{i}", "x_mm": 8.0 * i, "y_mm": 0.0} for i in range(5)],
}
PRESS: Document = {"x_mm": 8.0, "y_mm": 0.0, "indenter_radius_mm": 4.0, "normal_force_n": 1.0}


def document(*contacts: Document, **fields: Any) -> Document:
    return {**SKIN, "contacts": list(contacts), **fields}


def posted(http: httpx.Client, request: Document) -> Document:
    reply = http.post("/v1/stress", json=request)
    assert reply.status_code == 200, reply.text
    found: Document = reply.json()
    return found


def test_a_centred_sphere_gives_the_frf_times_the_force(http: httpx.Client) -> None:
    """In the linear limit, that is at a small force, where /v1/frf leaves finite strain out too."""
    small = 0.002
    found = posted(http, document({**PRESS, "normal_force_n": small}))
    columns = {name: SKIN[name] for name in ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "d33_pc_per_n")}
    frf = http.post("/v1/frf", json={**columns, "indenter_radius_mm": 4.0, "preload_n": small}).json()
    assert found["charge_pc"][1] / small == pytest.approx(frf["frf_pc_per_n"][0], rel=0.005)
    assert found["sensor"] == ["s0", "s1", "s2", "s3", "s4"]
    assert found["model"] == "linear_layer"
    assert found["table_sha256"] == TABLE.sha256
    assert found["status"] == ["ok"] * 5


def test_charges_are_those_of_the_exact_layer_whatever_the_load(http: httpx.Client) -> None:
    """Two spheres, sheared, over a compressible layer on a glue line that yields."""
    contacts = [
        {**PRESS, "x_mm": 1.0, "y_mm": 2.0, "tangential_force_n": [0.3, -0.2]},
        {**PRESS, "x_mm": 9.0, "y_mm": -1.0, "normal_force_n": 2.0, "tangential_force_n": [-0.5, 0.4]},
    ]
    found = posted(http, document(*contacts, poisson_ratio=0.45, glue_stiffness=5.0))
    exact = Layer(0.45, 1 / 6)
    for number, sensor in enumerate(SKIN["sensors"][:3]):
        total = 0.0
        for contact in contacts:
            away = np.array([contact["x_mm"] - sensor["x_mm"], contact["y_mm"] - sensor["y_mm"]])
            r = float(np.hypot(*away)) / 2.5
            a = np.cbrt(0.75 * contact["normal_force_n"] * 4.0 * (1 - 0.45**2) / 16.0) / 2.5
            outward = float(np.dot(contact["tangential_force_n"], away)) / np.hypot(*away)
            total += contact["normal_force_n"] * float(layer.sigma(exact, a, 0.6, r))
            total -= outward * tangential(exact, a, r)
        assert found["charge_pc"][number] == pytest.approx(14.0 * 1.5 * 0.36 * total, rel=2e-4)


def tangential(exact: Layer, a: float, r: float) -> float:
    """γ_t averaged over the Hertz pressure, along the line of centres."""
    angle, share = np.pi * (np.arange(24) + 0.5) / 24, 1 / 24
    t, weight = np.polynomial.legendre.leggauss(12)
    t, weight = (1 + t) / 2, weight / 2
    radius = a * np.sqrt(1 - t**2)
    x, y = r + np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle))
    distance = np.hypot(x, y)
    values = layer.gamma_t(exact, distance, 0.6) * x / distance
    return float((3 * t**2 * weight) @ values.sum(axis=1) * share)


def test_several_contacts_add_up(http: httpx.Client) -> None:
    first, second = PRESS, {**PRESS, "x_mm": 14.0, "y_mm": 1.0, "tangential_force_n": [0.3, 0.1]}
    both, *alone = (posted(http, document(*contacts)) for contacts in ((first, second), (first,), (second,)))
    for sensor in range(5):
        summed = sum(part["charge_pc"][sensor] for part in alone)
        assert both["charge_pc"][sensor] == pytest.approx(summed, rel=1e-12)


def test_a_soft_thick_skin_is_the_half_space_between_the_walls(http: httpx.Client) -> None:
    """The sign of shear is the half space's: the base of a layer feels the same way."""
    shear = {**PRESS, "x_mm": 11.0, "tangential_force_n": [1.0, 0.0]}
    with_shear, without = (posted(http, document(contact)) for contact in (shear, {**PRESS, "x_mm": 11.0}))
    change = with_shear["mean_stress_mpa"][1] - without["mean_stress_mpa"][1]
    expected = -float(half_space_stress(3.0e-3, 2.5e-3, 0.0, 1.0)) / 1e6  # compression positive
    assert change < 0
    assert change == pytest.approx(expected, rel=0.5)


def test_a_pressure_map_gives_what_its_contact_gives(http: httpx.Client) -> None:
    x = np.linspace(6.5, 9.5, 61)
    a = np.cbrt(0.75 * 4.0 * 0.75 / 16.0)
    inside = np.clip(1 - ((x - 8.0) ** 2 + (x[:, None] - 8.0) ** 2) / a**2, 0, None)
    pressure = np.sqrt(inside)
    pressure /= pressure.sum() * (x[1] - x[0]) ** 2  # 1 N over mm² is MPa
    drawn = {"x_mm": x.tolist(), "y_mm": (x - 8.0).tolist(), "pressure_mpa": pressure.tolist()}
    found = posted(http, {**SKIN, "pressure_map": drawn})
    contact = posted(http, document(PRESS))
    assert found["charge_pc"] == pytest.approx(contact["charge_pc"], rel=1e-3)


def test_only_sensors_that_no_load_reaches_are_out_of_the_domain(http: httpx.Client) -> None:
    far = [{"id": "near", "x_mm": 0.0, "y_mm": 0.0}, {"id": "far", "x_mm": 40.0, "y_mm": 0.0}]
    found = posted(http, document({**PRESS, "x_mm": 0.0}, sensors=far))
    assert found["status"] == ["ok", "out_of_domain"]
    assert found["reach_mm"] == pytest.approx(30.0)
    assert [value is None for value in found["charge_pc"]] == [False, True]
    both = posted(http, document({**PRESS, "x_mm": 0.0}, {**PRESS, "x_mm": 40.0}, sensors=far))
    assert both["status"] == ["ok", "ok"]
    assert both["charge_pc"][0] == found["charge_pc"][0]
    assert both["charge_error_pc"][0] > found["charge_error_pc"][0]


@pytest.mark.parametrize("fields", [{"poisson_ratio": 0.2}, {"sensor_radius_mm": 7.6}])
def test_a_skin_outside_the_table_has_no_values(http: httpx.Client, fields: Document) -> None:
    found = posted(http, document(PRESS, **fields))
    assert found["status"] == ["out_of_domain"] * 5
    assert found["charge_pc"] == [None] * 5
    assert found["reach_mm"] is None


def test_csv_has_a_row_a_sensor(http: httpx.Client) -> None:
    plain = posted(http, document(PRESS))
    reply = http.post("/v1/stress", json=document(PRESS), headers={"Accept": "text/csv"})
    header, *lines = csv.reader(io.StringIO(reply.text, newline=""))
    assert header == ["x_mm", "y_mm", "charge_pc", "charge_error_pc", "mean_stress_mpa", "status"]
    assert [float(line[2]) for line in lines] == plain["charge_pc"]


def map_of(**changes: Any) -> Callable[[Document], None]:
    def change(request: Document) -> None:
        del request["contacts"]
        pressure: list[list[Any]] = [[0.1, 0.1], [0.1, 0.1]]
        request["pressure_map"] = {"x_mm": [0.0, 1.0], "y_mm": [0.0, 1.0], "pressure_mpa": pressure, **changes}

    return change


def contact_with(**changes: Any) -> Callable[[Document], None]:
    return lambda request: request["contacts"][1].update(changes)


def skin_with(**changes: Any) -> Callable[[Document], None]:
    return lambda request: request.update(changes)


def without(name: str) -> Callable[[Document], None]:
    return lambda request: request.pop(name)


REFUSED: list[tuple[Callable[[Document], Any], str, str]] = [
    (contact_with(x_mm=0.9), "contacts", "must not overlap contact 0: the centres are 1.0"),
    (skin_with(length_mm=5.0), "contacts", "must lie on the skin, x from 1.5 to 6.5 mm"),
    (skin_with(width_mm=1.5), "contacts", "must lie on the skin, y from -0.75 to 0.75 mm"),
    (contact_with(normal_force_n=-1.0), "contacts", ""),
    (contact_with(normal_force_n=1e-6), "contacts[1].normal_force_n", "in magnitude"),
    (contact_with(indenter_radius_mm=0.004), "contacts[1].indenter_radius_mm", "was it given in m?"),
    (contact_with(tangential_force_n=[1.0]), "contacts", ""),
    (contact_with(force=1.0), "contacts", "is not a field"),
    (skin_with(poisson_ratio=0.6), "poisson_ratio", ""),
    (skin_with(glue_stiffness=-1.0), "glue_stiffness", ""),
    (skin_with(thickness_mm=0.0025), "thickness_mm", "was it given in m?"),
    (skin_with(sensors=[]), "sensors", "must not be empty"),
    (skin_with(sensors=[{"id": "a", "x_mm": 0.0, "y_mm": 0.0}] * 2), "sensors[1].id", "must differ"),
    (without("contacts"), "contacts", "or pressure_map, but not both"),
    (without("youngs_modulus_mpa"), "youngs_modulus_mpa", "is required with contacts"),
    (map_of(pressure_mpa=[[0.1, 0.1], [0.1, -0.1]]), "pressure_map.pressure_mpa[1][1]", "must be at least 0"),
    (map_of(pressure_mpa=[[0.1, 0.1]] * 3), "pressure_map.pressure_mpa", "must have a row for each y_mm (2)"),
    (map_of(pressure_mpa=[[0.1, 0.1], [0.1]]), "pressure_map.pressure_mpa", "must have as many as row 0"),
    (map_of(x_mm=[1.0, 1.0]), "pressure_map.x_mm", "must be greater than the entry before"),
    (map_of(x_mm=[0.0, 1.0, 3.0]), "pressure_map.x_mm", "evenly spaced"),
    (map_of(x_mm=[0.0, "1"]), "pressure_map", "must be a number"),
]


@pytest.mark.parametrize(("change", "field", "allowed"), REFUSED)
def test_what_cannot_be_is_refused_by_name(
    http: httpx.Client, change: Callable[[Document], Any], field: str, allowed: str
) -> None:
    request = deepcopy(EXAMPLE)
    change(request)
    reply = http.post("/v1/stress", json=request)
    assert reply.status_code == 422, reply.text
    (error,) = reply.json()["errors"]
    assert error["field"] == field
    assert allowed in error["allowed"]


def test_a_map_beside_the_skin_is_refused(http: httpx.Client) -> None:
    request = deepcopy(EXAMPLE)
    map_of(x_mm=[0.0, 30.0])(request)
    reply = http.post("/v1/stress", json={**request, "length_mm": 40.0})
    assert reply.json()["errors"][0]["field"] == "pressure_map"
    assert "x from -16 to 24 mm" in reply.json()["errors"][0]["allowed"]


def test_nan_is_refused_and_a_batch_too_large_says_so(http: httpx.Client) -> None:
    body = json.dumps(document({**PRESS, "x_mm": float("nan")}))
    reply = http.post("/v1/stress", content=body, headers={"Content-Type": "application/json"})
    assert (reply.status_code, reply.json()["errors"][0]["field"]) == (422, "contacts[0].x_mm")
    sensors = [{"id": str(i), "x_mm": float(i), "y_mm": 0.0} for i in range(400)]
    contacts = [{**PRESS, "y_mm": 3.0 * i} for i in range(1000)]
    reply = http.post("/v1/stress", json=document(*contacts, sensors=sensors))
    assert "sensors times points of the load must be at most" in reply.json()["errors"][0]["allowed"]


def test_client_and_command_give_the_services_numbers(http: httpx.Client, server_url: str, tmp_path: Path) -> None:
    request = document(PRESS, {**PRESS, "x_mm": 60.0})
    plain = posted(http, request)
    with Client(server_url) as client:
        found = client.stress(request)
    assert found.sensor == tuple(plain["sensor"])
    assert found.charge_pc.tolist() == plain["charge_pc"]
    assert found.status.tolist() == plain["status"]
    file = tmp_path / "load.json"
    file.write_text(json.dumps(request))
    written = subprocess.run([COMMAND, "stress", file, "--csv"], capture_output=True, text=True, check=True).stdout
    rows = list(csv.DictReader(io.StringIO(written)))
    assert [float(row["charge_pc"]) for row in rows] == plain["charge_pc"]
    shown = subprocess.run(
        [COMMAND, "stress", "-"], input=json.dumps(request), capture_output=True, text=True, check=True
    ).stdout
    assert "charge" in shown or "Q" in shown


def test_the_command_names_what_is_wrong(tmp_path: Path) -> None:
    file = tmp_path / "load.json"
    for content, says in (("{", "readable JSON"), (json.dumps(document()), "contacts"), ("[]", "named fields")):
        file.write_text(content)
        refused = subprocess.run([COMMAND, "stress", file], capture_output=True, text=True)
        assert refused.returncode == 2
        assert says in refused.stderr
        assert len(refused.stderr.splitlines()) == 1


def test_a_wide_uniform_map_reaches_the_base_whole() -> None:
    """Three thicknesses inside its edges; 100 × 200 cells over 64 sensors."""
    sensors: list[Document] = [{"id": f"{i}-{j}", "x_mm": 5.0 * i, "y_mm": 2.5 * j} for i in range(8) for j in range(8)]
    x, y = np.linspace(0, 35, 200), np.linspace(0, 17.5, 100)
    request: Document = {**SKIN, "sensors": sensors}
    request["pressure_map"] = {
        "x_mm": x.tolist(),
        "y_mm": y.tolist(),
        "pressure_mpa": np.full((100, 200), 0.01).tolist(),
    }
    found = answer(TABLE, read_request(request))
    middle = [i for i, sensor in enumerate(sensors) if 12 < sensor["x_mm"] < 23 and 6 < sensor["y_mm"] < 12]
    assert found.columns["mean_stress_mpa"][middle] == pytest.approx(0.01, rel=0.03)


def test_idle_maps_and_impossible_contacts(http: httpx.Client) -> None:
    """A frame without pressure gives no charge; contacts wider than their sphere and costly maps are refused."""
    idle = {"x_mm": [0, 1], "y_mm": [0, 1], "pressure_mpa": [[0, 0], [0, 0]]}
    found = posted(http, {**SKIN, "pressure_map": idle})
    assert (found["status"], found["charge_pc"]) == (["ok"] * 5, [0.0] * 5)
    refused = http.post("/v1/stress", json=document({**PRESS, "normal_force_n": 100.0}, youngs_modulus_mpa=0.05))
    assert (refused.status_code, "must press less" in refused.text) == (422, True)
    coarse = {"x_mm": [0, 1e4], "y_mm": [0, 1e4], "pressure_mpa": [[1, 0], [0, 0]]}
    refused = http.post("/v1/stress", json={**SKIN, "pressure_map": coarse})
    assert (refused.status_code, "points" in refused.text) == (422, True)
