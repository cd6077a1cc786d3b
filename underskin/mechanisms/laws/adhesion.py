"""The mechanism `adhesion`."""

from underskin.mechanisms.base import Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.curve_state import Curve

_REASON = "0.04 J/m² is thermodynamic for silicone; rate effects and soft gels raise it to some J/m²"


class Adhesion(Mechanism):
    """Johnson-Kendall-Roberts adhesion between skin and sphere."""

    name = "adhesion"
    plain = (
        "The skin sticks to the sphere, so the contact is wider than the force alone would make it, most of all at "
        "low force, under large spheres and on soft skins."
    )
    law = (
        "Johnson, Kendall and Roberts: on the half space a³ = (3R/4E') [F + 3πwR + √(6πwRF + (3πwR)²)], pressure = "
        "Hertz' less a flat punch's; on the layer φ(a) = −√(2awE'/π) in the integral equation of layered_contact."
    )
    assumptions = (
        "short-ranged adhesion (soft, large contacts: Tabor's number far above 1), equilibrium on the loading branch "
        "under a given force. FRF = Q(F)/F with the static pressure. An indentation sticks from the first touch to "
        "the pull-off, which comes where the travel δ + F/k has its least value: at JKR's depth under a stiff stage, "
        "at the force −3πwR/2 under a soft one; from there on it must touch again."
    )
    source = "Johnson, Kendall & Roberts, Proc. R. Soc. A 324 (1971) 301."
    stage = Stage.CONTACT
    order = 20
    kinds = ("frf", "indentation")
    axes = ("preload_n", "indenter_radius_mm", "position_mm", "force_n")
    parameters_stated = (
        Parameter(
            "work_of_adhesion", "J/m²", 1e-3, 20.0, Normal(-1.6, 1.3), "log", limit=0.0, shown=0.5, reason=_REASON
        ),
    )

    def on_material(self, contacts: Contacts, values: Values) -> None:
        """Make it stick."""
        contacts.work_of_adhesion = values["work_of_adhesion"]

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Make it stick."""
        curve.work_of_adhesion = values["work_of_adhesion"]
