"""Random experiments of any kind, carried out: their campaigns, and the truth about them."""

from typing import Any

from rig.draw import SHARES, drawn, record
from rig.draw_curves import drawn_curves
from rig.effects import COMPRESSION, FRF, INDENTATION
from rig.elastomer import campaign_of_curves
from rig.joint import WHAT, drawn_joint
from rig.recorded import campaign
from rig.truth import truth_of_curves, truth_of_lines
from rig.wide_tails import USUAL

JOINT = "joint"
HIDES: dict[str, tuple[str, ...]] = {  # kinds, and the possible requests for each
    FRF: tuple(SHARES),
    INDENTATION: tuple(SHARES),
    COMPRESSION: tuple(SHARES),
    JOINT: WHAT,
}

Documents = tuple[list[dict[str, Any]], dict[str, Any]]


def documents_and_truth(seed: int, number: int, kind: str, what: str | None, tails: str = USUAL) -> Documents:
    """The campaigns (`campaign/1`) of random experiment `number` of a seed, several for kind joint, and the truth;
    `tails`: other distributions, for kind frf only."""
    if kind == JOINT:
        return drawn_joint(seed, number, what)
    if kind == FRF:
        lines = record(drawn(seed, number, what, tails))
        return [campaign(lines)], truth_of_lines(lines)
    experiment, curves = drawn_curves(seed, number, kind, what)
    return [campaign_of_curves(experiment, curves)], truth_of_curves(experiment, curves)
