"""The elastomer stiffens with strain.

Law: E = E0 (1 + s ε), ε = 0.2 a/R the contact's representative strain, a³ = 3FR(1 − ν²)/(4E): solved together.

Assumptions: a contact is as stiff as a uniaxial sample at the representative strain; s is the secant modulus' slope.

Source: Tabor, The Hardness of Metals (1951), for 0.2 a/R; Lin, Dimitriadis & Horkay, J. Biomech. Eng. 129 (2007) 904.
"""

import numpy as np

from underskin.mechanisms.contact_state import Contacts
from underskin.mechanisms.differentiated import Array, chain
from underskin.mechanisms.mechanism import Mechanism, Normal, Parameter, Values
from underskin.recordings.campaign import Campaign

_STRAIN = 0.2  # of the contact, times R/a
_NEWTON_STEPS = 8


class StrainStiffening(Mechanism):
    """See the module."""

    name = "strain_stiffening"
    axes = ("preload_n", "indenter_radius_mm")

    def parameters(self, campaign: Campaign) -> tuple[Parameter, ...]:
        """The stiffening coefficient."""
        return (
            Parameter(
                name="stiffening",
                unit="-",
                low=0.0,
                high=40.0,
                prior=Normal(2.0, 5.0),
                scale="linear",
                limit=0.0,
                reason="1 for every incompressible neo-Hookean material; filled elastomers more",
            ),
        )

    def on_material(self, contacts: Contacts, values: Values) -> None:
        """Stiffen each contact by its own strain."""
        strain = _STRAIN * contacts.hertz_radius / contacts.indenter_radius
        excess = values["stiffening"] * strain
        ratio, slope = _radius_ratio(excess.value)
        contacts.modulus = contacts.modulus * (1.0 + excess * chain(ratio, (slope, excess)))


def _radius_ratio(excess: Array) -> tuple[Array, Array]:
    """y = a/a0 with y³ (1 + x y) = 1, and dy/dx: the stiffened contact's radius for x = s ε0."""
    y = 1 / np.cbrt(1 + excess)
    for _ in range(_NEWTON_STEPS):
        y = y - (y**3 + excess * y**4 - 1) / (3 * y**2 + 4 * excess * y**3)
    return y, -(y**4) / (3 * y**2 + 4 * excess * y**3)
