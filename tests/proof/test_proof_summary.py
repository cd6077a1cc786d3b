"""What a reader takes home from the proof: computed from the parts, and the same as the sections below it."""

import re
from dataclasses import asdict
from typing import Any

from proof.judge import Judged
from proof.text_summary import summary
from tests.support.repository import ROOT

_SHARE = re.compile(r"\d+ of \d+: \d+ % \[\d+–\d+\]")


def judged(name: str, truth: tuple[str, ...], answer: tuple[str, ...], verdict: str, visible: bool) -> dict[str, Any]:
    one = Judged(name, truth, answer, False, verdict, 0.9, visible, visible, 9.0, (1.0, 1.0))
    return asdict(one)


def test_each_line_is_of_its_part() -> None:
    mixture = [judged(f"{n}", ("ageing",), ("ageing",), "explained", True) for n in range(8)]
    mixture += [judged("wrong", ("ageing",), ("adhesion",), "ambiguous", True)]
    mixture += [judged("hidden", ("adhesion",), (), "no_mismatch", False)]
    quiet = [judged("quiet", (), (), "no_mismatch", False), judged("alarm", (), ("adhesion",), "explained", False)]
    slips = [
        {"named": True, "over_rivals": 99.0},
        {"named": False, "over_rivals": 99.0},
        {"named": False, "over_rivals": 1.0},
    ]
    text = summary(
        {
            "mixture": {"judged": mixture},
            "quiet": {"judged": quiet},
            "slips": {"judged": [{"false": [], "slips": dict(zip("abc", slips, strict=True))}]},
        }
    )
    visible, firm, every, alarms, named, false = _SHARE.findall(text)
    assert [one.partition(":")[0] for one in (visible, firm, every)] == ["8 of 9", "8 of 8", "8 of 10"]
    assert [one.partition(":")[0] for one in (alarms, named, false)] == ["1 of 2", "1 of 2", "0 of 1"]
    assert "never seen" not in text  # no such part was worked out
    assert summary({}) == ""


def test_curves_beside_frfs_counted_over_blocks() -> None:
    """Curves beside frfs are counted over blocks and indentations."""
    told = {"right": {"alone": False, "together": True}, "apart": ["modulus_error"], "identifiable": True}
    told |= {"named": {"alone": [], "together": ["modulus_error"]}}
    every = [told | {"what": what} for what in ("compression", "indentation", "dates")]
    text = summary({"joint": {"judged": every}})
    assert [one.partition(":")[0] for one in _SHARE.findall(text)] == ["2 of 2", "0 of 2", "2 of 2", "0 of 2"]


def test_page_says_short_sections_say() -> None:
    """The page says in short what its sections say."""
    page = (ROOT / "docs" / "proof.md").read_text(encoding="utf-8")
    _, _, rest = page.partition("## In short")
    short, _, below = rest.partition("\n## ")
    lines = {line.partition("**")[2].partition("**")[0]: _SHARE.findall(line) for line in short.splitlines() if line}
    for heading, places in (
        ("What shows is named.", (0,)),
        ("On a rig that this project has never seen", (0,)),
        ("False alarms.", (0,)),
        ("Physics that nobody listed", (0, 1)),
        ("A block or indentations beside the FRFs", (0, 1, 2, 3)),
        ("A d33 that is stated", (0, 1, 2)),
    ):
        for place in places:
            assert lines[heading][place] in below, heading
