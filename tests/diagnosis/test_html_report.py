"""The page of a report from its template: everything is escaped, and sections without content are left out."""

import re
from html import unescape
from typing import Any
from urllib.parse import unquote

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


def test_a_report_without_an_answer_says_what_is_lacking() -> None:
    shown = body_of(EMPTY, {})
    assert re.findall("<h2>(.*?)</h2>", shown) == [WHERE, "What to measure next"]
    assert texts(shown) == (
        f"The recordings cannot tell anything: no recording can be used. nothing can be concluded {WHERE} "
        "Nothing was located. What to measure next Before anything can be concluded: no recording can be used."
    )
    assert texts(provenance(EMPTY)) == "Made with underskin 1 tables sigma ab"


def test_a_plan_is_a_table_of_the_fields_that_its_recordings_have() -> None:
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
