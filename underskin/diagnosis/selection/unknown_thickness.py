"""A layer whose thickness indentations tell for themselves, beside recordings that may tell of another than declared.

The thickness may be declared wrongly, which FRFs tell (`thickness_error`). What indentations that feel the base tell of
it must then be known, and may not stand in their modulus.
"""

from underskin.mechanisms.base import Kind, Values
from underskin.mechanisms.laws.layered_contact import LayeredContact
from underskin.mechanisms.laws.thickness_error import ThicknessError
from underskin.mechanisms.models.curve_state import Curve
from underskin.mechanisms.parameter import Parameter
from underskin.recordings.conditions import Conditions

(UNKNOWN_THICKNESS,) = ThicknessError.parameters_stated
THICKNESS_ERROR = ThicknessError.name
THICKNESS = (LayeredContact.name, UNKNOWN_THICKNESS.name)


class LayerOfUnknownThickness(LayeredContact):
    """`layered_contact` of indentations with the thickness over the declared one as a parameter."""

    parameters_stated = (UNKNOWN_THICKNESS,)

    def parameters(self, conditions: Conditions, kind: Kind = "frf") -> tuple[Parameter, ...]:  # noqa: ARG002
        """The thickness over the declared one."""
        return self.parameters_stated

    def follows_from_declared(self, conditions: Conditions, kind: Kind) -> bool:  # noqa: ARG002
        """Its thickness is free."""
        return False

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Press the layer of that thickness."""
        super().on_curve(curve, values)
        if curve.thickness is not None:
            curve.thickness = curve.thickness * values[UNKNOWN_THICKNESS.name]
