"""docs/proof.md is what the kept results of all parts give."""

from itertools import zip_longest

import pytest

from proof.results import PARTS, stored_parts
from proof.text import document
from tests.support.repository import ROOT
from tests.support.shown import is_as_shown

_RESULTS = ROOT / "proof" / "results"


@pytest.mark.slow
def test_the_page_is_what_the_results_give() -> None:
    page = (ROOT / "docs" / "proof.md").read_text(encoding="utf-8").splitlines()
    given = document(stored_parts(_RESULTS)).splitlines()
    differ = [pair for pair in zip_longest(page, given, fillvalue="") if not is_as_shown(*pair)]
    assert differ == []


def test_every_part_is_kept() -> None:
    """The page states of which sources of the diagnosis each is."""
    parts = stored_parts(_RESULTS)
    assert set(parts) == set(PARTS)
    page = (ROOT / "docs" / "proof.md").read_text(encoding="utf-8")
    assert all(f"| {name} | `{part['sources']}` |" in page for name, part in parts.items())
