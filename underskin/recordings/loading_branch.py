"""The first loading branch of a curve: what a modulus is told from."""

import numpy as np

from underskin.errors import too_few, unequal_lengths, unusable
from underskin.units import Floats

FEWEST = 8  # samples


def loading_branch(along: Floats, load: Floats) -> tuple[Floats, Floats]:
    """The samples up to the largest load (samples,), of those where both are finite.

    `along` is the displacement or the strain, `load` the force or the stress, in any units. Raises InvalidInput where
    the two differ in length, fewer than `FEWEST` samples load, or nothing moves.
    """
    if len(along) != len(load):
        raise unequal_lengths("force_n", len(load), len(along), "displacement_mm")
    finite = np.isfinite(along) & np.isfinite(load)
    along, load = along[finite], load[finite]
    if len(load) < FEWEST:
        raise too_few("force_n", f"{len(load)} samples", f"must load over at least {FEWEST} entries")
    top = int(np.argmax(np.abs(load - load[0])))
    if top + 1 < FEWEST:
        raise too_few("force_n", f"largest at entry {top}", f"must load over at least {FEWEST} entries")
    if along[top] == along[0]:
        raise unusable("displacement_mm", float(along[top]), "must change while the force rises")
    return along[: top + 1], load[: top + 1]
