"""Charge on every sensor of an array: over HTTP, in Python and on the command line."""

import csv
import io
import json
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import httpx
import numpy as np
import pytest

from tests.array_stress.stress_documents import PRESS, SKIN, Document, document, posted
from tests.cli.commands import run
from tests.support.cases import first
from tests.support.sphere_contact import SphereOnLayer
from underskin import Client
from underskin.array_stress.answer import answer
from underskin.array_stress.request import read_request
from underskin.physics import elastic_layer, half_space
from underskin.physics.elastic_layer import Layer
from underskin.physics.hankel_transform import normal_stress
from underskin.surrogate.influence_table import load_influence
from underskin.units import Floats

TABLE = load_influence()


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
        for contact, radius_mm in zip(contacts, found["contact_radius_mm"], strict=True):
            away = np.array([contact["x_mm"] - sensor["x_mm"], contact["y_mm"] - sensor["y_mm"]])
            r = float(np.hypot(*away)) / 2.5
            pressed = SphereOnLayer(4e-3, 16e6, 2.5e-3, exact).at_force(contact["normal_force_n"])
            assert radius_mm == pytest.approx(pressed.contact_radius * 1e3, rel=1e-8)
            a = pressed.contact_radius / 2.5e-3
            outward = float(np.dot(contact["tangential_force_n"], away)) / np.hypot(*away)
            total += float(transmitted(exact, pressed.pressure_transform, a, r))
            total -= outward * tangential(exact, a, r)
        assert found["charge_pc"][number] == pytest.approx(14.0 * 1.5 * 0.36 * total, rel=2e-4)


def transmitted(body: Layer, transform: Callable[[Floats], Floats], a: float, r: float) -> Floats:
    """F σ at ρ 0.6 under a pressure of which the transform is known."""
    return normal_stress(lambda k: body.transmission(k).value, transform, a, 0.6, r)


def tangential(exact: Layer, a: float, r: float) -> float:
    """γ_t averaged over the Hertz pressure, which small contacts have, along the line of centres."""
    angle, share = np.pi * (np.arange(24) + 0.5) / 24, 1 / 24
    t, weight = np.polynomial.legendre.leggauss(12)
    t, weight = (1 + t) / 2, weight / 2
    radius = a * np.sqrt(1 - t**2)
    x, y = r + np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle))
    distance = np.hypot(x, y)
    values = elastic_layer.gamma_t(exact, distance, 0.6) * x / distance
    return float((3 * t**2 * weight) @ values.sum(axis=1) * share)


@pytest.mark.parametrize("hertz_a_over_h", [0.3, 1.0, 3.0])
@pytest.mark.parametrize(("poisson_ratio", "glue_stiffness"), [(0.5, None), (0.35, 2.0)])
def test_wide_contacts_are_those_of_the_layer(
    hertz_a_over_h: float, poisson_ratio: float, glue_stiffness: float | None
) -> None:
    """Radius and charge of the exact contact, not those of Hertz' half space, which is 10 % off at a/h 1."""
    force = float(4 * 1e5 * (hertz_a_over_h * 2.5e-3) ** 3 / (3 * 50e-3 * (1 - poisson_ratio**2)))
    contact = {"x_mm": 0.7, "y_mm": 0.0, "indenter_radius_mm": 50.0, "normal_force_n": force}
    changes = {"poisson_ratio": poisson_ratio, "glue_stiffness": glue_stiffness, "youngs_modulus_mpa": 0.1}
    found = answer(TABLE, read_request(document(contact, **changes)))
    body = Layer(poisson_ratio, 0.0 if glue_stiffness is None else 1 / (1 + glue_stiffness))
    pressed = SphereOnLayer(50e-3, 1e5, 2.5e-3, body).at_force(force)
    assert found.contact_radius_mm == pytest.approx([pressed.contact_radius * 1e3], rel=1e-8)
    for number, x in ((0, 0.0), (1, 8.0)):
        total = transmitted(body, pressed.pressure_transform, pressed.contact_radius / 2.5e-3, abs(x - 0.7) / 2.5)
        charge = 14.0 * 1.5 * 0.36 * float(total)
        assert found.columns["charge_pc"][number] == pytest.approx(charge, rel=1e-4, abs=1e-5 * 14.0 * 0.54 * force)
    ratio = found.contact_radius_mm[0] / 2.5 / hertz_a_over_h
    assert ratio < (0.997 if hertz_a_over_h == 0.3 else 0.95)


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
    expected = -1.5 / np.pi / 2.5**2 * float(half_space.gamma_t(3.0 / 2.5, 0.0))  # compression positive
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
    assert found["limit"] == [None, f"no load within {found['reach_mm']:g} mm"]
    assert found["reach_mm"] == pytest.approx(30.0)
    assert [value is None for value in found["charge_pc"]] == [False, True]
    both = posted(http, document({**PRESS, "x_mm": 0.0}, {**PRESS, "x_mm": 40.0}, sensors=far))
    assert both["status"] == ["ok", "ok"]
    assert both["charge_pc"][0] == found["charge_pc"][0]
    assert both["charge_error_pc"][0] > found["charge_error_pc"][0]


