"""`contact` over HTTP, in the client and at the command line: the solved contact's numbers, and what is refused."""

from typing import Any

import httpx
import numpy as np
import pytest

import underskin
from tests.cli.commands import SKIN as PRESSED
from tests.cli.commands import run
from underskin.physics.charge_response import Indenter, Skin
from underskin.prediction.pressed_skin import Transmission, transmission
from underskin.prediction.stress_field import stress_field
from underskin.surrogate.sigma_table import load_table
from underskin.surrogate.solved_contact import solved_contact
from underskin.units import to_lab

SKIN: dict[str, Any] = {"thickness_mm": 0.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 0.3}
SPHERE: dict[str, Any] = {**SKIN, "indenter_radius_mm": 4.0, "preload_n": 2.0}
SOLVED: dict[str, Any] = {"contact": "solved"}


def posted(http: httpx.Client, noun: str, **asked: Any) -> dict[str, Any]:
    reply = http.post(f"/v1/{noun}", json=asked)
    assert reply.status_code == 200, reply.text
    answer: dict[str, Any] = reply.json()
    return answer


def reached(preload: float = 2.0) -> Transmission:
    return transmission(solved_contact(), Skin.from_lab(**SKIN), Indenter.from_lab(indenter_radius_mm=4.0), preload)


def test_frf_and_d33(http: httpx.Client, server_url: str) -> None:
    """Radius, a/h, σ and FRF are the solved contact's; d33 is their inverse; `paper` is what is answered unasked."""
    expected = reached()
    frf = posted(http, "frf", **SPHERE, **SOLVED, d33_pc_per_n=14.0)
    assert (frf["contact"], frf["table_sha256"]) == ("solved", solved_contact().sha256)
    for name in ("a_over_h", "sigma", "rel_error", "load_parameter"):
        assert frf[name] == [pytest.approx(float(getattr(expected, name)), rel=1e-12)], name
    assert frf["contact_radius_mm"] == [pytest.approx(float(to_lab("contact_radius_mm", expected.contact_radius)))]
    back = posted(http, "d33", **SPHERE, **SOLVED, frf_pc_per_n=frf["frf_pc_per_n"][0])
    assert back["d33_pc_per_n"] == [pytest.approx(14.0)]
    unasked, paper = (posted(http, "frf", **SPHERE, **asked, d33_pc_per_n=14.0) for asked in ({}, {"contact": "paper"}))
    assert unasked == paper
    assert unasked["frf_pc_per_n"][0] < 0.9 * frf["frf_pc_per_n"][0]
    with underskin.Client(server_url, npz=True) as client:
        answer = client.frf(**SPHERE, **SOLVED, d33_pc_per_n=14.0)
    assert answer.contact == "solved"
    assert float(answer.frf_pc_per_n) == pytest.approx(frf["frf_pc_per_n"][0])


def test_a_row_outside(http: httpx.Client) -> None:
    """A row outside is null and told with the highest force, which is inside."""
    asked = {**SPHERE, "preload_n": [2.0, 300.0], "d33_pc_per_n": 14.0}
    answer = posted(http, "frf", **asked, **SOLVED)
    assert answer["status"] == ["ok", "out_of_domain"]
    assert answer["frf_pc_per_n"][1] is None
    highest = float(answer["limit"][1].split("at most ")[1].removesuffix(" N"))
    at_limit = posted(http, "frf", **{**asked, "preload_n": [highest, 1.01 * highest]}, **SOLVED)
    assert at_limit["status"] == ["ok", "out_of_domain"]


def test_refused(http: httpx.Client) -> None:
    """With an adopted model, and a contact that there is not: field, value, and what is allowed."""
    asked = {**SPHERE, "d33_pc_per_n": 14.0}
    adopted = http.post("/v1/frf", json={**asked, "model": "adopted", "skin_id": "palm", "contact": "paper"})
    assert adopted.status_code == 422
    (error,) = adopted.json()["errors"]
    assert (error["field"], error["value"]) == ("contact", "paper")
    assert "must be left out with model adopted" in error["allowed"]
    (error,) = http.post("/v1/frf", json={**asked, "contact": "glued"}).json()["errors"]
    assert (error["field"], error["value"]) == ("contact", "glued")
    assert "'paper' or 'solved'" in error["allowed"]


