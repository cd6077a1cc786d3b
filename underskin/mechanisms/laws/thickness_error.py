"""The mechanism `thickness_error`."""

from underskin.mechanisms.base import HeavyTailed, Mechanism, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import LARGEST_STRETCH, Contacts

_REASON = "a cast layer differs from its mould by shrinkage, meniscus and tilt: some to 20 percent"


class ThicknessError(Mechanism):
    """A declared thickness that is wrong by a factor."""

    name = "thickness_error"
    plain = """The thickness that was declared is not the skin's, a wrong number rather than missing physics, so the
    pressure spreads out more or less on its way to the sensors than computed, in every recording."""
    law = "h = declared h · factor; it acts through a/h, rT/h and e/h: everything."
    assumptions = "one factor for the whole skin, in all recordings."
    source = "Seminara 2018, equations 15 and 16: h is the unit of every length."
    stage = Stage.DECLARED
    order = 20
    axes = ("preload_n", "indenter_radius_mm", "position_mm")
    parameters_stated = (
        Parameter(
            "thickness_factor", "-", 0.65, LARGEST_STRETCH, HeavyTailed(0.0, 0.12), "log", limit=1.0, shown=0.9,
            reason=_REASON,
        ),
    )  # fmt: skip

    def act(self, state: Contacts, values: Values) -> None:
        """Scale the thickness."""
        state.thickness = state.thickness * values["thickness_factor"]
