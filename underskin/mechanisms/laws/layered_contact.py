"""The mechanism `layered_contact`."""

from underskin.mechanisms.base import Kind, Mechanism, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.curve_state import Curve
from underskin.recordings.conditions import Conditions


class LayeredContact(Mechanism):
    """Contact with a layer of finite thickness in place of a half space."""

    name = "layered_contact"
    plain = """The hard base under the thin skin holds against the sphere, so the skin feels stiffer and the contact
    stays smaller than on a deep block of the same material, the more so the wider it is."""
    law = """contact radius and pressure from the integral equation of a rigid sphere on the layer, (π/2) φ(x) − ∫₀^a
    φ(t) N(x,t) dt = (E'/2)(δ − x²/R), N = ∫₀^∞ (1 − K(ξh)) cos ξx cos ξt dξ, F = 2π ∫₀^a φ dt, φ(a) = 0; K is the
    surface deflection of the layer over the half space's, with its own ν and glue line; with adhesion where that
    mechanism is present too."""
    assumptions = """linear, frictionless contact; what finite strain adds is the table's at this a and L, that of a
    dead load. By the sphere's own finite-strain contact (tables/contact.h5) it adds less: σ on a sensor beneath is up
    to 1.7 % too high at L 0.001, up to 4 % at 0.01, and off by up to 9 % at 0.1."""
    source = "Lebedev & Ufliand, J. Appl. Math. Mech. 22 (1958) 442; Dimitriadis et al., Biophys. J. 82 (2002) 2798."
    stage = Stage.CONTACT
    order = 10
    kinds = ("frf", "indentation")
    axes = ("preload_n", "indenter_radius_mm", "position_mm")
    needs = "a declared thickness_mm"
    figure = ("preload_n", "force_n")

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """A thickness is needed."""
        return "skin.thickness_mm is not given" if conditions.skin.thickness_mm is None else None

    def on_material(self, contacts: Contacts, values: Values) -> None:
        """Press the layer."""
        contacts.layered = True

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Press the layer."""
        curve.layered = True
