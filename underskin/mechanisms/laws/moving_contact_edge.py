"""The mechanism `moving_contact_edge`."""

from underskin.mechanisms.base import Mechanism, Parameter, Stage, Uniform, Values
from underskin.mechanisms.models.contact_state import FrfState

_REASON = "from an edge pinned by adhesion to one that moves freely: nothing is known beforehand"


class MovingContactEdge(Mechanism):
    """A contact edge that moves with the dynamic force."""

    name = "moving_contact_edge"
    plain = """The edge of the contact moves with the dynamic force, so the oscillating part of the pressure sits
    towards the rim, and a wide contact gives less charge than the steady pressure's shape says."""
    law = """σ → (1 − m) σ + m · (first harmonic of (F + Fd sin ωt) σ(F + Fd sin ωt))/Fd at fixed R, with every other
    mechanism of contact and stress inside; without a dynamic force its limit (1 − m) σ + m d(Fσ)/dF, for the linear
    Hertz case σ + (a/3) ∂σ/∂a, the flat punch's σ. d33 multiplies it: where it changes with stress
    (preload_dependent_d33) it is that at the preload and does not vary within the cycle."""
    assumptions = """m, the mobile fraction, is the same for all recordings; quasi-static over the cycle; where the
    dynamic force exceeds the preload, the sphere has left the skin for the rest of the cycle."""
    source = """Johnson, Contact Mechanics (1985), section 3.4 (an increment of Hertz' pressure is the flat punch's);
    Gelb & Vander Velde, Multiple-Input Describing Functions (1968), for the first harmonic, (2/π) ∫₋₁¹ Q(F + Fd s)
    s/√(1 − s²) ds, by Gauss–Chebyshev quadrature. Seminara 2018, equations 12 to 16, holds the edge still."""
    stage = Stage.LOAD_INCREMENT
    order = 10
    axes = ("preload_n", "indenter_radius_mm", "position_mm", "dynamic_force_n")
    parameters_stated = (
        Parameter(
            "mobile_fraction", "-", 0.0, 1.0, Uniform(), "linear", limit=0.0, shown=1.0, reason=_REASON, closed=(1.0,)
        ),
    )

    def act(self, state: FrfState, values: Values) -> None:
        """The share of the first harmonic: the mobile fraction."""
        state.factor = values["mobile_fraction"]
