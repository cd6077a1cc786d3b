"""docs/tour.md is what `make tour` writes."""

from docs.tour.__main__ import document, picture
from docs.tour.steps import STEPS
from tests.support.repository import ROOT

DOCS = ROOT / "docs"


def test_the_tour_is_up_to_date() -> None:
    assert (DOCS / "tour.md").read_text(encoding="utf-8") == document()
    for number, step in enumerate(STEPS, start=1):
        assert (DOCS / "figures" / picture(number, step)).read_bytes().startswith(b"\x89PNG")
