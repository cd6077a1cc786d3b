"""The contacts of FRF recordings as mechanisms change them, and the stage that turns loads into contacts. SI.

Radius, and the shape of the pressure as a mixture of a sphere's and a punch's, in four cases (Johnson, Kendall &
Roberts, Proc. R. Soc. A 324 (1971) 301; Lebedev & Ufliand, J. Appl. Math. Mech. 22 (1958) 442): half space or layer,
with or without adhesion. On the half space with adhesion a³ = 3 R F1/(4E'), F1 = F + 3πwR + √(6πwRF + (3πwR)²), and
the pressure is Hertz' under F1 less a flat punch's under F1 − F; on the layer both parts are those of
contact_curves.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from underskin.autodiff import Differentiated, cbrt, chain, stacked
from underskin.mechanisms.models.frf_design import FrfDesign, Pickup
from underskin.physics.contact_curves import LARGEST_A_OVER_H, ContactCurves, CurveGrid
from underskin.physics.elastic_layer import Layer
from underskin.units import Floats, Indices


@dataclass
class Contacts:
    """One row per contact, (…, contacts); a Differentiated of a single row is broadcast to all."""

    force: Floats  # F [N]
    indenter_radius: Floats  # R [m]
    dwell: Floats  # time since the preload was put on [s]; 0 where no mechanism reads it
    modulus: Differentiated  # E [Pa] in force in each contact: that of the static contact
    thickness: Differentiated  # h [m], of one row
    poisson_ratio: Differentiated  # ν, of one row
    slip: Differentiated | None = None  # of the glue line, 1/(1 + κ), of one row; None where it is rigid
    work_of_adhesion: Differentiated | None = None  # w [J/m²], of one row; None without adhesion
    relaxed: Differentiated | None = None  # that E over the one that a fast oscillation meets; None where they are one
    second_over_first: Differentiated | None = None  # c₂ of Yeoh's law, of one row; None of a neo-Hookean layer
    friction: Differentiated | None = None  # 0 slips to 1 sticks, of one row; None of a frictionless sphere
    layered: bool = False  # contact by the layer of finite thickness, not by the half space
    stiffness: Differentiated | None = None  # dF/dδ [N/m] at the present radius, where a mechanism reads it

    @property
    def optional(self) -> tuple[Differentiated | None, ...]:
        """What only some mechanisms set: contacts are of one structure where the same of these are None."""
        return self.slip, self.work_of_adhesion, self.relaxed, self.second_over_first, self.friction

    def at_points(self, subset: Indices | None) -> Contacts:
        """At some of several points (points, contacts), at all for None."""
        if subset is None:
            return self
        return self._with({name: x.at_points(subset) for name, x in self._differentiated().items()})

    @classmethod
    def stacked(cls, parts: Sequence[Contacts], points: Sequence[int]) -> Contacts:
        """Contacts of the same structure at several sets of points, stacked; `points` is the size of each set."""
        if len(parts) == 1:
            return parts[0]
        fields = [part._differentiated() for part in parts]
        return parts[0]._with({name: stacked([values[name] for values in fields], points) for name in fields[0]})

    def _with(self, changed: dict[str, Any]) -> Contacts:
        other = copy(self)
        vars(other).update(changed)
        return other

    def _differentiated(self) -> dict[str, Differentiated]:
        return {name: value for name, value in vars(self).items() if isinstance(value, Differentiated)}

    @property
    def reduced_modulus(self) -> Differentiated:
        """E' = E/(1 − ν²) [Pa]."""
        return self.modulus / (1 - self.poisson_ratio**2.0)

    @property
    def hertz_radius(self) -> Differentiated:
        """a [m] of a sphere on a half space without adhesion, a³ = 3 F R/(4 E'): `hertz.contact_radius` with slopes."""
        nu = self.poisson_ratio.value
        area = 1 - nu * nu
        a = np.cbrt(0.75 * self.force * self.indenter_radius * area / self.modulus.value)
        return chain(a, (-a / (3 * self.modulus.value), self.modulus), (a * (-2 * nu / (3 * area)), self.poisson_ratio))

    @property
    def cbrt_load(self) -> Differentiated:
        """L^(1/3) with which to enter the tables, which are for ν = 0.5: L = F/(R² E) · (0.75/(1 − ν²))²."""
        nu = self.poisson_ratio.value
        area = 1 - nu * nu
        x = np.cbrt(self.force / self.indenter_radius**2 / self.modulus.value * (0.75 / area) ** 2)
        return chain(x, (-x / (3 * self.modulus.value), self.modulus), (x * (4 * nu / (3 * area)), self.poisson_ratio))


@dataclass
class FrfState:
    """What a law of FRFs reads beside its parameters, and what it sets, at several points of the fit coordinates.

    By stage, `factor` is: LOAD_INCREMENT the share of the first harmonic in the oscillation; SENSOR a factor on d33 at
    each of the design's points; NEIGHBOURS the share of the neighbours' charge in a sensor's; RECORDING a factor on
    each recording; LINES a complex factor on each distinct line. At POSITION a law sets `shift`, at ADDED_CHARGE
    `pickup`.
    """

    design: FrfDesign
    loaded: Contacts | None = None  # the contacts, from POSITION on
    sigma: Differentiated | None = None  # σ under the preload at each of the design's points, at SENSOR
    factor: Differentiated | None = None
    shift: tuple[Differentiated, Differentiated] | None = None  # x and y added to the contacts' position [m]
    pickup: Pickup | None = None

    @property
    def contacts(self) -> Contacts:
        """The contacts, with their stiffness where a mechanism reads it."""
        assert self.loaded is not None
        return self.loaded

    @property
    def mean_stress(self) -> Differentiated:
        """The static stress [Pa] at each of the design's points, mean over the sensor, compression positive."""
        assert self.sigma is not None
        force = 1.5 / np.pi * self.design.force[self.design.point_contact]
        return self.sigma * force / (self.contacts.thickness**2.0)


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
    """The contacts under their forces; `curves` of the layer for contact with the layer itself."""
    if curves is not None:
        return _on_layer(contacts, curves)
    if contacts.work_of_adhesion is None:
        return PressedContacts(contacts.hertz_radius / contacts.thickness, contacts.cbrt_load, None)
    adhesive_force = (1.5 * np.pi) * contacts.indenter_radius * contacts.work_of_adhesion
    root = 2.0 * (adhesive_force * (contacts.force + adhesive_force)) ** 0.5
    equivalent = contacts.force + 2.0 * adhesive_force + root
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
    """dF/dδ = 2 E' a S(a/h) [N/m] of the layer at the present contact radius, with the edge fixed and E' unrelaxed."""
    alpha = pressed.a_over_h
    shape = alpha.value.shape
    at_radius = curves.stiffness_at(np.minimum(alpha.value, LARGEST_A_OVER_H).ravel())
    by_alpha, by_poisson_ratio, by_slip = at_radius.slopes.reshape(-1, *shape)
    terms = [(by_alpha, alpha), (by_poisson_ratio, contacts.poisson_ratio)]
    terms += [] if contacts.slip is None else [(by_slip, contacts.slip)]
    result = chain(at_radius.value.reshape(shape), *terms) * alpha * contacts.thickness
    result = 2.0 * contacts.reduced_modulus * result
    return result if contacts.relaxed is None else result / contacts.relaxed