def test_csv_has_a_row_a_sensor(http: httpx.Client) -> None:
    names = ["s0", 's1, "left"', "s2", "ü", "s4"]
    sensors = [{**sensor, "id": name} for sensor, name in zip(SKIN["sensors"], names, strict=True)]
    plain = posted(http, document(PRESS, sensors=sensors))
    reply = http.post("/v1/stress", json=document(PRESS, sensors=sensors), headers={"Accept": "text/csv"})
    header, *lines = csv.reader(io.StringIO(reply.text, newline=""))
    assert header == ["sensor", "x_mm", "y_mm", "charge_pc", "charge_error_pc", "mean_stress_mpa", "limit", "status"]
    assert [float(line[3]) for line in lines] == plain["charge_pc"]
    assert [line[0] for line in lines] == names


def test_client_and_command_give_the_services_numbers(http: httpx.Client, server_url: str, tmp_path: Path) -> None:
    request = document(PRESS, {**PRESS, "x_mm": 60.0})
    plain = posted(http, request)
    with Client(server_url) as client:
        found = client.stress(request)
    assert found.sensor == tuple(plain["sensor"])
    assert found.charge_pc.tolist() == plain["charge_pc"]
    assert found.status.tolist() == plain["status"]
    assert [words or None for words in found.limit.tolist()] == (plain["limit"] or [None] * len(found.limit))
    file = tmp_path / "load.json"
    file.write_text(json.dumps(request), encoding="utf-8-sig")  # as some editors write it
    written = run("stress", file, "--csv").stdout
    rows = list(csv.DictReader(io.StringIO(written)))
    assert [float(row["charge_pc"]) for row in rows] == plain["charge_pc"]
    shown = run("stress", "-", given=json.dumps(request)).stdout
    first_words = [line.split()[0] for line in shown.splitlines() if line.strip()]
    assert [word for word in first_words if word in found.sensor] == ["s0", "s1", "s2", "s3", "s4"]
    assert found.contact_radius_mm == pytest.approx(plain["contact_radius_mm"])
    assert found.findings == ()


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_huge_map_takes_little_more_memory_than_itself() -> None:
    """Half a million coarse cells, and twenty million point forces, of which a gigabyte would be needed at once."""
    x = np.arange(707) * 1.5
    request = read_request(
        {
            **SKIN,
            "sensors": SKIN["sensors"][:1],
            "pressure_map": {
                "x_mm": x.tolist(),
                "y_mm": x.tolist(),
                "pressure_mpa": np.full((707, 707), 0.01).tolist(),
            },
        }
    )
    tracemalloc.start()
    answer(TABLE, request)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 150e6


@pytest.mark.slow
def test_the_command_takes_a_map_from_csv(tmp_path: Path) -> None:
    skin, pressed = tmp_path / "skin.json", tmp_path / "map.csv"
    skin.write_text(json.dumps(SKIN))
    pressed.write_text("y_mm \\ x_mm,7,8,9\n-1,0,0.1,0\n0,0.1,0.3,0.1\n1,0,0.1,0\n")
    drawn = {"x_mm": [7, 8, 9], "y_mm": [-1, 0, 1], "pressure_mpa": [[0, 0.1, 0], [0.1, 0.3, 0.1], [0, 0.1, 0]]}
    expected = answer(TABLE, read_request({**SKIN, "pressure_map": drawn})).columns["charge_pc"].tolist()
    command = ("stress", skin, "--pressure-map", pressed, "--csv")
    rows = csv.DictReader(io.StringIO(run(*command).stdout))
    assert [(row["sensor"], float(row["charge_pc"])) for row in rows] == list(
        zip(["s0", "s1", "s2", "s3", "s4"], expected, strict=True)
    )
    pressed.write_bytes("mm;7;8;9;\r\n-1;0;0,1;0;\r\n0;0,1;0,3;0,1;\r\n1;0;0,1;0;\r\n;;;;\r\n".encode("utf-16"))
    spreadsheet = csv.DictReader(io.StringIO(run(*command).stdout))
    assert [float(row["charge_pc"]) for row in spreadsheet] == expected
    skin.write_text(json.dumps({**SKIN, "pressure_map": drawn}))
    refused = run(*command)
    assert (refused.returncode, "give it once" in refused.stderr) == (2, True), refused.stderr
    skin.write_text(json.dumps(SKIN))
    cases = (
        ("a|b|c\n1|2|3\n2|3|4\n", "must be CSV: x_mm in the first line"),
        (",1,2\n0,1,x\n1,1,1\n", "must be a number (line 2, cell 3"),
        (",1,2\n0,1\n1,1,1\n", "must have as many as line 1 has (3) (line 2 of"),
        (",1,2\n0,1,1\n\n1,-1,1\n", "a pressure does not pull (line 4, cell 2 of"),
        (",1,2\n1,1,1\n0,1,1\n", "pressure_map.y_mm[1] = 0: must be greater than the entry before"),
        (",1,2\n0,1,1\n1,nan,1\n", "pressure_map = 'nan': must be a finite number (line 3, cell 2 of"),
    )
    for content, says in first(3, cases):
        pressed.write_text(content)
        refused = run(*command)
        assert (refused.returncode, says in refused.stderr) == (2, True), refused.stderr
