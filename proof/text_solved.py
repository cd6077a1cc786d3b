"""The page's section on campaigns whose contact is solved."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from proof.markdown import table
from proof.phrases import percent
from proof.solved_contact import CLASSES, HONEST, MOVED, RIGHT, WRONG, Judgement, ideally_quoted, rows
from proof.statistics import share
from rig.solved.worlds import PLAIN


def solved_contact(result: Mapping[str, Any]) -> str:
    """What is named and what is quoted for campaigns made by finite elements."""
    judged = result["judged"]
    confident = [judgement for judgement in judged if judgement["class"] != HONEST]
    visible = [judgement["class"] != HONEST for judgement in judged if judgement["visible"]]
    plain = [judgement["class"] == RIGHT for judgement in judged if judgement["effect"] == PLAIN]
    subsets = rows(judged)
    moved = [judgement["relative_inside"] for judgement in subsets[MOVED] if judgement["quoted"]]
    ideal = [judgement["quoted"] for judgement in judged if ideally_quoted(judgement)]
    body = [[name, *_counts(some), *_quoted(some)] for name, some in subsets.items() if some]
    return f"""\
## Campaigns made by solving the contact

{len(judged)} campaigns of `rig/solved` (seed {result["seed"]}): a sphere in true contact with a neo-Hookean layer at
finite strain, by finite elements, alone (*{PLAIN}*) or with one more effect; declared sizes are off by their
tolerances. *Right* is the law that is in the data beside those of the plain world; *honest* asserts nothing, or an
unlisted law. An effect shows if it gains more than 20 in χ² over the plain world. One that does not and moves d33 by
more than the tolerances is a row of its own: no interval can know of it.

{table(["effect", "campaigns", *CLASSES, "quoted d33 inside", "rms error"], body)}
Plain world named: {percent(share(plain))}. Confident statements that are wrong:
{percent(share([stated["class"] == WRONG for stated in confident]))}. Where the effect shows, stated with confidence:
{percent(share(visible))}.

A diagnoser that knows the rig's worlds and noise can quote d33 in the plain world and where the effect shows. Of
these are quoted here: {percent(share(ideal))}. Where an effect that does not show moves d33, the relative interval of a
quoted one holds what the world without the effect makes of the recordings: {percent(share(moved))}.
"""


def _counts(some: Sequence[Judgement]) -> list[str]:
    return [str(len(some)), *(str(sum(judgement["class"] == grade for judgement in some)) for grade in CLASSES)]


def _quoted(some: Sequence[Judgement]) -> list[str]:
    quoted = [judgement for judgement in some if judgement["quoted"]]
    if not quoted:
        return ["none quoted", ""]
    off = np.array([judgement["off"] for judgement in quoted])
    return [percent(share([judgement["inside"] for judgement in quoted])), f"{100 * np.sqrt(np.mean(off**2)):.1f} %"]
