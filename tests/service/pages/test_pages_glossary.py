"""The glossary on the server: every term of docs/glossary.md, found without a network."""

import re

import pytest
from playwright.sync_api import expect

from tests.service.pages.conftest import Visit
from tests.support.cases import first
from tests.support.repository import ROOT


@pytest.mark.parametrize("width", first(1, [390, 1280]))
def test_glossary_holds_every_term_filtered(visitor: Visit, width: int) -> None:
    """The glossary holds every term and is filtered."""
    written = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    terms = [term for term in re.findall(r"^\| ([^|]+?) \|", written, flags=re.MULTILINE) if term != "term"]
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 844})
    visitor.go("/design")
    page.get_by_role("link", name="Glossary").click()
    page.wait_for_url("**/glossary")
    assert page.locator("main tbody td:first-child").all_inner_texts() == terms
    statistics = page.get_by_role("region", name="Statistics")
    expect(statistics.get_by_role("row", name="likelihood probability density of the measurements y")).to_be_visible()
    page.get_by_label("Filter").first.fill("stiffness")
    contact = page.get_by_role("region", name="Skin and contact").locator("tbody tr:visible")
    assert contact.locator("td:first-child").all_inner_texts()[:1] == ["snap-in, pull-off"]
    assert 1 < contact.count() < 6
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth + 1")
    visitor.require_accessible()
