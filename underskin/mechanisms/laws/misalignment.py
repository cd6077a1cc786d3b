"""The mechanism `misalignment`."""

from collections.abc import Collection, Mapping

import numpy as np

from underskin.errors import conflicting
from underskin.mechanisms.base import HeavyTailed, Kind, Mechanism, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import LARGEST_OFFSET_MM, FrfState
from underskin.recordings.campaign import Conditions, frf_of, offsets

_REASON = "a tip centred by eye is off by some tenths of a millimetre to a millimetre"


class Misalignment(Mechanism):
    """A constant offset between commanded and true position."""

    name = "misalignment"
    plain = """The sphere does not come down where the stage says but always a little to the same side, so each sensor
    shows what a press at that other place gives."""
    law = "true position = commanded + a constant offset, for all recordings."
    assumptions = """stage and array are shifted against each other, not turned or stretched. Where every press is
    commanded at a sensor's centre and no charge of its neighbours shows (crosstalk), the direction cannot be told, and
    the offset's length alone is a parameter."""
    source = """Sneddon, Fourier Transforms (1951), chapter 10: in the layer's Hankel integral the offset enters as J0(k
    e/h)."""
    stage = Stage.POSITION
    order = 10
    of = "rig"
    axes = ("position_mm", "sensor", "preload_n", "indenter_radius_mm")
    needs = "nothing; where every press is centred and nothing tells its direction, its length alone is a parameter"

    def parameters(
        self, conditions: Conditions, kind: Kind = "frf", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        """The offset's two components, or its length where its direction cannot be determined: by presses off centre,
        or by the charge of neighbours, which lie in known directions."""
        directed = offsets(conditions).any() or any(other.stage is Stage.NEIGHBOURS for other in others)
        figure_values, low = ({"offset": 0.7}, 0.0)
        if directed:
            figure_values, low = {"offset_x": 0.6, "offset_y": 0.3}, -LARGEST_OFFSET_MM
        return tuple(
            Parameter(
                name,
                "mm",
                low,
                LARGEST_OFFSET_MM,
                HeavyTailed(0.0, 0.7),
                "linear",
                limit=0.0,
                shown=value,
                reason=_REASON,
            )
            for name, value in figure_values.items()
        )

    def act(self, state: FrfState, values: Values) -> None:
        """Shift the contacts."""
        if "offset" in values:
            state.shift = 1e-3 * values["offset"], 0.0 * values["offset"]
        else:
            state.shift = 1e-3 * values["offset_x"], 1e-3 * values["offset_y"]


def transfer(values: Mapping[str, float], conditions: Conditions) -> Mapping[str, float]:
    """Centred presses need only the offset's length; without a direction no other press can be predicted."""
    if "offset" not in values:
        return {**values, "offset": float(np.hypot(values["offset_x"], values["offset_y"]))}
    off_centre = offsets(conditions).any(axis=1)
    if off_centre.any():
        recording = frf_of(conditions)[int(np.argmax(off_centre))]
        reason = "the adopted model knows how far presses miss it, not in which direction"
        allowed = f"must be the sensor's centre: {reason}"
        raise conflicting(f"recordings[{recording.id}].position_mm", recording.position_mm, allowed)
    return values
