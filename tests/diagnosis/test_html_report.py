"""The page of a report from its template: everything is escaped, and sections without content are left out."""

import re
from html import unescape
from typing import Any
from urllib.parse import unquote

import pytest

# Reports that no campaign of a test would have: the command makes pages of diagnoses alone (test_diagnosis_page.py).
from underskin.diagnosis.reporting.html_report import body_of, page, provenance

HOSTILE = "<script>alert(\"x\")</script> & 'y'"
EMPTY: dict[str, Any] = {
    "schema": "report/1",
    "campaign": "c",
    "verdict": "insufficient_data",
    "probability": 1.0,
    "statement": "The recordings cannot tell anything: no recording can be used.",
    "location": {"axes": [], "region": {}, "effect_percent": None, "statement": "Nothing was located."},
    "mechanisms": [],
    "alternatives": [],
    "not_identifiable": [],
    "findings": [],
    "fit": None,
    "d33": None,
    "next_experiment": None,
    "provenance": {"underskin": "1", "tables": {"sigma": "ab"}},
}


WHERE = "Where the model and the recordings differ"


def texts(html: str) -> str:
    return " ".join(unescape(re.sub(r"<[^>]+>", " ", html)).split())


def test_every_text_of_a_campaign_is_escaped() -> None:
    finding = {"code": "refused", "recording": HOSTILE, "field": HOSTILE, "statement": HOSTILE}
    hostile = {
        **EMPTY,
        "campaign": HOSTILE,
        "statement": f"{HOSTILE}. {HOSTILE}",
        "location": {**EMPTY["location"], "statement": HOSTILE},
        "findings": [finding],
        "alternatives": [{"mechanisms": [HOSTILE], "probability": 0.1, "why_not": HOSTILE}],
        "not_identifiable": [{"mechanism": HOSTILE, "confounded_with": HOSTILE, "reason": HOSTILE}],
        "provenance": {HOSTILE: HOSTILE},
    }
    shown = page(hostile)
    assert "<script>alert" not in shown
    assert shown.count("&lt;script&gt;alert") > 10
    assert (
        texts(shown).count(HOSTILE.replace("<script>", "").replace("</script>", "")) == 0
    )  # no part was taken as a tag
    assert "Content-Security-Policy" in shown


def test_report_without_answer_says_lacking() -> None:
    """A report without an answer says what is lacking."""
    shown = body_of(EMPTY, {})
    assert re.findall("<h2>(.*?)</h2>", shown) == [WHERE, "What to measure next"]
    assert texts(shown) == (
        f"The recordings cannot tell anything: no recording can be used. nothing can be concluded {WHERE} "
        "Nothing was located. What to measure next Before anything can be concluded: no recording can be used."
    )
    assert texts(provenance(EMPTY)) == "Made with underskin 1 tables sigma ab"


def test_figures_stand_belong_not_escaped() -> None:
    """Figures stand where they belong and are not escaped."""
    names = ("frf", "where", "explanations", "parameters")
    shown = body_of(EMPTY, {name: f'<div id="{name}"></div>' for name in names})
    places = [shown.index(f'<div id="{name}"></div>') for name in names]
    assert places == sorted(places)
    assert places[2] < shown.index(f"<h2>{WHERE}</h2>") < shown.index("<h2>What the model lacks") < places[3]


def test_plan_table_fields_recordings() -> None:
    """A plan is a table of the fields that its recordings have."""
    planned = {
        "recordings": [{"sensor": "=s1", "preload_n": 2.0, "position_mm": [1.0, 2.5]}],
        "statement": "One recording.",
        "probability_of_deciding": 0.9,
        "without_it": 0.5,
        "minutes": 15.0,
    }
    shown = body_of({**EMPTY, "next_experiment": planned}, {})
    assert "preload [N]" in re.findall(r'<th scope="col">(.*?)</th>', shown)
    assert "<td>1, 2.5</td>" in shown
    assert "about 15 minutes" in texts(shown)
    address = re.findall(r'<a href="data:text/csv;charset=utf-8,(.*?)" download="plan.csv">', shown)
    assert unquote(unescape(address[0])) == "sensor,preload_n,position_mm\r\n'=s1,2.0,1.0 2.5\r\n"


def test_law_nobody_listed_shown_numbers_rivals() -> None:
    """A law that nobody listed is shown with its numbers its rivals and its range."""
    parameter = {"name": "change", "unit": "-", "value": -0.08, "low": -0.1, "high": -0.06}
    law = {
        "acts_on": "gain",
        "axis": "time_of_day",
        "form": "periodic",
        "expression": f"Q = Q0 {HOSTILE}",
        "parameters": [parameter],
        "probability": 0.93,
        "rivals": [{"acts_on": "modulus", "axis": "temperature_c", "form": "linear", "probability": 0.04}],
        "heldout_rmse_percent": {"before": 9.4, "after": 2.1},
        "range": {"time_of_day_h": [8.0, 17.5], "operator": ["jd", "mb"], "preload_n_over_own": [0.5, 2.0]},
    }
    html = body_of({**EMPTY, "verdict": "unexplained", "unnamed": law}, {})
    shown = texts(html)
    assert "<script>alert" not in html
    assert "acts on the gain of the charge and follows the time of day; its form is periodic" in shown
    assert "change −0.08 −0.1 to −0.06" in shown
    assert "modulus temperature_c linear 4 %" in shown
    assert "the time of day 8 to 17.5 h; operator: jd, mb; the preload 0.5 to 2 N, over its own range." in shown


