"""What pages say to a reader who is no statistician: each cause with its probability, what to do, no codes."""

from service.store import database, diagnoses
from tests.service.pages.conftest import Visit
from tests.support.diagnosed import diagnosed, report, resonant, sent, table
from tests.support.pressed_curves import pressed
from tests.support.store_server import Server
from underskin import __version__
from underskin.findings.codes import FindingCode
from underskin.recordings.campaign import to_dict


def test_a_list_says_what_is_lacking_each_with_its_own_probability(reader: Visit, idle: Server) -> None:
    both = [
        {**report()["mechanisms"][0], "name": name, "probability": probability}
        for name, probability in (("timing_delay", 0.98), ("contact_resonance", 0.841))
    ]
    diagnosed(idle, resonant("two"), {**report(), "probability": 0.822, "mechanisms": both}, "two causes")
    for path in ("/", "/skins/two%20causes"):
        reader.go(path)
        said = reader.page.locator("tr", has_text="two").inner_text()
        assert "lacks timing delay (98 %) and contact resonance (84.1 %)" in said
        assert "82.2" not in said


def test_a_diagnosis_that_failed_says_what_to_do(reader: Visit, idle: Server) -> None:
    campaign_id = sent(idle, resonant("broken"), "broken")
    store = database(idle.place.database_url, idle.place.folder)
    basis = diagnoses.Basis(table().sha256, __version__)
    with store.writing() as connection:
        row = diagnoses.ask(connection, campaign_id, basis, None)
        claimed = diagnoses.claim(connection, "test", basis)
        assert claimed is not None
        assert diagnoses.fail(connection, claimed.number, "test", "recording r3 has no lines")
    store.close()
    reader.go("/skins/broken")
    assert "open it to see why and what to do" in reader.page.locator("tr", has_text="broken").inner_text()
    reader.page.get_by_role("link", name="diagnosis failed").click()
    reader.page.wait_for_url(f"**/diagnoses/{row.id}")
    said = reader.page.locator("main").inner_text()
    assert "It failed: recording r3 has no lines" in said
    assert "What to do: if the reason names a recording or a value, exclude that recording" in said
    assert reader.page.get_by_role("button", name="Diagnose it again").is_visible()
    reader.require_accessible()


def test_no_finding_is_shown_by_its_code(reader: Visit, idle: Server) -> None:
    findings = [
        {"code": code, "recording": "", "field": "frf", "statement": f"statement {number}"}
        for number, code in enumerate(FindingCode)
    ]
    _, diagnosis_id = diagnosed(idle, resonant("found"), {**report(), "findings": findings}, "found")
    reader.go(f"/diagnoses/{diagnosis_id}")
    part = reader.page.locator("details", has_text="Look at these recordings")
    part.locator("summary").click()
    shown = part.locator("td:last-child").all_inner_texts()
    assert len(shown) == len(findings)
    assert "never varied" in shown
    assert "value at the end of what is possible" in shown
    assert not {"constant axis", "parameter at bound", "units off by 1000", "held out no better"} & set(shown)
    assert not any("_" in words for words in shown)


def test_what_is_not_settled_points_to_a_section_that_is_there(reader: Visit, idle: Server) -> None:
    _, diagnosis_id = diagnosed(idle, resonant("pointed"), report(), "pointed")
    reader.go(f"/diagnoses/{diagnosis_id}")
    heading = reader.page.get_by_role("heading", name="What the model lacks, and the values found")
    assert heading.count() == 1
    summary = reader.page.locator(".summary").inner_text()
    assert f"under “{heading.inner_text()}”" in summary
    assert "No d33 yet: it lies from" in summary
    assert "but what would not show here would change it" in summary  # why, and not a list of what may be the reason


def test_a_campaign_of_curves_says_what_d33_needs(reader: Visit, idle: Server) -> None:
    campaign_id = sent(idle, to_dict(pressed(1e5, [2.0])), "curves")
    reader.go(f"/campaigns/{campaign_id}")
    said = reader.page.locator("main").inner_text()
    assert "it holds no frequency responses (FRFs), from which d33 is calculated" in said
    assert "frf" not in said
