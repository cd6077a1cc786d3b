"""Random campaigns to be judged together, all of one truth: the documents, and the truth about them.

>>> documents, truth = drawn_joint(1, 0, "compression")
>>> [document["schema"] for document in documents], truth["schema"]
(['campaign/1'], 'joint_truth/1')
"""

from typing import Any

import numpy as np

from rig import checks
from rig.draw_joint import with_block, with_indentations
from rig.draw_joint_dates import two_dates
from rig.draw_joint_skins import skins_of_one_batch
from rig.joint_campaign import Joint, first_feasible
from rig.joint_truth import joint_truth

_DRAWN = {
    "compression": with_block,
    "indentation": with_indentations,
    "dates": two_dates,
    "skins": skins_of_one_batch,
}  # fmt: skip
WHAT = tuple(_DRAWN)


def joint_campaigns(seed: int, number: int, what: str | None = None) -> Joint:
    """Draw and record random joint campaigns `number` of a seed; what they join is drawn too if not given."""
    random = np.random.default_rng([seed, number, 29])
    drawn = _DRAWN[str(random.choice(WHAT)) if what is None else checks.choice("what", what, WHAT)]
    return first_feasible(drawn, random, f"drawn joint {seed}/{number}", f"skin-{seed}-{number}")


def drawn_joint(seed: int, number: int, what: str | None = None) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Random joint campaigns `number` of a seed.

    Parameters
    ----------
    seed, number : int
    what : str, optional
        One of `WHAT`; drawn too if not given.

    Returns
    -------
    documents : list of dict
        The campaigns (`campaign/1`).
    truth : dict
        The truth about them (`joint_truth/1`).
    """
    joint = joint_campaigns(seed, number, what)
    return [document.campaign() for document in joint.documents], joint_truth(joint)
