"""The mechanism `crosstalk`."""

import numpy as np

from underskin.mechanisms.base import HeavyTailed, Kind, Mechanism, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import FrfState, frf_design
from underskin.recordings.campaign import Conditions
from underskin.units import to_si

_LARGEST_DISTANCE = 3.0  # thicknesses; beyond it a bonded layer transmits less than a thousandth of the stress
_REASON = "coupling of unshielded leads is some to 20 percent"


class Crosstalk(Mechanism):
    """A fraction of the neighbouring sensors' charge in a sensor's channel."""

    name = "crosstalk"
    plain = """Part of the charge of the neighbouring sensors gets into a sensor's own channel, so a press that they
    feel as well reads too high."""
    law = """charge of a sensor = its own + fraction · Σ own charge of each sensor within 1.2 pitch, pitch being the
    smallest distance between two sensors."""
    assumptions = """the same fraction for all pairs; a neighbour's own charge follows from the same contact at its own
    offset, with the same d33 law (its own gain is taken as 1)."""
    source = "Ott, Electromagnetic Compatibility Engineering (2009), section 2.1 (capacitive coupling between leads)."
    stage = Stage.NEIGHBOURS
    order = 10
    of = "chain"
    axes = ("position_mm", "sensor")
    needs = "at least two sensors, and presses within three thicknesses of a neighbour"
    reads = ("sensor",)
    parameters_stated = (
        Parameter("fraction", "-", 0.0, 0.6, HeavyTailed(0.0, 0.15), "linear", limit=0.0, shown=0.1, reason=_REASON),
    )

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """A neighbour under stress is needed."""
        if len(conditions.skin.sensors) < 2:
            return "the skin has one sensor, and so no neighbours"
        design = frf_design(conditions, (), neighbours=True)
        nearest = np.hypot(design.point_x, design.point_y)[design.neighbour_point].min(initial=np.inf)
        if nearest > _LARGEST_DISTANCE * to_si("thickness_mm", conditions.skin.thickness_mm or 0.0):
            return "no recording presses within three thicknesses of a sensor's neighbour (position_mm)"
        return None

    def act(self, state: FrfState, values: Values) -> None:
        """The fraction."""
        state.factor = values["fraction"]
