"""Loads on an array that cannot be are refused by name; answers that are doubtful say why."""

import json
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from tests.array_stress.stress_documents import PRESS, SKIN, Document, document, posted
from tests.cli.commands import run


def example() -> Document:
    """That of the service, whose modules take long to load."""
    from service.routes.computed import STRESS_EXAMPLE

    return deepcopy(STRESS_EXAMPLE)


def map_of(**changes: Any) -> Callable[[Document], None]:
    def change(request: Document) -> None:
        request.pop("contacts", None)
        pressure: list[list[Any]] = [[0.1, 0.1], [0.1, 0.1]]
        request["pressure_map"] = {"x_mm": [0.0, 1.0], "y_mm": [0.0, 1.0], "pressure_mpa": pressure, **changes}

    return change


def contact_with(**changes: Any) -> Callable[[Document], None]:
    return lambda request: request["contacts"][1].update(changes)


def skin_with(**changes: Any) -> Callable[[Document], None]:
    return lambda request: request.update(changes)


def without(name: str) -> Callable[[Document], None]:
    return lambda request: request.pop(name)


WIDE = {"x_mm": [0.0, 1.0, 2.0, 3.0], "y_mm": [0.0, 1.0, 2.0]}

REFUSED: list[tuple[Callable[[Document], Any], str, str]] = [
    (contact_with(x_mm=0.9), "contacts[1]", "must not overlap contacts[0]: the centres are 1.0"),
    (skin_with(length_mm=5.0), "length_mm", "must be at least 8: so far apart are the sensors"),
    (skin_with(width_mm=1.5), "contacts[1]", "must lie on the skin, y from -0.75 to 0.75 mm"),
    (skin_with(width_mm=2.8), "contacts[1]", "must lie on the skin, y from -1.4 to 1.4 mm"),
    (
        skin_with(thickness_mm=0.1, sensor_radius_mm=0.1, youngs_modulus_mpa=0.05),
        "contacts[0].normal_force_n",
        "press less",
    ),
    (contact_with(normal_force_n=-1.0), "contacts[1].normal_force_n", "greater than 0"),
    (contact_with(normal_force_n=0), "contacts[1].normal_force_n", "greater than 0"),
    (contact_with(normal_force_n=1e-6), "contacts[1].normal_force_n", "in magnitude"),
    (contact_with(indenter_radius_mm=0.004), "contacts[1].indenter_radius_mm", "was it given in m?"),
    (contact_with(tangential_force_n=[1.0]), "contacts[1].tangential_force_n", "two numbers, x and y"),
    (contact_with(tangential_force_n=[1.0, "2"]), "contacts[1].tangential_force_n[1]", "must be a number"),
    (contact_with(force=1.0), "contacts[1].force", "unknown field; known: x_mm, y_mm"),
    (lambda request: request["contacts"][1].pop("normal_force_n"), "contacts[1].normal_force_n", "required"),
    (skin_with(contacts=[]), "contacts", "must be a list of 1 to 1000 contacts"),
    (skin_with(contacts={"x_mm": 1.0}), "contacts", "must be a list"),
    (skin_with(poisson_ratio=0.6), "poisson_ratio", "must be 0 to 0.5"),
    (skin_with(poisson_ratio=0.2), "poisson_ratio", "must be 0.3 to 0.5: the table of influences holds no other"),
    (skin_with(sensor_radius_mm=7.6), "sensor_radius_mm", "must be 0 to 3 times thickness_mm (2.5)"),
    (skin_with(glue_stiffness=-1.0), "glue_stiffness", "must be 0 or greater"),
    (skin_with(thickness_mm=0.0025), "thickness_mm", "was it given in m?"),
    (skin_with(sensors=[]), "sensors", "must hold at least one sensor"),
    (skin_with(sensors=[{"id": "a", "x_mm": 0.0, "y_mm": 0.0}] * 2), "sensors[1].id", "must differ"),
    (skin_with(sensors=[{"id": "a", "x_mm": 0.0}]), "sensors[0].y_mm", "required"),
    (without("contacts"), "contacts", "or pressure_map, but not both"),
    (without("youngs_modulus_mpa"), "youngs_modulus_mpa", "is required with contacts"),
    (map_of(pressure_mpa=[[0.1, 0.1], [0.1, -0.1]]), "pressure_map.pressure_mpa[1][1]", "must be at least 0"),
    (
        map_of(**WIDE, pressure_mpa=[[0.1, -0.1, 0.1, 0.1], *[[-0.1] * 4] * 2]),
        "pressure_map.pressure_mpa[0][1]",
        "does not pull; so are [1][0], [1][1], [1][2], [1][3] and 4 more",
    ),
    (map_of(pressure_mpa=[[0.1, 0.1]] * 3), "pressure_map.pressure_mpa", "must have a row for each y_mm (2)"),
    (map_of(pressure_mpa=[[0.1, 0.1], [0.1]]), "pressure_map.pressure_mpa", "must have as many as row 0"),
    (map_of(pressure_mpa=[]), "pressure_map.pressure_mpa", "must be a list of rows"),
    (map_of(x_mm=[1.0, 1.0]), "pressure_map.x_mm", "must be greater than the entry before"),
    (map_of(x_mm=[0.0, 1.0, 3.0]), "pressure_map.x_mm", "evenly spaced"),
    (map_of(x_mm=[0.0, "1"]), "pressure_map.x_mm", "must be a number"),
    (map_of(x_mm=[0.0, 1000.0]), "pressure_map.x_mm", "steps of at most 30 mm"),
]


