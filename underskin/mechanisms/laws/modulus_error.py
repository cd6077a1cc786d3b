"""The mechanism `modulus_error`."""

from underskin.mechanisms.base import HeavyTailed, Kind, Mechanism, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.curve_state import Curve
from underskin.recordings.campaign import Conditions

LARGEST_FACTOR = 4.0  # true over declared, or the inverse: beyond, another unit or material is more likely
_REASON = "E from a durometer, a data sheet or another cure is off by tens of percent, at times by a factor of 2 to 4"


class ModulusError(Mechanism):
    """A declared Young's modulus that is wrong by a factor."""

    name = "modulus_error"
    plain = """The Young's modulus that was declared is not the skin's, a wrong number rather than missing physics, so
    every contact is wider or narrower than computed, which shows the more the wider it is."""
    law = """E = declared E · factor; it acts through a³ ∝ 1/E and L ∝ 1/E, and on an indentation's or compression's
    force."""
    assumptions = "one factor for the whole skin, in all recordings."
    source = """Seminara 2018, equations 7 to 10 and 16: E enters through a and L; under force control a linear layer
    transmits a given pressure alike whatever its modulus."""
    stage = Stage.DECLARED
    order = 10
    kinds = ("frf", "indentation", "compression")
    axes = ("preload_n", "indenter_radius_mm", "position_mm")
    needs = "a declared youngs_modulus_mpa"
    parameters_stated = (
        Parameter(
            "modulus_factor",
            "-",
            1 / LARGEST_FACTOR,
            LARGEST_FACTOR,
            HeavyTailed(0.0, 0.45),
            "log",
            limit=1.0,
            shown=0.7,
            reason=_REASON,
        ),
    )

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """A declared modulus is needed."""
        if conditions.skin.youngs_modulus_mpa is None:
            return "skin.youngs_modulus_mpa is not declared, and so free already"
        return None

    def act(self, state: Contacts | Curve, values: Values) -> None:
        """Scale the modulus."""
        state.modulus = state.modulus * values["modulus_factor"]
