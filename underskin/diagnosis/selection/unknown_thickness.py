"""A layer whose thickness indentations tell for themselves, beside recordings that may tell of another than declared.

The thickness may be declared wrongly, which FRFs tell (`thickness_error`). What indentations that feel the base tell of
it must then be known, and may not stand in their modulus.
"""

from underskin.mechanisms.base import Values
from underskin.mechanisms.laws.layered_contact import LayeredContact
from underskin.mechanisms.laws.thickness_error import ThicknessError
from underskin.mechanisms.models.curve_state import Curve

(UNKNOWN_THICKNESS,) = ThicknessError.parameters_stated
THICKNESS_ERROR = ThicknessError.name
THICKNESS = (LayeredContact.name, UNKNOWN_THICKNESS.name)


class LayerOfUnknownThickness(LayeredContact):
    """`layered_contact` of indentations with the thickness over the declared one as a parameter."""

    parameters_stated = (UNKNOWN_THICKNESS,)

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Press the layer of that thickness."""
        super().on_curve(curve, values)
        if curve.thickness is not None:
            curve.thickness = curve.thickness * values[UNKNOWN_THICKNESS.name]