@pytest.mark.parametrize(("change", "field", "allowed"), REFUSED)
def test_what_cannot_be_is_refused_by_name(
    http: httpx.Client, change: Callable[[Document], Any], field: str, allowed: str
) -> None:
    request = example()
    change(request)
    reply = http.post("/v1/stress", json=request)
    assert reply.status_code == 422, reply.text
    (error,) = reply.json()["errors"]
    assert error["field"] == field
    assert allowed in error["allowed"]


def test_a_map_may_reach_the_skins_edge_with_its_cells_and_no_further(http: httpx.Client) -> None:
    request = example()  # its sensors' middle is at x 4
    map_of(x_mm=[-14.5, -11.5], y_mm=[-0.5, 0.5], pressure_mpa=[[0.1, 0.0], [0.0, 0.0]])(request)
    assert http.post("/v1/stress", json={**request, "length_mm": 40.0, "width_mm": 2.0}).status_code == 200
    for places, refused in (([-14.6, -11.6], [0, 0]), ([19.6, 22.6], [1, 1])):
        pressure = [[0.0, 0.0], [0.0, 0.0]]
        pressure[refused[0]][refused[1]] = 0.1
        map_of(x_mm=places, pressure_mpa=pressure)(request)
        (error,) = http.post("/v1/stress", json={**request, "length_mm": 40.0}).json()["errors"]
        assert error["field"] == "pressure_map.pressure_mpa[{}][{}]".format(*refused)
        assert "x from -16 to 24 mm (length_mm 40, about the middle of the sensors)" in error["allowed"]


def test_nan_is_refused_and_a_batch_too_large_says_so(http: httpx.Client) -> None:
    body = json.dumps(document({**PRESS, "x_mm": float("nan")}))
    reply = http.post("/v1/stress", content=body, headers={"Content-Type": "application/json"})
    assert (reply.status_code, reply.json()["errors"][0]["field"]) == (422, "contacts[0].x_mm")
    sensors = [{"id": str(i), "x_mm": float(i), "y_mm": 0.0} for i in range(400)]
    contacts = [{**PRESS, "y_mm": 3.0 * i} for i in range(1000)]
    reply = http.post("/v1/stress", json=document(*contacts, sensors=sensors))
    assert "sensors times points of the load must be at most" in reply.json()["errors"][0]["allowed"]


@pytest.mark.slow
def test_the_command_names_what_is_wrong(tmp_path: Path) -> None:
    file = tmp_path / "load.json"
    missing = run("stress", tmp_path / "none.json")
    assert (missing.returncode, "No such file" in missing.stderr) == (2, True)
    for content, says in (
        ("{", "line 1, column 2: not JSON"),
        (json.dumps(document()), "contacts"),
        ("[]", "named fields"),
    ):
        file.write_text(content)
        refused = run("stress", file)
        assert refused.returncode == 2
        assert says in refused.stderr
        assert len(refused.stderr.splitlines()) == 1


