"""d33 by the contact model that was not asked for, where the two say different things."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from underskin.findings.formatting import significant
from underskin.physics.charge_response import gain
from underskin.prediction.answers import pressed
from underskin.surrogate.contact_model import ContactName
from underskin.surrogate.sigma_table import SigmaTable
from underskin.surrogate.solved_contact import contact_model
from underskin.units import Floats, Mask

OTHER: Mapping[ContactName, ContactName] = {"paper": "solved", "solved": "paper"}
WORDS: Mapping[ContactName, str] = {
    "paper": "under Hertz' pressure (paper)",
    "solved": "in contact with the layer itself (solved)",
}
STATED = 0.01  # relative difference from which on the other value is stated


@dataclass(frozen=True)
class OtherContact:
    """d33 [pC/N] (rows,) by the contact `name`, NaN outside its domain, and in which rows it `differs` by more than 1 %
    from the one asked for."""

    name: ContactName
    d33: Floats
    ratio: Floats  # over the one asked for

    @property
    def differs(self) -> Mask:
        """False where either has no value."""
        return np.abs(self.ratio - 1) > STATED

    @property
    def sentence(self) -> str:
        """In words, empty where no row differs."""
        differs = self.differs
        if not differs.any():
            return ""
        if differs.size == 1:
            return f"d33 {WORDS[self.name]}: {significant(float(self.d33.flat[0]), 4)} pC/N"
        percent = 100 * (self.ratio[differs] - 1)
        low, high = (f"{value:+.1f}" for value in (percent.min(), percent.max()))
        by = f"{low} %" if low == high else f"{low} to {high} %"
        return f"d33 {WORDS[self.name]} differs in {differs.sum()} of {differs.size} rows, by {by}"


def other_contact(
    table: SigmaTable,
    asked_for: ContactName,
    given: Mapping[str, Floats],
    d33: Floats,
    *,
    units_checked: bool,
) -> OtherContact:
    """d33 by the other contact.

    Parameters
    ----------
    table : the σ table.
    asked_for : the contact by which `d33` [pC/N] (rows,) was found.
    given : columns in lab units by field name, as for `answers.d33`.
    units_checked : accept magnitudes that look like a slip of units.
    """
    name = OTHER[asked_for]
    with np.errstate(all="ignore"):  # what overflows is outside
        reached = pressed(contact_model(table, name), given, units_checked)
        other = given["frf_pc_per_n"] / gain(reached.sigma, reached.rt_over_h)
        return OtherContact(name, other, other / d33)
