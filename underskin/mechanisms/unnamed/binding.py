"""A law that was found on one campaign, on other recordings of the skin: within its range, and nowhere else."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.mechanisms.base import Mechanism
from underskin.mechanisms.unnamed.axes import Axis, every_axis
from underskin.mechanisms.unnamed.laws import LagLaw, RecordingLaw, UnnamedLaw
from underskin.mechanisms.unnamed.level_tables import LevelTables
from underskin.recordings.conditions import Conditions, frf_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Mask

_ROUNDING = 1e-9  # of the range, by which a value may lie beyond it
OF_ONE_CAMPAIGN = ("order",)  # axes that say nothing of other recordings


def bound_to(
    law: UnnamedLaw, conditions: Conditions, table: SigmaTable, beside: Sequence[Mechanism]
) -> tuple[UnnamedLaw, Mask]:
    """The law on these recordings, and which of them (recordings,) lie in its range.

    A recording beyond the range, or that does not say where it lies, is predicted at the range's end.
    """
    ids = [entry.id for entry in frf_of(conditions)]
    if not isinstance(law, RecordingLaw | LagLaw):
        return law, np.ones(len(ids), dtype=bool)
    axis, inside = _on(law.axis, conditions, ids)
    if isinstance(law, LagLaw):
        return law.on(axis), inside
    return law.on(axis, LevelTables(conditions, table, beside)), inside


def _on(axis: Axis, conditions: Conditions, ids: Sequence[str]) -> tuple[Axis, Mask]:
    known = {
        (entry.name, entry.relative): entry
        for entry in every_axis(conditions, axis.origin)
        if entry.name not in OF_ONE_CAMPAIGN
    }
    found = known.get((axis.name, axis.relative))
    if found is not None and axis.name == "previous_preload_n":
        timed = all(entry.recorded_at is not None for entry in frf_of(conditions))
        found = found if timed else None  # nothing says which came before
    if found is None:
        return replace(axis, values=dict.fromkeys(ids, axis.low), range=(axis.low, axis.high)), np.zeros(
            len(ids), dtype=bool
        )
    if axis.words:
        words = [found.words[round(value)] for value in found.of(ids)]
        inside = np.array([word in axis.words for word in words])
        places = [float(axis.words.index(word)) if word in axis.words else 0.0 for word in words]
        return replace(axis, values=dict(zip(ids, places, strict=True)), range=(axis.low, axis.high)), inside
    values = found.of(ids)
    slack = _ROUNDING * axis.span
    inside = (values >= axis.low - slack) & (values <= axis.high + slack)
    clipped = np.clip(values, axis.low, axis.high).tolist()
    return replace(axis, values=dict(zip(ids, clipped, strict=True)), range=(axis.low, axis.high)), inside
