"""Several Young's moduli of one curve: each says what it is, and the one to quote stands first."""

from typing import Any

from tests.service.pages.forms import said
from tests.support.diagnosed import diagnosed, report, sent
from tests.support.pressed_curves import pressed
from tests.support.store_server import Server
from underskin.recordings.campaign import to_dict


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


def test_modulus_under_answer_first_quote(server: Server) -> None:
    """The modulus under the answer is the first to quote."""
    campaign_id, diagnosis_id = diagnosed(server, declared("moduli"), of_curves("explained"), "moduli")
    told = said(server, f"/campaigns/{campaign_id}")
    quoted = told.index("Quote this one first: 1.75 MPa (95 %: 1.65 to 1.85), under the answer of the latest diagnosis")
    assert quoted < told.index("Each recording alone, by least squares of the plain law")
    assert "The declared 2.5 MPa is what was entered with the skin; it was not measured here." in told
    told = said(server, f"/diagnoses/{diagnosis_id}")
    assert "Young's modulus over all answers 1.75 MPa" in told
    assert told.index("Quote this one first") < told.index("With the plain law alone, by least squares")


def test_no_modulus_quoted_before_answer_settled(server: Server) -> None:
    """No modulus is quoted before an answer is settled."""
    campaign_id, diagnosis_id = diagnosed(server, declared("open"), of_curves("ambiguous"), "open")
    bare = sent(server, declared("bare"), "bare")
    for one in (campaign_id, bare):
        assert "Quote none of these yet" in said(server, f"/campaigns/{one}")
    page = said(server, f"/diagnoses/{diagnosis_id}")
    assert "No Young's modulus yet" in page
    assert "Do not quote it yet" in page


def test_modulus_recordings_no_longer_use(server: Server) -> None:
    """A modulus of recordings that are no longer in use is not quoted."""
    document = to_dict(pressed(1e5, [2.0, 3.0]))
    document = {**document, "name": "changed", "skin": {**document["skin"], "youngs_modulus_mpa": 2.5}}
    campaign_id, _ = diagnosed(server, document, of_curves("explained"), "changed")
    left_out = {"recording": document["recordings"][0]["id"], "reason": "the sample slid"}
    server.http.post(f"/v1/campaigns/{campaign_id}/exclusions", json=left_out).raise_for_status()
    page = said(server, f"/campaigns/{campaign_id}")
    assert "mismatch explained" in page
    assert "(outdated)" in page
    assert "Quote none of these yet" in page
