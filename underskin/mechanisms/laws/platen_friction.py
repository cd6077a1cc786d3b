"""The mechanism `platen_friction`."""

from underskin.mechanisms.base import Mechanism, Stage, Values
from underskin.mechanisms.models.curve_state import Curve
from underskin.mechanisms.parameter import Parameter, Uniform

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
    kinds = ("compression",)
    axes = ("sample_height_mm", "sample_diameter_mm")
    figure = ("displacement_mm",)
    parameters_stated = (
        Parameter("friction", "-", 0.0, 1.0, Uniform(), "linear", limit=0.0, shown=0.5, reason=_REASON),
    )

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Let the platens hold."""
        curve.platen_friction = values["friction"]