def test_small_forces_unit_read_well_minus_signs() -> None:
    """Small forces are in a unit in which they read well with minus signs."""
    parameter = {"name": "pull", "unit": "N", "value": -1.5e-06, "low": -1.8e-06, "high": -1.2e-06}
    law = {
        "acts_on": "force",
        "axis": "displacement_mm",
        "form": "linear",
        "expression": "F + p",
        "probability": 1.0,
        "parameters": [parameter],
        "rivals": [],
        "range": {},
    }
    statement = "A law is missing: by +1.5e-06 N (-1.2e-06 to +1.8e-06). It grows with a power of -0.43 in s-1."
    shown = texts(body_of({**EMPTY, "verdict": "unexplained", "unnamed": law, "statement": statement}, {}))
    assert "by +1.5 µN (−1.2 to +1.8)" in shown
    assert "a power of −0.43 in s-1" in shown
    assert "pull −1.5 −1.8 to −1.2 µN" in shown


def test_quoted_digits_statement() -> None:
    """What is to be quoted has the digits of the statement."""
    d33 = {"value": 13.1234, "low": 12.8912, "high": 13.4321, "unit": "pC/N"}
    errors = {"heldout_rmse_percent": 2.0, "rmse_percent": 2.0}
    fit = {"before": errors, "after": errors, "noise_floor_percent": 2.0, "groups": []}
    for quotable, said in ((True, "d33 13.1 pC/N, 95 %: 12.9 to 13.4"), (False, "lies from 12.9 to 13.4 pC/N")):
        made = {**EMPTY, "verdict": "explained", "d33": {**d33, "quotable": quotable}, "fit": fit}
        assert said in texts(body_of(made, {}))


@pytest.mark.parametrize(("worst", "told"), [(31.3, True), (18.0, False)])
def test_group_not_foretell_told_beside_error(worst: float, told: bool) -> None:
    """A group that the others do not foretell is told beside the error."""
    groups = [
        {
            "group": name,
            "chosen": [],
            "before_rmse_percent": 30.0,
            "after_rmse_percent": error,
            "noise_floor_percent": 2,
        }
        for name, error in (("sensor a1", 2.0), ("sensor a3", worst))
    ]
    errors = {"heldout_rmse_percent": 17.2, "rmse_percent": 1.8}
    fit = {"before": errors, "after": errors, "noise_floor_percent": 2.4, "groups": groups}
    shown = texts(body_of({**EMPTY, "verdict": "explained", "fit": fit}, {}))
    assert ("the largest on sensor: a3 (31.3 %), which the others do not foretell" in shown) == told


@pytest.mark.parametrize("answered", [False, True])
def test_modulus_of_the_plain_law_is_compared_with_one_that_is_there(answered: bool) -> None:
    """Where no modulus over the answers is stated, none is spoken of."""
    errors = {"heldout_rmse_percent": 17.2, "rmse_percent": 1.8}
    modulus = {"youngs_modulus": {"unit": "MPa", "value": 2.25, "low": 2.15, "high": 2.35}}
    after = {**errors, **(modulus if answered else {})}
    fit = {"before": {**errors, **modulus}, "after": after, "noise_floor_percent": 2.4, "groups": []}
    shown = texts(body_of({**EMPTY, "verdict": "explained", "fit": fit}, {}))
    assert "With the plain law alone, weighed by the noise" in shown
    assert ("to compare with the first" in shown) == answered


@pytest.mark.parametrize(
    ("verdict", "probability", "decided"),
    [("explained", 0.97, True), ("no_mismatch", 0.6, False), ("ambiguous", 0.5, False)],
)
def test_answer_not_sure_not_called_decided(verdict: str, probability: float, decided: bool) -> None:
    """An answer that is not sure is not called decided.

    Of a campaign whose rivals no recording of its rig would tell apart.
    """
    shown = texts(body_of({**EMPTY, "verdict": verdict, "probability": probability}, {}))
    assert ("these recordings decide" in shown) == decided
    assert ("These recordings do not decide" in shown) == (not decided)


def test_what_each_kind_tells_is_a_table() -> None:
    modulus = {"parameter": "youngs_modulus", "unit": "MPa", "value": 13.21, "low": 11.88, "high": 14.04}
    told = texts(body_of({**EMPTY, "verdict": "ambiguous", "by_kind": [{"kind": "compression", **modulus}]}, {}))
    assert "block, compressed youngs modulus 13.21 11.88 to 14.04 MPa" in told
    assert "What each kind" not in texts(body_of({**EMPTY, "by_kind": None}, {}))