def test_idle_maps_and_impossible_contacts(http: httpx.Client) -> None:
    """A frame without pressure gives no charge; contacts wider than their sphere and costly maps are refused."""
    idle = {"x_mm": [0, 1], "y_mm": [0, 1], "pressure_mpa": [[0, 0], [0, 0]]}
    found = posted(http, {**SKIN, "pressure_map": idle})
    assert (found["status"], str(found["charge_pc"])) == (["ok"] * 5, str([0.0] * 5))
    beyond = {**idle, "pressure_mpa": [[1e308, 1e308], [0, 0]]}
    found = posted(http, {**SKIN, "pressure_map": beyond})
    assert (found["status"], found["charge_pc"]) == (["out_of_domain"] * 5, [None] * 5)
    refused = http.post("/v1/stress", json=document({**PRESS, "normal_force_n": 100.0}, youngs_modulus_mpa=0.05))
    assert (refused.status_code, "must press less" in refused.text) == (422, True)
    costly = {"x_mm": np.arange(60) * 25.0, "y_mm": np.arange(60) * 25.0, "pressure_mpa": np.ones((60, 60))}
    costly = {name: values.tolist() for name, values in costly.items()}
    refused = http.post("/v1/stress", json={**SKIN, "pressure_map": costly})
    assert (refused.status_code, "sensors times points of the load must be" in refused.text) == (422, True)


def test_doubtful_answers_say_why(http: httpx.Client, tmp_path: Path) -> None:
    twice = [{"id": name, "x_mm": 0.0, "y_mm": 0.0} for name in ("left", "right", "third")]
    (found,) = posted(http, document(PRESS, sensors=twice))["findings"]
    assert "left and right lie over one another" in found["statement"]
    hard = {**PRESS, "normal_force_n": 30.0, "x_mm": 24.0}
    sheared = {**PRESS, "tangential_force_n": [0.9, 1.2]}
    found = posted(http, document(sheared, hard))["findings"]
    assert [finding["field"] for finding in found] == ["contacts[1]", "contacts[0]"]
    assert "L = F/(R²E) is 0.12" in found[0]["statement"]
    assert "1.5 times the normal one" in found[1]["statement"]
    assert posted(http, document(PRESS))["findings"] == []
    in_m = [{"id": f"s{i}", "x_mm": 0.008 * i, "y_mm": 0.0} for i in range(5)]
    (found,) = posted(http, document(PRESS, sensors=in_m))["findings"]
    assert "s0 and s1 lie over one another, their centres 0.008 mm apart: are x and y in mm?" in found["statement"]
    drawn = {"x_mm": [0, 1], "y_mm": [0, 1], "pressure_mpa": [[0, 0], [0, 20]]}
    (found,) = posted(http, {**SKIN, "pressure_map": drawn})["findings"]
    assert found["field"] == "pressure_map.pressure_mpa[1][1]"
    assert "more than the layer's modulus, 16 MPa" in found["statement"]
    drawn["pressure_mpa"] = [[0, 0], [0, 20e3]]
    (found,) = posted(http, {**SKIN, "pressure_map": drawn, "youngs_modulus_mpa": None})["findings"]
    assert "was it given in Pa?" in found["statement"] or "was it given in kPa?" in found["statement"]
    narrow = {"x_mm": [0.0, 0.005, 0.01], "y_mm": [0, 5, 10], "pressure_mpa": [[0.1] * 3] * 3}
    (found,) = posted(http, {**SKIN, "pressure_map": narrow})["findings"]
    assert found["field"] == "pressure_map.x_mm"
    assert "spans 0.01 mm, on sensors 3 mm across: is it in mm?" in found["statement"]
    file = tmp_path / "load.json"
    file.write_text(json.dumps(document(hard)))
    written = run("stress", file)
    assert written.stderr.startswith("underskin: look at contacts[0]: L = F/(R²E) is 0.12")


def test_a_body_that_is_not_json_is_refused(http: httpx.Client) -> None:
    for content, kind, status in (("{", "application/json", 400), ("x_mm\n1\n", "text/csv", 415)):
        assert http.post("/v1/stress", content=content, headers={"Content-Type": kind}).status_code == status
    assert http.post("/v1/stress", json=[1]).json()["errors"][0]["field"] == "body"
