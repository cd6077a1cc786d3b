"""docs/tour.md is what `make tour` writes."""

import json
import shutil
from pathlib import Path

import pytest

from docs.tour.__main__ import SHOWN, document, picture
from docs.tour.photographer import browsing, serving, words
from docs.tour.steps import STEPS
from tests.support.repository import ROOT
from tests.support.shown import is_as_shown

DOCS = ROOT / "docs"


def test_the_tour_is_up_to_date() -> None:
    assert (DOCS / "tour.md").read_text(encoding="utf-8") == document()
    for number, step in enumerate(STEPS, start=1):
        assert (DOCS / "figures" / picture(number, step)).read_bytes().startswith(b"\x89PNG")


@pytest.mark.soak
@pytest.mark.server
@pytest.mark.browser
@pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is not installed")
def test_what_the_tour_shows_is_what_the_code_gives(tmp_path: Path) -> None:
    """Every verdict and number that a page of the tour said when it was photographed."""
    shown = json.loads((DOCS / "tour" / SHOWN).read_text(encoding="utf-8"))
    assert list(shown) == [step.name for step in STEPS]
    with serving(tmp_path) as address, browsing(address) as page:
        for step in STEPS:
            step.walk(page)
            assert is_as_shown(shown[step.name], words(page)), step.name
