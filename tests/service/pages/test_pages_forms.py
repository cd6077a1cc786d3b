"""What is typed into forms: decimal commas everywhere, errors in the form with what was typed, drafts that stay."""

import re

import pytest

from tests.service.pages.conftest import Visit
from tests.support.cases import first
from tests.support.store_server import Server, campaign

SKIN = "typed"


@pytest.fixture(scope="module")
def kept(server: Server) -> str:
    """The path of a campaign's page."""
    sent = server.http.post(f"/v1/campaigns?skin={SKIN}", json=campaign("typed")).raise_for_status().json()
    return f"/campaigns/{sent['id']}"


def refused(visitor: Visit) -> None:
    """The browser tells of the answer's status."""
    assert re.match(r"Failed to load resource.* status of (404|409|422) ", visitor.wrong.pop())


@pytest.mark.parametrize("width", first(1, [390, 1280]))
def test_every_form_reads_decimal_commas(visitor: Visit, kept: str, width: int) -> None:
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 844})
    for path, button in first(1, (("/loads", "Compute"), ("/design", "Compute"), ("/d33", "Compute"))):
        visitor.go(path)
        page.get_by_label("thickness h").last.fill("2,75")
        page.get_by_role("button", name=button, exact=True).click()
        page.wait_for_url("**thickness_mm=2%2C75*")
        assert page.locator(".error:visible").count() == 0
        page.get_by_text("The same by request").click()
        assert re.search(r'"thickness_mm": 2\.75\b', page.get_by_label("Shell").inner_text())
        visitor.require_accessible()
    visitor.go(kept)
    page.get_by_text("Average over another band").click()
    page.get_by_label("from", exact=True).fill("5,5")
    page.get_by_label("to", exact=True).fill("50")
    page.get_by_role("button", name="Average").click()
    page.get_by_text("Averaged over your own band, 5.5 to 50").wait_for()


def test_a_change_that_is_refused_says_so_in_its_form(visitor: Visit, kept: str) -> None:
    page = visitor.page
    visitor.go(kept)
    page.get_by_text("Exclude a recording, or correct").click()
    page.get_by_label("Recording", exact=True).fill("nobody")
    page.locator("#why").fill("loose cable")
    page.get_by_role("button", name="Exclude").click()
    page.get_by_text("has no recording 'nobody'").wait_for()
    assert page.locator("#why").input_value() == "loose cable"
    assert page.get_by_role("heading", name="typed").is_visible()
    refused(visitor)
    visitor.require_accessible()
    visitor.go(f"/skins/{SKIN}")
    page.get_by_text("Join another skin").click()
    page.get_by_label("Id of the other skin").fill(SKIN)
    page.get_by_label("Reason").fill("one and the same")
    page.get_by_role("button", name="Join").click()
    page.get_by_text(f"Id of the other skin: {SKIN} – must be another skin").wait_for()
    assert page.get_by_label("Reason").input_value() == "one and the same"
    refused(visitor)


def test_a_design_outside_the_table_says_which_limit_and_what_is_old_is_grey(visitor: Visit) -> None:
    page = visitor.page
    visitor.go("/design")
    visitor.drawn(2)
    force = page.get_by_label("force F").last
    force.fill("900")
    page.get_by_text("exceeds 0.222: at most 56.8 N").wait_for()
    shown = page.locator(".results").inner_text()
    assert "not resolved everywhere" not in shown
    assert "outside the table" in shown
    visitor.require_accessible()
    force.fill("9,x")
    page.get_by_text("force F [N]: 9,x – must be a number").wait_for()
    assert page.locator(".results.old").count() == 1
    assert page.locator("figure.old").count() == 2
    force.fill("1,5")
    page.wait_for_function("() => document.querySelectorAll('.old').length === 0")
    assert page.locator("#outside").is_hidden()
    visitor.go("/design?preload_n=x")
    page.get_by_label("force F").last.fill("1")  # it opened with an error, and shows all once that is mended
    page.wait_for_url("**preload_n=1&**")
    visitor.drawn(2)
