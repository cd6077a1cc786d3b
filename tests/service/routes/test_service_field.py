"""The stress under a sphere over HTTP, in the client and at the command line: the same numbers, and what is refused."""

import csv
import io
from typing import Any

import httpx
import numpy as np
import pytest

from tests.cli.commands import run
from underskin import Client
from underskin.errors import ServiceError

SPHERE: dict[str, Any] = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
    "preload_n": 3.0,
}


def asked(http: httpx.Client, **changed: Any) -> dict[str, Any]:
    reply = http.get("/v1/field", params={**SPHERE, **changed})
    assert reply.status_code == 200, reply.text
    answer: dict[str, Any] = reply.json()
    return answer


def test_it_agrees_with_what_frf_says_of_the_same_contact(http: httpx.Client) -> None:
    found = asked(http)
    frf = http.post("/v1/frf", json={**SPHERE, "d33_pc_per_n": 14.0}).json()
    for name in ("contact_radius_mm", "a_over_h", "load_parameter", "sigma", "mean_stress_mpa", "rel_error"):
        assert found[name] == pytest.approx(frf[name][0], rel=1e-9), name
    assert (found["model"], found["status"], found["limit"]) == ("layer", "ok", None)
    assert found["table_sha256"] == frf["table_sha256"]


def test_the_section_has_hertzs_pressure_above_and_the_sensors_stress_below(http: httpx.Client) -> None:
    found = asked(http, r_points=301, depth_points=3)
    r, stress = np.array(found["r_mm"]), np.array(found["sigma_zz_mpa"])
    assert stress.shape == (3, 301)
    assert found["depth_mm"] == [0.0, 1.25, 2.5]
    a = found["contact_radius_mm"]
    assert stress[0, 0] == pytest.approx(-1.5 * 3.0 / (np.pi * a**2), rel=1e-9)
    assert (stress[0, r > a] == 0).all()
    on_disc = r <= 1.5
    mean = 2 * np.trapezoid(stress[2, on_disc] * r[on_disc], r[on_disc]) / r[on_disc][-1] ** 2
    assert mean == pytest.approx(-found["mean_stress_mpa"], rel=0.01)


def test_outside_the_table_it_says_which_limit_and_has_no_stress(http: httpx.Client) -> None:
    for ratio in (0.5, 0.3):
        found = asked(http, preload_n=100, poisson_ratio=ratio)
        assert found["status"] == "out_of_domain"
        assert found["limit"] == "L = 0.391 exceeds 0.1: at most 25.6 N"
        for name in ("sigma", "mean_stress_mpa", "section_error", "r_mm", "depth_mm", "sigma_zz_mpa"):
            assert found[name] is None, name
    huge = asked(http, thickness_mm=1e-12, units_checked=True)
    assert huge["status"] == "out_of_domain"


@pytest.mark.parametrize(
    ("changed", "field", "code"),
    [
        ({"preload_n": 0}, "preload_n", "out_of_range"),
        ({"preload_n": "much"}, "preload_n", "wrong_type"),
        ({"thickness_mm": 0.0025}, "thickness_mm", "unlikely_magnitude"),
        ({"thickness_mm": 1e229, "units_checked": True}, "thickness_mm", "out_of_range"),
        ({"indenter_radius_mm": 1e-300, "units_checked": True}, "indenter_radius_mm", "out_of_range"),
        ({"preload_n": 1e-300, "units_checked": True}, "preload_n", "out_of_range"),
        ({"poisson_ratio": 0.6}, "poisson_ratio", "out_of_range"),
        ({"r_points": 302}, "r_points", "out_of_range"),
        ({"depth_points": 1}, "depth_points", "out_of_range"),
        ({"indenter_radius_mm": "nan"}, "indenter_radius_mm", "not_finite"),
        ({"radius_mm": 4}, "radius_mm", "unknown_field"),
    ],
)
def test_what_cannot_be_used_is_named(http: httpx.Client, changed: dict[str, Any], field: str, code: str) -> None:
    reply = http.get("/v1/field", params={**SPHERE, **changed})
    assert reply.status_code == 422
    assert reply.headers["content-type"] == "application/problem+json"
    (error,) = reply.json()["errors"]
    assert (error["field"], error["code"]) == (field, code)


def test_client_and_command_have_the_same_numbers(http: httpx.Client, server_url: str) -> None:
    expected = asked(http, r_points=5, depth_points=3)
    with Client(server_url) as client:
        found = client.field(**SPHERE, r_points=5, depth_points=3)
        assert dict(found) == expected
        assert found.sigma_zz_mpa is not None
        assert found.sigma_zz_mpa[0][0] == expected["sigma_zz_mpa"][0][0]
        with pytest.raises(ServiceError, match="preload_n"):
            client.field(**{**SPHERE, "preload_n": -1.0})
    options = [f"--{name.replace('_', '-')}={value}" for name, value in SPHERE.items()]
    written = run("field", *options, "--r-points", "5", "--depth-points", "3", "--csv")
    rows = list(csv.DictReader(io.StringIO(written.stdout)))
    stress = [float(row["sigma_zz_mpa"]) for row in rows]
    assert stress == pytest.approx(np.ravel(expected["sigma_zz_mpa"]), rel=1e-9)
    assert [float(row["r_mm"]) for row in rows[:5]] == pytest.approx(expected["r_mm"])
    shown = run("field", *options, "--r-points", "5").stdout
    assert "σzz on the base" in shown
    assert f"{expected['sigma']:.5g}" in shown
    refused = run("field", *options, "--preload-n", "-1")
    assert (refused.returncode, refused.stdout) == (2, "")
    assert "preload_n" in refused.stderr
