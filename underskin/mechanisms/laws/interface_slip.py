"""The mechanism `interface_slip`."""

import math

from underskin.mechanisms.base import HeavyTailed, Mechanism, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts

_REASON = "(G_glue/G) (h/t): a tape 0.1 mm thick, 1000 times softer, has 0.02; above 50 no effect"


class InterfaceSlip(Mechanism):
    """A glue line under the skin with a finite shear stiffness."""

    name = "interface_slip"
    plain = """The glue under the skin gives way sideways, so the pressure reaches the sensors in another shape, which
    shows beside them and with centred presses looks much like another d33."""
    law = """τ = κ (G/h) u_r at the base, in place of u_r = 0; it changes the layer's transmission M and its compliance
    K."""
    assumptions = """a linear glue line of one stiffness everywhere; κ = ∞ is bonded, κ = 0 frictionless. The layer is
    the linear one; what finite strain adds is taken from the bonded table."""
    source = """Goodman, Taylor & Brekke, J. Soil Mech. Found. Div. 94 (1968) 637 (joint stiffness); Sneddon, Fourier
    Transforms (1951), chapter 10, for the layer: the closed forms of M and K stand in
    underskin/physics/elastic_layer.py."""
    stage = Stage.MATERIAL
    order = 20
    axes = ("position_mm", "preload_n", "indenter_radius_mm")
    parameters_stated = (
        Parameter(
            "glue_stiffness", "-", 0.01, 50.0, HeavyTailed(-0.3, 1.5), "log", limit=math.inf, shown=0.3, reason=_REASON
        ),
    )

    def act(self, state: Contacts, values: Values) -> None:
        """Set the slip, 1/(1 + κ)."""
        state.slip = 1.0 / (1.0 + values["glue_stiffness"])
