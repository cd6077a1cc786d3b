"""The mechanism `moving_contact_edge`."""

import numpy as np

from underskin.autodiff import Differentiated
from underskin.mechanisms.base import Mechanism, Stage, Values
from underskin.mechanisms.parameter import Parameter, Uniform
from underskin.units import Array, Floats

_STEP = 1e-3  # of the central difference over F, relative; its error is of the order of the step's square
_REASON = "from an edge pinned by adhesion to one that moves freely: nothing is known beforehand"


class MovingContactEdge(Mechanism):
    """A contact edge that moves with a small dynamic force."""

    name = "moving_contact_edge"
    plain = """The edge of the contact moves with the dynamic force, so the oscillating part of the pressure sits
    towards the rim, and a wide contact gives less charge than the steady pressure's shape says."""
    law = """σ → (1 − m) σ + m d(Fσ)/dF at fixed R, with every other mechanism of contact and stress inside the
    derivative (d33 multiplies it: preload_dependent_d33's is the tangent coefficient already); for the linear Hertz
    case d(Fσ)/dF = σ + (a/3) ∂σ/∂a, the flat punch's σ. FRF = charge over oscillating force."""
    assumptions = "m, the mobile fraction, is the same for all recordings; oscillations small against the preload."
    source = """Johnson, Contact Mechanics (1985), section 3.4 (an increment of Hertz' pressure is the flat punch's);
    Seminara 2018, equations 12 to 16, holds the edge still."""
    stage = Stage.LOAD_INCREMENT
    order = 10
    axes = ("preload_n", "indenter_radius_mm", "position_mm")
    parameters_stated = (
        Parameter(
            "mobile_fraction", "-", 0.0, 1.0, Uniform(), "linear", limit=0.0, shown=1.0, reason=_REASON, closed=(1.0,)
        ),
    )

    def force_nodes(self, force: Floats, dynamic_force: Floats) -> tuple[Array, Array]:
        """d(Fσ)/dF by a central difference."""
        up, down = 1 + _STEP, 1 - _STEP
        weight = np.array([up, -down]) / (2 * _STEP)
        return np.multiply.outer(np.array([up, down]), force), np.multiply.outer(weight, np.ones_like(force))

    def mobility(self, values: Values) -> Differentiated:
        """The mobile fraction."""
        return values["mobile_fraction"]