def test_a_design_is_of_the_solved_contact_unless_the_papers_is_asked_for(http: httpx.Client) -> None:
    asked = {**SPHERE, "pitch_mm": 1.0}
    unasked, paper = posted(http, "design", **asked), posted(http, "design", **asked, contact="paper")
    assert (unasked["contact"], paper["contact"]) == ("solved", "paper")
    assert unasked["sigma"] == pytest.approx(float(reached().sigma))
    assert unasked["response"]["sigma"][0] == pytest.approx(unasked["sigma"], rel=1e-5)
    assert paper["sigma"] < 0.9 * unasked["sigma"]


def test_field(http: httpx.Client) -> None:
    """On the base the section's mean over the sensor is the solved σ; the surface bears the force."""
    answer = http.get("/v1/field", params={**SPHERE, **SOLVED, "r_points": 301, "depth_points": 3}).json()
    assert (answer["contact"], answer["status"], answer["section_error"]) == ("solved", "ok", None)
    r, stress = np.array(answer["r_mm"]), np.array(answer["sigma_zz_mpa"])
    disc = r <= 0.3
    mean = -2 * np.trapezoid(stress[2, disc] * r[disc], r[disc]) / r[disc][-1] ** 2
    assert mean == pytest.approx(answer["mean_stress_mpa"], rel=0.01)
    skin, sphere = Skin.from_lab(**SKIN), Indenter.from_lab(indenter_radius_mm=4.0)
    whole = stress_field(solved_contact(), skin, sphere, np.array([2.0]), 4001, 3)
    force = -2 * np.pi * np.trapezoid(whole.sigma_zz[0, 0] * whole.r, whole.r)
    assert force == pytest.approx(2.0, rel=1e-3)
    compressible = http.get("/v1/field", params={**SPHERE, **SOLVED, "poisson_ratio": 0.45}).json()
    assert (compressible["status"], compressible["contact_radius_mm"]) == ("out_of_domain", None)


def test_stress(http: httpx.Client) -> None:
    """Beneath a sphere the charge of an array's sensor is that of `/v1/frf`; contacts outside are refused."""
    contact = {"x_mm": 0.0, "y_mm": 0.0, "indenter_radius_mm": 4.0, "normal_force_n": 10.0}
    sensors = [{"id": "a", "x_mm": 0.0, "y_mm": 0.0}, {"id": "b", "x_mm": 1.0, "y_mm": 0.0}]
    asked = {**SKIN, "d33_pc_per_n": 14.0, "sensors": sensors, "contacts": [contact]}
    answer, paper = posted(http, "stress", **asked, **SOLVED), posted(http, "stress", **asked)
    expected = reached(10.0)
    assert (answer["contact"], paper["contact"]) == ("solved", "paper")
    assert answer["charge_pc"][0] == pytest.approx(10.0 * float(expected.frf(14.0)), rel=2e-4)
    assert answer["contact_radius_mm"] == [pytest.approx(1e3 * float(expected.contact_radius))]
    assert answer["charge_pc"][1] != pytest.approx(paper["charge_pc"][1], rel=1e-4)
    assert [finding["field"] for finding in paper["findings"]] == ["contacts[0]"]
    assert not answer["findings"]
    for change, field in (
        ({"contacts": [{**contact, "normal_force_n": 60.0}]}, "contacts[0].normal_force_n"),
        ({"poisson_ratio": 0.4}, "poisson_ratio"),
        ({"glue_stiffness": 3.0}, "glue_stiffness"),
    ):
        reply = http.post("/v1/stress", json={**asked, **SOLVED, **change})
        assert (reply.status_code, reply.json()["errors"][0]["field"]) == (422, field)


def test_command_line() -> None:
    """`d33` tells the other contact's value where the two differ by more than 1 %, and nothing where they do not."""
    options = [part for name, value in SPHERE.items() for part in (f"--{name.replace('_', '-')}", str(value))]
    told = run("d33", *options, "--frf-pc-per-n", "5")
    skin, sphere = Skin.from_lab(**SKIN), Indenter.from_lab(indenter_radius_mm=4.0)
    values = [transmission(model, skin, sphere, 2.0).d33(5.0, 0.0)[0] for model in (solved_contact(), load_table())]
    assert f"d33 in contact with the layer itself (solved): {float(values[0]):.4g} pC/N" in told.stderr
    told = run("d33", *options, "--frf-pc-per-n", "5", "--contact", "solved")
    assert f"d33 under Hertz' pressure (paper): {float(values[1]):.4g} pC/N" in told.stderr
    assert "solved" not in run("d33", *PRESSED, "--preload-n", "0.5", "--frf-pc-per-n", "7").stderr
