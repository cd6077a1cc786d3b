"""A random experiment of any kind, carried out: its campaign, and the truth about it."""

from typing import Any

from rig.draw import drawn, record
from rig.draw_curves import drawn_curves
from rig.effects import COMPRESSION, FRF, INDENTATION
from rig.elastomer import campaign_of_curves
from rig.recorded import campaign
from rig.truth import truth_of_curves, truth_of_lines

KINDS = (FRF, INDENTATION, COMPRESSION)


def document_and_truth(seed: int, number: int, kind: str, what: str | None) -> tuple[dict[str, Any], dict[str, Any]]:
    """The campaign (`campaign/1`) and the truth (`truth/1`) of random experiment `number` of a seed."""
    if kind == FRF:
        lines = record(drawn(seed, number, what))
        return campaign(lines), truth_of_lines(lines)
    experiment, curves = drawn_curves(seed, number, kind, what)
    return campaign_of_curves(experiment, curves), truth_of_curves(experiment, curves)
