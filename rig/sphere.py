"""A sphere on an elastic body of unit modulus, as a sum of flat punches: the law that every indentation follows.

Pressing a punch of any convex shape is adding rings: a ring that joins at contact radius x adds dk(x) to the stiffness
and carries θ(x) = δ − δ₀(x), where k(a) = dF/dδ is the stiffness of the flat punch of radius a and δ₀(a) the depth at
which the contact without adhesion is as wide as a:
    F = ∫₀^a θ(x) dk(x).
At the edge, the tension −θ(a) = √G p(a) balances the energy release rate G (Johnson, Kendall and Roberts 1971). Half
space: k = 2E'a, δ₀ = a²/R, p = √(2πa/E'). Source of the superposition: Mossakovskii 1963; Jäger, Arch. Appl. Mech. 65
(1995).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rig import effects
from rig.contact import WIDEST, sphere_contact
from rig.effects import Values
from rig.errors import RigError
from rig.layer import Floats, Layer
from rig.layer_contacts import locking, stiffening

_NODES = 800
_UNEVEN = 1.5  # power of the nodes: denser where the contact is small
_MARGIN = 1.6  # of the contact radius at the largest depth
_NARROWEST = 1e-4  # a/h; the solution of the layer begins above 0


@dataclass(frozen=True)
class SphereLaw:
    """Arrays over contact radii from 0 (nodes,), for E = 1: lengths in mm, forces in mm².

    Attributes
    ----------
    radius : ndarray
        Contact radius a.
    depth : ndarray
        δ₀(a).
    punch : ndarray
        k(a).
    pull : ndarray
        p(a), so that the edge carries a tension √G p(a) with G over E [mm].
    stiffer : ndarray
        E at the contact strain of a over E.
    """

    radius: Floats
    depth: Floats
    punch: Floats
    pull: Floats
    stiffer: Floats

    @property
    def missing(self) -> Floats:
        """∫ δ₀ dk up to each node: what the depth of the rings takes from k δ."""
        steps = np.diff(self.punch) * (self.depth[1:] + self.depth[:-1]) / 2
        return np.append(0.0, np.cumsum(steps))

    def on_branch(self, release: float) -> tuple[Floats, Floats]:
        """Depth [mm] and force [mm²] of the elastic contact whose energy release rate over E is `release` [mm]."""
        depth = self.depth - self.pull * np.sqrt(release / self.stiffer)
        return depth, self.stiffer * (self.punch * depth - self.missing)


def sphere_law(
    on: Mapping[str, Values], radius_mm: float, thickness_mm: float, largest_mm: float, beyond_mm: float = 0.0
) -> SphereLaw:
    """The law of a sphere under the effects that act on the contact itself.

    Parameters
    ----------
    on : mapping
        The effects, with their parameters.
    radius_mm, thickness_mm : float
        Of the sphere and of the layer.
    largest_mm : float
        Largest depth that is pressed.
    beyond_mm : float
        Depth that the law is to reach besides, as far as it does not lock.

    Raises
    ------
    RigError
        Where the depth is beyond what the rig has solved.
    """
    nu = effects.of(on, "compressible_layer", "poisson_ratio") or 0.5
    plane = 1 / (1 - nu**2)
    share = np.linspace(0, 1, _NODES) ** _UNEVEN
    widest = _MARGIN * np.sqrt(radius_mm * max(largest_mm, beyond_mm))
    if "layered_contact" in on:
        law = _on_layer(Layer(nu), share, radius_mm, thickness_mm, widest)
        if law.depth[-1] < largest_mm:
            allowed = f"must be at most {law.depth[-1]:.3g} mm: beyond, the contact is wider than 4 thicknesses"
            raise RigError("curves.largest_displacement_mm", largest_mm, allowed)
    else:
        flat = effects.of(on, "flattened_tip", "radius_mm")
        a = share * (widest + flat)
        depth = a * np.sqrt(np.maximum(a**2 - flat**2, 0)) / radius_mm
        law = SphereLaw(a, depth, 2 * plane * a, np.sqrt(2 * np.pi * a / plane), np.ones_like(a))
    if "strain_stiffening" not in on:
        return law
    strain = 0.2 * law.radius / radius_mm
    values = on["strain_stiffening"]
    stiffening(values, np.interp([largest_mm], law.depth, strain))  # raises where the law locks before
    # What sticks is wider than that: a contact that grows up to where the law locks is refused on its way.
    reached = strain <= locking(values)
    radius, depth, punch, pull = (column[reached] for column in (law.radius, law.depth, law.punch, law.pull))
    return SphereLaw(radius, depth, punch, pull, stiffening(values, strain[reached]))


def _on_layer(layer: Layer, share: Floats, radius: float, thickness: float, widest: float) -> SphereLaw:
    """From the solution of the layer, in units of its thickness; at its narrowest it is that of the half space."""
    a = np.maximum(share * min(WIDEST, 1.5 * widest / thickness), _NARROWEST)
    contact, shape = sphere_contact(layer), np.ones_like(a)
    depth = contact.depth(a, radius / thickness, 1.0)
    pull = depth - contact.depth(a, radius / thickness, 1.0, 1.0)
    first = share == 0
    radii, depths, punch = (
        np.where(first, 0.0, column) * thickness for column in (a, depth, contact.stiffness(a, 1.0))
    )
    return SphereLaw(radii, depths, punch, np.where(first, 0.0, pull) * np.sqrt(thickness), shape)
