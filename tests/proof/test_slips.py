"""Judging slips: each is committed where it shows, and counted."""

from proof.slip_kinds import SLIPS
from proof.slips import judged, shown


def test_slips_in_a_few_campaigns_are_committed_named_and_shown() -> None:
    tally = judged(8, 3)
    assert tally.clean == 6
    assert tally.false == []
    assert {slip for _, slip in tally.visible} <= set(SLIPS)
    assert {"polarity at random", "charge peak-to-peak"} <= {slip for _, slip in tally.visible}
    assert sum(tally.named.values()) + len(tally.missed) == sum(tally.visible.values())
    assert tally.named["none", "polarity at random"] == tally.visible["none", "polarity at random"]
    assert "| polarity at random | none |" in shown(tally)
