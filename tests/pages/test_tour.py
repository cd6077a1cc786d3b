"""docs/tour.md is what `make tour` writes."""

from pathlib import Path

from docs.tour.__main__ import document, picture
from docs.tour.steps import STEPS

DOCS = Path(__file__).parents[2] / "docs"


def test_the_tour_is_up_to_date() -> None:
    assert (DOCS / "tour.md").read_text(encoding="utf-8") == document()
    for number, step in enumerate(STEPS, start=1):
        assert (DOCS / "figures" / picture(number, step)).read_bytes().startswith(b"\x89PNG")
