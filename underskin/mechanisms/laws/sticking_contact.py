"""The mechanism `sticking_contact`."""

from underskin.mechanisms.base import Kind, Mechanism, Parameter, Stage, Uniform, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.recordings.campaign import Conditions

_REASON = "from a lubricated sphere to one that holds all it touches: nothing is known beforehand"


class StickingContact(Mechanism):
    """Friction that keeps the skin from slipping along the sphere."""

    name = "sticking_contact"
    plain = """The skin does not slip along the sphere, so a thin layer cannot flow out from under it, the contact stays
    smaller than a slippery one and presses more on what lies beneath, the more so the wider it is."""
    law = """σ plus f · (what tables/contact.h5 has for a sphere that sticks, over a/h and L of its contact), f from 0
    (slips freely) to 1 (sticks: a point stays where on the sphere it was touched, r + u_r = ρ(r) beside |x − c| = R,
    ρ(r) the radius of the contact's edge as it grew to r)."""
    assumptions = """solved for f = 0 and 1 in contact with the layer itself (layered_contact; without that mechanism
    the same is added to Hertz' contact, at its a/h), neo-Hookean with ν = 0.5, bonded to its base and without
    adhesion; between them σ is linear in f, which partial slip is not; what sticks in the static contact sticks in the
    oscillation. On an incompressible half space sticking changes nothing; at rT/h 0.6 it adds 8 % to σ and 15 % to its
    increment with the load where the layer's contact has a/h 0.9, 23 % and 35 % at 1.5, much as an edge that moves less
    does; with Hertz' contact at the same a/h about twice as much to the increment."""
    source = """Mossakovskii, J. Appl. Math. Mech. 27 (1963) 418; Spence, Proc. R. Soc. A 305 (1968) 55, for the linear
    half space; tablegen/sticking.py for the layer at finite strain."""
    stage = Stage.CONTACT
    order = 30
    axes = ("preload_n", "indenter_radius_mm", "position_mm")
    needs = "a declared thickness_mm and a skin declared with poisson_ratio 0.5"
    parameters_stated = (
        Parameter(
            "sticking_share", "-", 0.0, 1.0, Uniform(), "linear", limit=0.0, shown=1.0, reason=_REASON, closed=(1.0,)
        ),
    )

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """The solved layers are incompressible."""
        nu = conditions.skin.poisson_ratio
        return None if nu == INCOMPRESSIBLE else f"solved for incompressible skins (poisson_ratio is {nu:g})"

    def act(self, state: Contacts, values: Values) -> None:
        """Hold what is touched."""
        state.friction = values["sticking_share"]
