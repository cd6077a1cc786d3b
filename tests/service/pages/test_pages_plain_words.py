"""What pages say to a reader who is no statistician: each cause with its probability, what to do, no codes."""

from service.store import database, diagnoses
from tests.service.pages.conftest import Visit
from tests.service.pages.forms import said
from tests.support.diagnosed import diagnosed, report, resonant, sent, table
from tests.support.pressed_curves import pressed
from tests.support.store_server import Server
from underskin import __version__
from underskin.findings.codes import FindingCode
from underskin.recordings.campaign import to_dict


def test_list_says_what_is_lacking(server: Server) -> None:
    """A list says what is lacking with its strengths, as the report's headline does."""
    both = [
        {**report()["mechanisms"][0], "name": name, "probability": probability}
        for name, probability in (("timing_delay", 0.98), ("contact_resonance", 0.841))
    ]
    diagnosed(server, resonant("two"), {**report(), "probability": 0.822, "mechanisms": both}, "two causes")
    for path in ("/", "/skins/two%20causes"):
        row = said(server, path, "two")
        assert "Timing delay, tip mass 4 g" in row
        assert "and contact resonance, tip mass 4 g" in row


def test_a_diagnosis_that_failed_says_what_to_do(visitor: Visit, server: Server) -> None:
    campaign_id = sent(server, resonant("broken"), "broken")
    store = database(server.place.database_url, server.place.folder)
    basis = diagnoses.Basis(table().sha256, __version__)
    with store.writing() as connection:
        row = diagnoses.ask(connection, campaign_id, basis, None)
        claimed = diagnoses.claim(connection, "test", basis)
        assert claimed is not None
        assert diagnoses.fail(connection, claimed.number, "test", "recording r3 has no lines")
    store.close()
    visitor.go("/skins/broken")
    assert "open it to see why and what to do" in visitor.page.locator("tr", has_text="broken").inner_text()
    visitor.page.get_by_role("link", name="diagnosis failed").click()
    visitor.page.wait_for_url(f"**/diagnoses/{row.id}")
    told = visitor.page.locator("main").inner_text()
    assert "It failed: recording r3 has no lines" in told
    assert "What to do: if the reason names a recording or a value, exclude that recording" in told
    assert visitor.page.get_by_role("button", name="Diagnose it again").is_visible()
    visitor.require_accessible()


def test_no_finding_is_shown_by_its_code(visitor: Visit, server: Server) -> None:
    findings = [
        {"code": code, "recording": "", "field": "frf", "statement": f"statement {number}"}
        for number, code in enumerate(FindingCode)
    ]
    _, diagnosis_id = diagnosed(server, resonant("found"), {**report(), "findings": findings}, "found")
    visitor.go(f"/diagnoses/{diagnosis_id}")
    part = visitor.page.locator("details:has(> summary:has-text('Look at these recordings'))")
    part.locator("summary").click()
    shown = part.locator("td:last-child").all_inner_texts()
    assert len(shown) == len(findings)
    assert "never varied" in shown
    assert "value at the end of what is possible" in shown
    assert not {"constant axis", "parameter at bound", "units off by 1000", "held out no better"} & set(shown)
    assert not any("_" in words for words in shown)


def test_not_settled_points_section(visitor: Visit, server: Server) -> None:
    """What is not settled points to a section that is there."""
    _, diagnosis_id = diagnosed(server, resonant("pointed"), report(), "pointed")
    visitor.go(f"/diagnoses/{diagnosis_id}")
    heading = visitor.page.get_by_role("heading", name="What the model lacks, and the values found")
    assert heading.count() == 1
    visitor.page.locator("summary", has_text="what to keep in mind").click()
    summary = visitor.page.locator(".summary").inner_text()
    assert f"under “{heading.inner_text()}”" in summary
    assert "No d33 yet: it lies from" in summary
    assert "but what would not show here would change it" in summary  # why, and not a list of what may be the reason


def test_campaign_curves_says_d33_needs(server: Server) -> None:
    """A campaign of curves says what d33 needs."""
    campaign_id = sent(server, to_dict(pressed(1e5, [2.0])), "curves")
    page = said(server, f"/campaigns/{campaign_id}").partition("The same by request")[0]
    assert "it holds no frequency responses (FRFs), from which d33 is calculated" in page
    assert "frf" not in page
