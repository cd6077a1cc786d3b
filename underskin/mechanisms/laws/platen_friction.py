"""The mechanism `platen_friction`."""

from collections.abc import Sequence

import numpy as np

from underskin.mechanisms.base import Mechanism, Parameter, Stage, Uniform, Values
from underskin.mechanisms.models.curve_state import Curve
from underskin.recordings.campaign import CompressionConditions, Conditions

_LEAST_SHAPE_RATIO = 1.05  # of S²: with a smaller ratio, friction and modulus cannot be separated
_FRICTIONS = (0.0, 0.25, 0.5, 0.75, 1.0)  # evenly over its prior, with its ends: bonded ends are no rarity
_REASON = "from well oiled to bonded: nothing is known beforehand"


class PlatenFriction(Mechanism):
    """Platens that hold the ends of a compressed cylinder."""

    name = "platen_friction"
    plain = """The plates hold the ends of the compressed cylinder, so that it cannot widen freely and looks too stiff,
    the more so the flatter it is."""
    law = "nominal stress · (1 + 2 f S²), S = D/4H of the unloaded sample, f from 0 (slips) to 1 (sticks fully)."
    assumptions = """incompressible; Gent and Lindley's factor for bonded cylinders, which they use with the unloaded
    shape at large compressions as well; f constant. Samples of one shape cannot tell it from the modulus."""
    source = "Gent & Lindley, Proc. Inst. Mech. Eng. 173 (1959) 111."
    stage = Stage.CURVE
    order = 20
    of = "rig"
    kinds = ("compression",)
    axes = ("sample_height_mm", "sample_diameter_mm")
    parameters_stated = (
        Parameter("friction", "-", 0.0, 1.0, Uniform(), "linear", limit=0.0, shown=0.5, reason=_REASON, closed=(1.0,)),
    )

    def act(self, state: Curve, values: Values) -> None:
        """Let the platens hold."""
        state.platen_friction = values["friction"]


def hidden_in_modulus(conditions: Conditions) -> Sequence[float]:
    """Equally probable logarithms of the factor by which friction may raise the apparent modulus.

    Empty where samples of several shapes separate the two.
    """
    if len(distinct_shapes(conditions)) != 1:
        return ()
    return [float(np.log1p(2 * friction * np.mean(_shapes(conditions)))) for friction in _FRICTIONS]


def distinct_shapes(conditions: Conditions) -> list[float]:
    """S² of the cylinders, the least of each of the shapes that separate friction and modulus, rising."""
    distinct: list[float] = []
    for shape in sorted(_shapes(conditions)):
        if not distinct or shape > _LEAST_SHAPE_RATIO * distinct[-1]:
            distinct.append(shape)
    return distinct


def _shapes(conditions: Conditions) -> list[float]:
    """S² of each cylinder."""
    return [
        (0.25 * recording.sample_diameter_mm / recording.sample_height_mm) ** 2
        for recording in conditions.of(CompressionConditions)
    ]
