"""What pages say of numbers, of a failed diagnosis and of findings: digits that agree, what to do, no codes."""

import re
from html import unescape

import pytest

from service.pages.shared.formats import end_of, interval
from service.store import database, diagnoses
from tests.service.pages.forms import BROWSING, said
from tests.support.diagnosed import diagnosed, report, resonant, sent, table
from tests.support.store_server import Server, campaign
from underskin import __version__
from underskin.findings.codes import FindingCode


@pytest.mark.parametrize(
    ("numbers", "shown"),
    [
        ((13.2468, 13.1119, 13.3912), "13.25 (95 %: 13.11 to 13.39)"),
        ((1234.6, 1030.2, 1439.0), "1235 (95 %: 1030 to 1439)"),
        ((-0.00123, -0.0019, -0.0004), "−0.00123 (95 %: −0.00190 to −0.00040)"),
        ((-6.7e-05, -0.077, 0.077), "0.000 (95 %: −0.077 to 0.077)"),
        ((7.0, 7.0, 7.0), "7.000 (95 %: 7.000 to 7.000)"),
    ],
)
def test_digits_of_a_value_and_its_interval_agree(numbers: tuple[float, float, float], shown: str) -> None:
    assert re.sub("<[^>]*>", "", interval(*numbers)) == shown
    places = {len(part.partition(".")[2]) for part in re.findall(r"[\d.]+", shown.replace("95 %", ""))}
    ends = [re.sub("<[^>]*>", "", end_of(one, *numbers[1:])) for one in numbers]
    assert {len(end.partition(".")[2]) for end in ends} == places
    assert len(places) == 1


def test_campaign_says_the_array_s_interval(server: Server) -> None:
    """The page's d33 of the array and its interval are the answer's."""
    kept = sent(server, campaign("alike", sensors=6, lines=60), "words")
    array = server.http.get(f"/v1/campaigns/{kept}/d33").json()["array"]
    told = re.search(r"([\d.]+) pC/N \(95 %: ([\d.]+) to ([\d.]+)\)", said(server, f"/campaigns/{kept}"))
    assert told is not None
    value, low, high = map(float, told.groups())
    for shown, exact in ((value, "d33_pc_per_n"), (low, "d33_low_pc_per_n"), (high, "d33_high_pc_per_n")):
        assert shown == pytest.approx(array[exact], abs=(high - low) / 20)


def test_a_diagnosis_that_failed_says_what_to_do(server: Server) -> None:
    campaign_id = sent(server, resonant("broken"), "broken")
    store = database(server.place.database_url, server.place.folder)
    basis = diagnoses.Basis(table().sha256, __version__)
    with store.writing() as connection:
        row = diagnoses.ask(connection, campaign_id, basis, None)
        claimed = diagnoses.claim(connection, "test", basis)
        assert claimed is not None
        assert diagnoses.fail(connection, claimed.number, "test", "recording r3 has no lines")
    store.close()
    assert "diagnosis failed" in said(server, "/skins/broken", "broken")
    told = said(server, f"/diagnoses/{row.id}")
    assert "It failed: recording r3 has no lines" in told
    assert "What to do: " in told
    assert "Diagnose it again" in told


def test_no_finding_is_shown_by_its_code(server: Server) -> None:
    findings = [
        {"code": code, "recording": "", "field": "frf", "statement": f"statement {number}"}
        for number, code in enumerate(FindingCode)
    ]
    _, diagnosis_id = diagnosed(server, resonant("found"), {**report(), "findings": findings}, "found")
    page = server.http.get(f"/diagnoses/{diagnosis_id}", headers=BROWSING).text
    part = next(part for part in page.split("<details") if "Look at these recordings" in part and "<table" in part)
    rows = [re.findall(r"<td.*?</td>", row, re.DOTALL) for row in part.partition("</table>")[0].split("<tr")]
    shown = [unescape(re.sub("<[^>]*>", "", cells[-1])).strip() for cells in rows if cells]
    assert len(shown) == len(findings)
    assert not {"constant axis", "parameter at bound", "units off by 1000", "held out no better"} & set(shown)
    assert not any("_" in words for words in shown)
