"""Several Young's moduli of one curve: each says what it is, and the one to quote stands first. And what
the skin's declared values may be off by is in what the campaign's page says of the array's d33."""

from typing import Any

import numpy as np
import pytest

from tests.service.pages.forms import said
from tests.support.diagnosed import diagnosed, report, sent
from tests.support.pressed_curves import pressed
from tests.support.simulated_campaign import Rig, simulate
from tests.support.store_server import Server
from underskin.recordings.campaign import to_dict
from underskin.surrogate.sigma_table import load_table


def of_curves(verdict: str) -> dict[str, Any]:
    """A report of curves with moduli of its own."""
    after, before = (
        {"name": "youngs_modulus", "unit": "MPa", "value": value, "low": value - 0.1, "high": value + 0.1}
        for value in (1.75, 2.25)
    )
    fit = report()["fit"]
    errors = {
        "before": {**fit["before"], "youngs_modulus": before, "least_squares_modulus_mpa": 2.375},
        "after": {**fit["after"], "youngs_modulus": after},
    }
    return {**report(), "verdict": verdict, "d33": None, "fit": {**fit, **errors}}


def declared(name: str) -> dict[str, Any]:
    document = to_dict(pressed(1e5, [2.0]))
    return {**document, "name": name, "skin": {**document["skin"], "youngs_modulus_mpa": 2.5}}


def test_the_modulus_under_the_answer_is_the_first_to_quote(server: Server) -> None:
    campaign_id, diagnosis_id = diagnosed(server, declared("moduli"), of_curves("explained"), "moduli")
    told = said(server, f"/campaigns/{campaign_id}")
    quoted = told.index("Quote this one first: 1.75 MPa (95 %: 1.65 to 1.85), under the answer of the latest diagnosis")
    assert quoted < told.index("Each recording alone, by least squares of the plain law")
    assert "The declared 2.5 MPa is what was entered with the skin; it was not measured here." in told
    told = said(server, f"/diagnoses/{diagnosis_id}")
    assert "Young's modulus over all answers 1.75 MPa" in told
    assert told.index("Quote this one first") < told.index("With the plain law alone, by least squares")


def test_no_modulus_is_quoted_before_an_answer_is_settled(server: Server) -> None:
    campaign_id, diagnosis_id = diagnosed(server, declared("open"), of_curves("ambiguous"), "open")
    bare = sent(server, declared("bare"), "bare")
    for one in (campaign_id, bare):
        assert "Quote none of these yet" in said(server, f"/campaigns/{one}")
    page = said(server, f"/diagnoses/{diagnosis_id}")
    assert "No Young's modulus yet" in page
    assert "Do not quote it yet" in page


def test_a_modulus_of_recordings_that_are_no_longer_in_use_is_not_quoted(server: Server) -> None:
    document = to_dict(pressed(1e5, [2.0, 3.0]))
    document = {**document, "name": "changed", "skin": {**document["skin"], "youngs_modulus_mpa": 2.5}}
    campaign_id, _ = diagnosed(server, document, of_curves("explained"), "changed")
    left_out = {"recording": document["recordings"][0]["id"], "reason": "the sample slid"}
    server.http.post(f"/v1/campaigns/{campaign_id}/exclusions", json=left_out).raise_for_status()
    page = said(server, f"/campaigns/{campaign_id}")
    assert "mismatch explained" in page
    assert "(outdated)" in page
    assert "Quote none of these yet" in page


def declared_wrongly(**skin: Any) -> dict[str, Any]:
    """A campaign of sensors of 14 pC/N, whose skin is declared 3 % too thick, 2 % too wide and 15 % too stiff."""
    rig = Rig(d33=np.full(3, 14.0), thickness_mm=2.5, sensor_radius_mm=1.5, modulus_mpa=16.0)
    document = to_dict(simulate(load_table(), rig, np.random.default_rng(4)))
    off = {"thickness_mm": 2.575, "sensor_radius_mm": 1.47, "youngs_modulus_mpa": 18.4}
    return {**document, "name": "off", "skin": {**document["skin"], **off, **skin}}


def test_the_pages_interval_holds_a_d33_of_a_skin_within_its_tolerances(server: Server) -> None:
    campaign_id = sent(server, declared_wrongly(), "off")
    answer = server.http.get(f"/v1/campaigns/{campaign_id}/d33").json()
    array, relative = answer["array"], answer["array_relative"]
    assert array["d33_low_pc_per_n"] < 14 < array["d33_high_pc_per_n"]
    assert not relative["d33_low_pc_per_n"] < 14 < relative["d33_high_pc_per_n"]
    told = said(server, f"/campaigns/{campaign_id}")
    shown = f"(95 %: {array['d33_low_pc_per_n']:.1f} to {array['d33_high_pc_per_n']:.1f})"
    assert shown in told.replace("\xa0", " ")
    assert "The interval includes what the declared thickness, sensor radius and modulus may be off by" in told


def test_stated_tolerances_replace_the_usual_ones(server: Server) -> None:
    exact = {"thickness_percent": 0, "sensor_radius_percent": 0, "youngs_modulus_percent": 0}
    campaign_id = sent(server, declared_wrongly(tolerances=exact), "exact")
    answer = server.http.get(f"/v1/campaigns/{campaign_id}/d33").json()
    assert answer["declared_percent"] == 0
    assert answer["array"] == pytest.approx(answer["array_relative"])
    assert server.http.get(f"/v1/campaigns/{campaign_id}/document").json()["skin"]["tolerances"] == exact
