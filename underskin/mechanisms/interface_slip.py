"""The glue line between layer and substrate yields in shear.

Law: τ = κ (G/h) u_r at the base, in place of u_r = 0; it changes the layer's transmission M and its compliance K.

Assumptions: a linear glue line of one stiffness everywhere; κ = ∞ is bonded, κ = 0 frictionless. Needs the linear
layer of PHYSICS, section 3; what finite strain adds is taken from the bonded table.

Source: PHYSICS, sections 3 and 8; Goodman, Taylor & Brekke, J. Soil Mech. Found. Div. 94 (1968) 637 (joint stiffness).
"""

from underskin.mechanisms.contact_state import Contacts
from underskin.mechanisms.mechanism import Kind, Mechanism, Normal, Parameter, Values
from underskin.recordings.campaign import Campaign


class InterfaceSlip(Mechanism):
    """See the module."""

    name = "interface_slip"
    axes = ("position_mm", "preload_n", "indenter_radius_mm")

    def parameters(self, campaign: Campaign, kind: Kind = "frf") -> tuple[Parameter, ...]:
        """The glue line's stiffness in units of the layer's own."""
        return (
            Parameter(
                name="glue_stiffness",
                unit="-",
                low=0.01,
                high=50.0,
                prior=Normal(-0.3, 1.5),
                scale="log",
                limit=float("inf"),
                reason="(G_glue/G) (h/t): a tape 0.1 mm thick, 1000 times softer, has 0.02; above 50 no effect",
            ),
        )

    def on_material(self, contacts: Contacts, values: Values) -> None:
        """Set the slip, 1/(1 + κ)."""
        contacts.slip = 1.0 / (1.0 + values["glue_stiffness"])
