"""σ at points beside the contacts, from the table alone or from the linear layer at hand plus finite strain.

The table serves Hertz' pressure on a bonded incompressible layer. Where a mechanism changes the pressure's shape or the
layer, σ = linear(p̂, M; a, e) + what finite strain adds, in contact with a half space [table(a, L, e) − table(a, 0, e)],
in contact with the layer itself the correction of the contact table; with the transform of the pressure

    p̂ = s p̂_sphere + (1 − s) p̂_punch,

s the sphere's share of the load; on the half space p̂_sphere is Hertz', 3 (sin x − x cos x)/x³, and p̂_punch sin x/x,
x = k a/h; on the layer both come from its own contact (contact_curves).
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import j0

from underskin.autodiff import Differentiated, as_columns, chain, contiguous, unfilled
from underskin.mechanisms.models.contact_stage import PressedContacts
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.off_centre_response import PANEL, OffsetSigma
from underskin.physics.contact_curves import ContactCurves
from underskin.physics.elastic_layer import Layer
from underskin.physics.hankel_transform import disc_average
from underskin.physics.skin import INCOMPRESSIBLE
from underskin.units import Floats, Indices


class SigmaOfContacts:
    """σ of all contacts at any place beside them.

    Attributes: `inside` (…, contacts), which are within the tables; `rho`, rT/h.
    """

    def __init__(
        self,
        sigma: OffsetSigma,
        contacts: Contacts,
        sensor_radius: float,
        pressed: PressedContacts | None = None,
        layer: ContactCurves | None = None,
    ) -> None:
        """`pressed` where the table is not of such contacts as they are; `layer` where the contact is the layer's own:
        all contacts then are on one and the same layer."""
        self._sigma = sigma
        self._sensor_radius, self._thickness = sensor_radius, contacts.thickness
        self.rho = sensor_radius / contacts.thickness
        a, x = _spheres(contacts) if pressed is None else (pressed.a_over_h, pressed.cbrt_load)
        self._variables = [a, x, self.rho]
        self._splines = sigma.hertz
        self._linear: Floats | None = None
        if pressed is not None and (layer is not None or not as_in_the_table(contacts)):
            self._linear, further = _transforms(sigma.wavenumber, contacts, pressed, self.rho.value, layer)
            self._variables += further
            self._splines = sigma.hertz_strain if layer is None else sigma.contact_strain
        self.inside = self._splines.contains(a.value, x.value)

    def at(self, contact: Indices, offset: Differentiated) -> Differentiated:
        """σ (…, points) at these offsets e/h from these contacts (points,)."""
        a, x, rho, *further = self._variables
        sigma = self._splines.at(contact, a, x, rho, offset)
        if self._linear is None:
            return sigma
        points = sigma.value.shape[:-1]
        linear, *partial, by_offset = self._sigma.linear_at(self._linear, contact, offset.value, points)
        variables = (variable[contact] for variable in (a, rho, *further))
        return sigma + chain(linear, (by_offset, offset), *zip(partial, variables, strict=bool(partial)))


def _spheres(contacts: Contacts) -> tuple[Differentiated, Differentiated]:
    """a/h and L^(1/3) of contacts that the table is of."""
    from underskin.mechanisms.models.hertz_kernel import spheres

    modulus, thickness = contacts.modulus, contacts.thickness
    shape = max(len(modulus.value), len(thickness.value)), len(contacts.force)
    a, x = (unfilled(len(modulus.slopes), shape) for _ in range(2))
    spheres(
        contacts.force,
        contacts.indenter_radius,
        *as_columns(modulus),
        *as_columns(thickness),
        *(a.value, a.slopes, x.value, x.slopes),
    )
    return a, x


def layer_of(contacts: Contacts) -> Layer:
    """The linear layer at hand."""
    slip = 0.0 if contacts.slip is None else float(contacts.slip.value.flat[0])
    return Layer(float(contacts.poisson_ratio.value.flat[0]), slip)


def as_in_the_table(contacts: Contacts) -> bool:
    """Whether the table is of such contacts: of spheres without adhesion, on a bonded incompressible layer."""
    nu = contacts.poisson_ratio
    incompressible = (nu.value == INCOMPRESSIBLE).all() and not nu.slopes.any()
    return contacts.work_of_adhesion is None and contacts.slip is None and bool(incompressible)


def _transforms(
    k: Floats, contacts: Contacts, pressed: PressedContacts, rho: Floats, layer: ContactCurves | None
) -> tuple[Floats, list[Differentiated]]:
    """p̂ · M · disc (quantities, …, contacts, k): its value, its derivatives by a/h, rT/h and what follows; and that."""
    slip = np.zeros(1) if contacts.slip is None else contacts.slip.value
    of_layer = [x for x in (contacts.poisson_ratio, contacts.slip) if x is not None and x.slopes.any()]
    shape = _half_space_shape(k, pressed) if layer is None else _layer_shape(pressed, layer, moving=bool(of_layer))
    transmission = Layer(contacts.poisson_ratio.value[..., None], slip[..., None]).transmission(k)
    by_poisson_ratio, by_slip = transmission.slopes
    disc, by_rho = _disc(k, rho[..., None])
    passed = transmission.value * disc
    terms: list[tuple[tuple[Floats | float, Floats], ...]] = [((shape.value, passed),)]
    further = []
    if any(x.slopes.any() for x in (pressed.a_over_h, contacts.thickness, *of_layer)):
        terms += [((shape.by_alpha, passed),), ((shape.value, transmission.value * by_rho),)]
        if pressed.sphere_share is not None:
            terms.append(((shape.by_share, passed),))
            further.append(pressed.sphere_share)
        if contacts.poisson_ratio in of_layer:
            terms.append(((shape.value, by_poisson_ratio * disc), (shape.by_poisson_ratio, passed)))
            further.append(contacts.poisson_ratio)
        if contacts.slip in of_layer:
            terms.append(((shape.value, by_slip * disc), (shape.by_slip, passed)))
            further.append(contacts.slip)
    whole = np.empty((len(terms), *np.broadcast_shapes(shape.value.shape, passed.shape)))
    for quantity, (first, *others) in zip(whole, terms, strict=True):
        np.multiply(*first, out=quantity)
        for one, other in others:
            quantity += one * other
    return whole, further


@dataclass(frozen=True)
class _Shape:
    """p̂ (…, contacts, k) and its derivatives; those that are 0 are numbers."""

    value: Floats
    by_alpha: Floats
    by_share: Floats
    by_poisson_ratio: Floats | float = 0.0
    by_slip: Floats | float = 0.0


def _half_space_shape(k: Floats, pressed: PressedContacts) -> _Shape:
    from underskin.mechanisms.models.sigma_kernel import sphere_and_punch

    alpha = pressed.a_over_h.value
    shapes = np.empty((4, alpha.size, len(k)))
    sphere_and_punch(k, PANEL, contiguous(alpha), shapes)
    sphere, punch, sphere_slope, punch_slope = shapes.reshape(4, *alpha.shape, len(k))
    if pressed.sphere_share is None:
        return _Shape(sphere, sphere_slope, sphere - punch)
    share = pressed.sphere_share.value[..., None]
    return _Shape(punch + share * (sphere - punch), punch_slope + share * (sphere_slope - punch_slope), sphere - punch)


def _layer_shape(pressed: PressedContacts, layer: ContactCurves, *, moving: bool) -> _Shape:
    alpha = pressed.a_over_h.value
    basis = layer.interval.basis(alpha.ravel()).reshape(*alpha.shape, -1)
    to_coefficients = layer.interval.coefficients(np.eye(len(layer.interval.nodes)))
    at, slope = basis @ to_coefficients, basis @ layer.interval.derivative(to_coefficients)

    def mixed(weights: Floats, sphere: Floats, punch: Floats) -> Floats:
        of_sphere = weights @ sphere
        if pressed.sphere_share is None:
            return of_sphere
        of_punch = weights @ punch
        return of_punch + pressed.sphere_share.value[..., None] * (of_sphere - of_punch)

    sphere, punch = layer.sphere_transform, layer.punch_transform
    by_layer = [mixed(at, *slopes) for slopes in zip(sphere.slopes, punch.slopes, strict=True)] if moving else []
    value, by_alpha = (mixed(weights, sphere.value, punch.value) for weights in (at, slope))
    return _Shape(value, by_alpha, at @ (sphere.value - punch.value), *by_layer)


def _disc(k: Floats, rho: Floats) -> tuple[Floats, Floats]:
    """2 J1(kρ)/(kρ) and its derivative by ρ, −2 J2(kρ)/ρ with J2(x) = 2 J1(x)/x − J0(x)."""
    average = disc_average(k * rho)
    return average, 2 * (j0(k * rho) - average) / rho
