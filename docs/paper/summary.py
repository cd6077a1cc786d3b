"""The summary of docs/paper.md: every number is computed."""

from collections import Counter

import numpy as np

from docs.paper import cylinder
from docs.paper.claims import checked
from docs.paper.markdown import percent
from docs.paper.prototype import (
    CYLINDER_DIAMETER_MM,
    CYLINDER_HEIGHT_MM,
    INDENTERS_MM,
    MODULUS_MPA,
    PRELOADS_N,
    press,
)
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_TEXT = """\
## In short

- **The rigid base counts.** On the prototype the half space gives a σ {least:.1f} to {most:.1f} % below the layer's; a
  d33 found with it would be too large by as much as {too_large:.0f} %.
- **Finite strain is small there**: at the paper's loads it adds {least_load:.1f} to {most_load:.1f} % to σ.
- **The half space's error**, in the paper about 40, 10 and 1 % with the base at 2.5, 10 and 30 mm, cannot be repeated:
  40 % is within reach of a bonded base, 10 and 1 % are about ten times what is computed (a section below).
- **Of {claims} other statements of the paper**, {holds} hold, within what their rows below say, and {fails} does not;
  {open} hold in part or cannot be decided from what is at hand.
- **If the cylinder stuck to its platens**, E is {lower:.1f} instead of {modulus:g} MPa: contact radii are {wider:.0f} %
  larger, and d33 changes by at most {d33:.1f} %. Two cylinders of different heights would tell.
"""


def section(sigma_table: SigmaTable) -> str:
    """The whole section."""
    lower = MODULUS_MPA / cylinder.stiffness_ratio(CYLINDER_HEIGHT_MM, CYLINDER_DIAMETER_MM)
    stated = [press(sigma_table, radius, PRELOADS_N) for radius in INDENTERS_MM]
    softer = [press(sigma_table, radius, PRELOADS_N, youngs_modulus_mpa=lower) for radius in INDENTERS_MM]
    low = _percent([contact.half_space / contact.table for contact in stated])
    loaded = _percent([contact.table / contact.linear for contact in stated])
    pairs = list(zip(stated, softer, strict=True))
    changed = _percent([first.table / second.table for first, second in pairs])
    wider = _percent([larger.contact_radius_mm / smaller.contact_radius_mm for smaller, larger in pairs])
    verdicts = Counter(claim.verdict.split()[0].strip(":") for claim in checked(sigma_table))
    return _TEXT.format(
        least=-low.max(),
        most=-low.min(),
        too_large=percent(1.0, 1 + low.min() / 100),
        least_load=loaded.min(),
        most_load=loaded.max(),
        claims=verdicts.total(),
        holds=verdicts["holds"],
        fails=verdicts["does"],
        open=verdicts.total() - verdicts["holds"] - verdicts["does"],
        lower=lower,
        modulus=MODULUS_MPA,
        wider=float(np.median(wider)),
        d33=np.abs(changed).max(),
    )


def _percent(ratios: list[Floats]) -> Floats:
    """By how much the ratios at all spheres and preloads differ from 1."""
    return 100 * (np.concatenate(ratios) - 1)
