"""The mechanism `elastic_tip`."""

import math

from underskin.mechanisms.base import HeavyTailed, Mechanism, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts

_REASON = "rubber tips have 0.3 to 3 times the skin's E, soft printed ones 10, hard polymers hundreds of times"


class ElasticTip(Mechanism):
    """An indenter that yields too."""

    name = "elastic_tip"
    plain = """The tip is not rigid and flattens against the skin, so the contact is wider than that of a hard sphere,
    much as on a softer skin, but the base holds against the skin alone."""
    law = """1/E* = 1/E'_skin + 1/E'_tip, 1/E* = (1 + 1/e)/E'_skin, in a³ = 3FR/(4E*) and in the contact with the layer,
    where the compliance K(k) of the skin becomes (K(k) + 1/e)/(1 + 1/e); e = E'_tip/E'_skin."""
    assumptions = """the tip deforms as a half space, linear, without friction; to the skin it is a rigid sphere of the
    radius R (1 + 1/e), with which finite strain is entered, L = F/((1 + 1/e)² R² E). On a half space without finite
    strain it is a smaller E; contact with a thin layer tells it from modulus_error: at rT/h 0.6 and a layer's Hertz a/h
    of 0.3, 0.9, 1.5, e = 1 changes σ by −3, −20, −36 %, half of E by −3, −15, −20 %."""
    source = "Hertz 1882; Johnson, Contact Mechanics (1985), section 4.2: the depths of both bodies add."
    stage = Stage.CONTACT
    order = 40
    of = "rig"
    axes = ("preload_n", "indenter_radius_mm", "position_mm")
    parameters_stated = (
        Parameter("modulus_ratio", "-", 0.2, 1e4, HeavyTailed(math.log(20), 1.5), "log", math.inf, _REASON, shown=2.0),
    )

    def act(self, state: Contacts, values: Values) -> None:
        """Set the tip's share of the compliance."""
        state.tip = 1.0 / (1.0 + values["modulus_ratio"])
