"""The stage that turns loads into contacts: radius, and the pressure's shape as a mixture of a sphere's and a punch's.

Four cases (Johnson, Kendall & Roberts, Proc. R. Soc. A 324 (1971) 301; Lebedev & Ufliand, J. Appl. Math. Mech. 22
(1958) 442): half space or layer, with or without adhesion. On the half space with adhesion a³ = 3 R F1/(4E'),
F1 = F + 3πwR + √(6πwRF + (3πwR)²), and the pressure is Hertz' under F1 less a flat punch's under F1 − F; on the
layer both parts are those of contact_curves.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from underskin.autodiff import Differentiated, cbrt, chain
from underskin.mechanisms.models.contact_state import Contacts
from underskin.physics.contact_curves import LARGEST_A_OVER_H, ContactCurves, CurveGrid
from underskin.physics.elastic_layer import Layer
from underskin.units import Floats


@dataclass(frozen=True)
class PressedContacts:
    """Contacts (rows,) under their loads."""

    a_over_h: Differentiated
    cbrt_load: Differentiated  # L^(1/3) to enter the table with
    sphere_share: Differentiated | None  # of the load, in the sphere's part of the pressure; None: all of it


@lru_cache(maxsize=8)  # most steps of a fit change neither the Poisson ratio nor the glue line
def layer_curves(grid: CurveGrid, layer: Layer) -> ContactCurves:
    """The contact curves of one layer at the wave numbers of a grid."""
    return grid.curves(layer)


def press(contacts: Contacts, curves: ContactCurves | None) -> PressedContacts:
    """The contacts under their forces; `curves`, of the layer at hand, where the contact is the layer's."""
    if curves is not None:
        return _on_layer(contacts, curves)
    if contacts.work_of_adhesion is None:
        return PressedContacts(contacts.hertz_radius / contacts.thickness, contacts.cbrt_load, None)
    pull = (1.5 * np.pi) * contacts.indenter_radius * contacts.work_of_adhesion
    root = 2.0 * (pull * (contacts.force + pull)) ** 0.5
    equivalent = contacts.force + 2.0 * pull + root
    radius = cbrt(0.75 * contacts.indenter_radius * equivalent / contacts.reduced_modulus)
    return PressedContacts(radius / contacts.thickness, contacts.cbrt_load, equivalent / contacts.force)


def _on_layer(contacts: Contacts, curves: ContactCurves) -> PressedContacts:
    scale = contacts.reduced_modulus * contacts.thickness**3.0
    load = contacts.force * contacts.indenter_radius / scale
    adhesion = contacts.work_of_adhesion
    root = None if adhesion is None else contacts.indenter_radius * (adhesion / scale) ** 0.5
    shape = load.value.shape
    solved = curves.at_load(load.value.ravel(), np.zeros(load.value.size) if root is None else root.value.ravel())
    slip = contacts.slip

    beyond = np.isnan(solved.alpha.value)  # of the curves' reach, which is beyond the table's

    def by_parameters(quantity: Differentiated, otherwise: Floats | float) -> Differentiated:
        slopes = np.where(beyond, 0.0, quantity.slopes).reshape(-1, *shape)
        by_load, by_root, by_poisson_ratio, by_slip = slopes
        terms = [(by_load, load), (by_poisson_ratio, contacts.poisson_ratio)]
        terms += [] if root is None else [(by_root, root)]
        terms += [] if slip is None else [(by_slip, slip)]
        value = np.where(beyond.reshape(shape), otherwise, quantity.value.reshape(shape))
        return chain(value, *terms)

    share = None if root is None else by_parameters(solved.sphere_load, load.value) / load
    return PressedContacts(by_parameters(solved.alpha, LARGEST_A_OVER_H), contacts.cbrt_load, share)


def stiffness(contacts: Contacts, pressed: PressedContacts, curves: ContactCurves) -> Differentiated:
    """dF/dδ = 2 E' a S(a/h) [N/m] of the layer at the contact radius in force, the edge held, E' unrelaxed."""
    alpha = pressed.a_over_h
    shape = alpha.value.shape
    at_radius = curves.stiffness_at(np.minimum(alpha.value, LARGEST_A_OVER_H).ravel())
    by_alpha, by_poisson_ratio, by_slip = at_radius.slopes.reshape(-1, *shape)
    terms = [(by_alpha, alpha), (by_poisson_ratio, contacts.poisson_ratio)]
    terms += [] if contacts.slip is None else [(by_slip, contacts.slip)]
    held = chain(at_radius.value.reshape(shape), *terms) * alpha * contacts.thickness
    held = 2.0 * contacts.reduced_modulus * held
    return held if contacts.relaxed is None else held / contacts.relaxed
