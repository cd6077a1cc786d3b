"""σ of many contacts on one skin at any offset from the sensor, with derivatives, as cubic splines.

The bottom profile of the σ table, averaged over the sensor's disc at its offset, is tabulated once as a cubic spline in
a/h, L^(1/3), log(rT/h) and e/h. It holds for Hertz' pressure on a bonded incompressible layer. Where a mechanism
changes the shape of the pressure or the layer,

    σ = linear(p̂, M; a, e) + finite strain,

with the Hankel integral of the linear layer (underskin/physics/hankel_transform.py). The finite-strain term is
table(a, L, e) − table(a, 0, e) in contact with a half space, and the correction of the contact table
(tables/contact.h5) in contact with the layer itself. To the latter a compressible layer adds what the same table has
for its ν, and a sphere that sticks what it has for friction. A layer that stiffens by Yeoh's law adds what it has for
its c₂, in contact with a half space too, with the α of Hertz. The transform of the pressure is p̂ = s p̂_sphere + (1 −
s) p̂_punch, s the sphere's share of the load; on the half space p̂_sphere is Hertz', 3 (sin x − x cos x)/x³, and
p̂_punch sin x/x, x = k a/h; on the layer both come from its own contact (elastic_layer). To M a film that the layer's
shear stretches adds its charge.

A contact beyond the table is reported in `inside`. Beyond the table's L it is continued along the tangent, beyond
its a/h along the tangent over 1/a², as which the pressure under a wide contact falls (on the axis within 3 % up to
a/h = 4.2); beyond the profile's end, r/h = 8, the stress is 0 (below 1e-6 of its peak).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.special import j0

from underskin.autodiff import Differentiated, chain, contiguous, log
from underskin.mechanisms.models.contact_state import Contacts, PressedContacts
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.physics.elastic_layer import ContactCurves, CurveGrid, Layer
from underskin.physics.hankel_transform import disc_average
from underskin.surrogate.hdf5_format import load_contact
from underskin.surrogate.sigma_table import CubicAxis, SigmaTable, TensorSpline, joined
from underskin.units import Floats, Indices, Mask

PROFILE_END = 8.0
_SPACING = 0.0625  # of the profile and of the offsets; the profile turns over lengths of 0.3 h and more
_MIRRORED = 4  # offsets below 0, so that the curve is even
_RHO_RATIO = 1.1  # of neighbouring rT/h in the table
_WAVENUMBER_END, _NODES_PER_TURN = 24.0, 4  # M decays as e^(−k)
PANEL = 16  # wave numbers in each of several equal panels


class OffsetSigma:
    """σ(a/h, L^(1/3), rT/h, e/h) around one rT/h, for offsets up to `largest_offset` (in h).

    Attributes: `hertz`, σ of the table, a spline in a/h, L^(1/3), ln(rT/h) and e/h; `end`, the largest offset e/h,
    beyond which σ is 0.
    """

    def __init__(self, table: SigmaTable, rt_over_h: float, stretch: float, largest_offset: float) -> None:
        """Tabulate for rT/h up to `stretch` times larger or smaller; takes hundredths to tenths of a second."""
        count = int(np.ceil(largest_offset / _SPACING)) + 2 * _MIRRORED + 1
        offsets = np.asarray(_SPACING * (np.arange(count) - _MIRRORED), dtype=np.float64)
        rho_nodes = max(5, 1 + int(np.ceil(2 * np.log(stretch) / np.log(_RHO_RATIO))))
        rho = np.asarray(rt_over_h * np.geomspace(1 / stretch, stretch, rho_nodes), dtype=np.float64)
        radii = np.arange(0.0, min(PROFILE_END, offsets[-1] + rho[-1]) + _SPACING / 2, _SPACING)
        radii = np.append(radii, radii[-1] + _SPACING * np.arange(1, 4)) if len(radii) < 4 else radii
        radial = CubicAxis(radii)
        self._of_rho, self._of_offset = of_rho, of_offset = CubicAxis(np.log(rho)), CubicAxis(offsets)
        self._offset_axis = joined([of_offset])
        self.end = min(float(offsets[-1]), PROFILE_END)
        # Splines and averages are all linear: the smaller arrays are turned into coefficients before their product
        average = np.stack([radial.disc_averages(np.abs(offsets), ratio) for ratio in rho])
        self._radii, self._average = radii, of_offset.coefficients(of_rho.coefficients(average, 0), 1)
        self.hertz = self._splines(*table.contact_axes, table.profile_over(radii))
        self._farthest = float(offsets[-1] + rho[-1] + table.contact_axes[0][-1])

    def _splines(self, a_over_h: Floats, cbrt_load: Floats, profile: Floats) -> TensorSpline:
        """The disc averages of a profile (a, L^(1/3), radii)."""
        of_a, of_x = CubicAxis(a_over_h), CubicAxis(cbrt_load)
        coefficients = of_x.coefficients(of_a.coefficients(profile, 0), 1)
        coefficients = np.tensordot(coefficients, self._average, (2, 2))
        return TensorSpline((of_a, of_x, self._of_rho, self._of_offset), coefficients)

    @cached_property
    def hertz_strain(self) -> TensorSpline:
        """The effect of finite strain under Hertz' pressure: the first coefficient over L^(1/3) is the value at L =
        0, and splines sum to 1."""
        table = self.hertz.coefficients
        return TensorSpline(self.hertz.axes, table - table[:, :1])

    @cached_property
    def contact_strain(self) -> TensorSpline:
        """The effect of finite strain in contact with the linear layer."""
        table = load_contact()
        return self._splines(*table.contact_axes, table.profile_over(self._radii))

    @cached_property
    def yeoh_strain(self) -> _Added:
        """What c₂ of the contact table adds; in ln(1 + c₂) its effect bends little."""
        nodes, splines = self._added("second_over_first")
        return _Added(np.log1p(nodes), splines)

    @cached_property
    def compressible_strain(self) -> _Added:
        """What ν adds in contact with the linear layer."""
        return _Added(*self._added("poisson_ratio"))

    @cached_property
    def sticking_strain(self) -> _Added:
        """What friction adds in contact with the linear layer, at no strain too."""
        return _Added(*self._added("friction"))

    def _added(self, name: str) -> tuple[Floats, dict[int, TensorSpline]]:
        table = load_contact()
        nodes, profiles = table.further_profiles_over(name, self._radii)
        return nodes, {
            number: self._splines(*table.contact_axes, profile)
            for number, profile in enumerate(profiles)
            if profile.any()
        }

    @cached_property
    def wave_numbers(self) -> tuple[Floats, Floats]:
        """k [1/h] at which `linear_at` takes transforms, and their weights.

        Gauss–Legendre nodes on panels of [0, end], short enough for the fastest oscillation.
        """
        turns = _WAVENUMBER_END * self._farthest / (2 * np.pi)
        panels = int(np.ceil((turns * _NODES_PER_TURN + 48) / PANEL))
        x, w = np.polynomial.legendre.leggauss(PANEL)
        half = _WAVENUMBER_END / panels / 2
        k = 2 * half * np.arange(panels)[:, None] + half * (1 + x)
        return k.ravel(), np.tile(half * w, panels)

    @cached_property
    def _bessel(self) -> Floats:
        """J0(k e) k/3 with the weights of the integral, as functions of the offset (functions, k)."""
        k, weight = self.wave_numbers
        bessel = j0(np.multiply.outer(k, self._of_offset.nodes)) * (weight * k / 3)[:, None]
        return np.ascontiguousarray(self._of_offset.coefficients(bessel, 1).T)

    @cached_property
    def contact_grid(self) -> CurveGrid:
        """The grid for contacts with a layer, whose pressure transforms are at `wave_numbers`."""
        return CurveGrid(self.wave_numbers[0])

    def linear_at(self, transforms: Floats, contact: Indices, offset: Floats, points: tuple[int, ...]) -> Floats:
        """Hankel integrals of transforms p̂ · M · 2 J1(kρ)/(kρ) (quantities, …, contacts, k) of these contacts (rows,)
        at offsets e/h (…, rows), and the first one's derivative by e/h: (quantities + 1, *points, rows)."""
        from underskin.mechanisms.models.sigma_kernels import linear_sigma

        result = np.empty((len(transforms) + 1, *points, len(contact)))
        linear_sigma(
            self._bessel,
            self.end,
            self._offset_axis,
            contact,
            contiguous(transforms.reshape(len(transforms), -1, *transforms.shape[-2:])),
            contiguous(offset.reshape(-1, offset.shape[-1])),
            result.reshape(len(result), -1, len(contact)),
        )
        return result


def offset_sigma(table: SigmaTable, rt_over_h: float, stretch: float, largest_offset: float) -> OffsetSigma:
    """An `OffsetSigma`, cached for further models of the skin; with room for offsets up to the next multiple of h/2."""
    return _cached_sigma(table, rt_over_h, stretch, min(PROFILE_END, float(np.ceil(2 * largest_offset) / 2)))


@lru_cache(maxsize=8)
def _cached_sigma(table: SigmaTable, rt_over_h: float, stretch: float, largest_offset: float) -> OffsetSigma:
    return OffsetSigma(table, rt_over_h, stretch, largest_offset)


@dataclass(frozen=True)
class _Added:
    """What a property of the layer adds to σ: splines at nodes of a variable, by their numbers, between them
    Lagrange's polynomials; at one node nothing is added."""

    nodes: Floats
    splines: dict[int, TensorSpline]

    @cached_property
    def _polynomials(self) -> list[tuple[TensorSpline, np.poly1d, np.poly1d]]:
        """Each spline with Lagrange's polynomial and its derivative."""
        parts = []
        for number, spline in self.splines.items():
            others = np.delete(self.nodes, number)
            polynomial = np.poly1d(others, r=True) / np.prod(self.nodes[number] - others)
            parts.append((spline, polynomial, polynomial.deriv()))
        return parts

    def shares(self, variable: Differentiated) -> Iterator[tuple[TensorSpline, Differentiated]]:
        """The splines that add something, each with its share."""
        for spline, polynomial, derivative in self._polynomials:
            yield spline, chain(polynomial(variable.value), (derivative(variable.value), variable))


class SigmaOfContacts:
    """σ of all contacts at any offset from them.

    Attributes: `inside` (…, contacts), which are within the tables; `rho`, rT/h.
    """

    def __init__(
        self,
        sigma: OffsetSigma,
        contacts: Contacts,
        sensor_radius: float,
        pressed: PressedContacts,
        layer: ContactCurves | None = None,
    ) -> None:
        """`layer` for contact with the layer itself: all contacts are then on the same layer."""
        self._sigma = sigma
        self.rho = sensor_radius / contacts.thickness
        self._variables = [pressed.a_over_h, pressed.cbrt_load, self.rho]
        self._spline = sigma.hertz
        self._added: list[tuple[_Added, Differentiated]] = []
        if contacts.second_over_first is not None:
            self._added.append((sigma.yeoh_strain, log(1.0 + contacts.second_over_first)))
        if contacts.friction is not None:
            self._added.append((sigma.sticking_strain, contacts.friction))
        if layer is not None and not incompressible(contacts):
            self._added.append((sigma.compressible_strain, contacts.poisson_ratio))
        self._linear: Floats | None = None
        if layer is not None or not as_in_the_table(contacts):
            self._linear, further = _transforms(sigma.wave_numbers[0], contacts, pressed, self.rho.value, layer)
            self._variables += further
            self._spline = sigma.hertz_strain if layer is None else sigma.contact_strain
        widest, strongest = (axis.nodes[-1] for axis in self._spline.axes[:2])
        self.inside: Mask = (pressed.a_over_h.value <= widest) & (pressed.cbrt_load.value <= strongest)

    def at(self, contact: Indices, offset: Differentiated) -> Differentiated:
        """σ (…, points) at these offsets e/h from these contacts (points,)."""
        a, x, rho, *further = self._variables
        at = (self._within(a), x, log(rho), offset)
        sigma = self._spline.at(*at, chosen=contact, end=self._sigma.end)
        for added, variable in self._added:
            for spline, share in added.shares(variable):
                sigma = sigma + share * spline.at(*at, chosen=contact, end=self._sigma.end)
        if self._linear is None:
            return sigma
        points = sigma.value.shape[:-1]
        linear, *partial, by_offset = self._sigma.linear_at(self._linear, contact, offset.value, points)
        variables = (variable[contact] for variable in (a, rho, *further))
        return sigma + chain(linear, (by_offset, offset), *zip(partial, variables, strict=bool(partial)))

    def _within(self, a_over_h: Differentiated) -> Differentiated:
        """a/h, beyond the end e replaced by e (3 − (e/a)²)/2: the tangent there is then one over 1/a²."""
        end = self._spline.axes[0].nodes[-1]
        beyond = np.maximum(a_over_h.value / end, 1.0)
        if (beyond == 1.0).all():
            return a_over_h
        value = np.where(beyond > 1.0, end * (1.5 - 0.5 * beyond**-2), a_over_h.value)
        return chain(value, (beyond**-3, a_over_h))


def layer_of(contacts: Contacts) -> Layer:
    """The linear layer of the contacts."""
    slip = 0.0 if contacts.slip is None else float(contacts.slip.value.flat[0])
    tip = 0.0 if contacts.tip is None else float(contacts.tip.value.flat[0])
    return Layer(float(contacts.poisson_ratio.value.flat[0]), slip, tip)


def incompressible(contacts: Contacts) -> bool:
    """Whether ν is 0.5 and no parameter."""
    nu = contacts.poisson_ratio
    return bool((nu.value == INCOMPRESSIBLE).all() and not nu.slopes.any())


def as_in_the_table(contacts: Contacts) -> bool:
    """Whether contacts are those of the table: spheres without adhesion, on a bonded incompressible layer, over a
    film that is not stretched."""
    changed = contacts.work_of_adhesion, contacts.slip, contacts.film
    return changed == (None, None, None) and incompressible(contacts)


def _transforms(
    k: Floats, contacts: Contacts, pressed: PressedContacts, rho: Floats, layer: ContactCurves | None
) -> tuple[Floats, list[Differentiated]]:
    """p̂ · M · disc (quantities, …, contacts, k), with derivatives by a/h, rT/h and further variables; and these
    variables."""
    slip = np.zeros(1) if contacts.slip is None else contacts.slip.value
    candidates = (contacts.poisson_ratio, contacts.slip, contacts.tip)
    of_layer = [x for x in candidates if x is not None and x.slopes.any()]
    shape = _half_space_shape(k, pressed) if layer is None else _layer_shape(pressed, layer, moving=bool(of_layer))
    glued = Layer(contacts.poisson_ratio.value[..., None], slip[..., None])
    transmission = glued.transmission(k)
    of_film: list[tuple[Differentiated, Floats]] = []
    if contacts.film is not None:
        stretch, of_film = _film_charge(k, glued, *contacts.film, contacts.thickness)
        transmission = transmission + stretch
    by_poisson_ratio, by_slip = transmission.slopes
    disc, by_rho = _disc(k, rho[..., None])
    passed = transmission.value * disc
    terms: list[tuple[tuple[Floats | float, Floats], ...]] = [((shape.value, passed),)]
    further = []
    if any(x.slopes.any() for x in (pressed.a_over_h, contacts.thickness, *of_layer, *(x for x, _ in of_film))):
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
        if contacts.tip in of_layer:
            terms.append(((shape.by_tip, passed),))
            further.append(contacts.tip)
        for variable, by_variable in of_film:
            terms.append(((shape.value, by_variable * disc),))
            further.append(variable)
    result = np.empty((len(terms), *np.broadcast_shapes(shape.value.shape, passed.shape)))
    for quantity, (first, *others) in zip(result, terms, strict=True):
        np.multiply(*first, out=quantity)
        for pressure, transmitted in others:
            quantity += pressure * transmitted
    return result, further


def _film_charge(
    k: Floats, layer: Layer, per_length: Differentiated, shear_lag: Differentiated, thickness: Differentiated
) -> tuple[Differentiated, list[tuple[Differentiated, Floats]]]:
    """Charge by the film's stretch beside that by pressure, c λ² k M_s/(1 + (λ k)²), by ν and the slip.

    And its derivatives by c (`per_length` times h) and λ (`shear_lag` over h), with these variables.
    """
    c, lag = per_length * thickness, shear_lag / thickness
    of_c, of_lag = (x.value[..., None] for x in (c, lag))
    yielding = 1 / (1 + (of_lag * k) ** 2)
    by_c = of_lag**2 * k * yielding
    shear = layer.base_shear(k)
    by_lag = of_c * (2 * of_lag) * k * yielding**2 * shear.value
    return shear * (of_c * by_c), [(c, by_c * shear.value), (lag, by_lag)]


@dataclass(frozen=True)
class _Shape:
    """p̂ (…, contacts, k) and its derivatives; those that are 0 are numbers."""

    value: Floats
    by_alpha: Floats
    by_share: Floats
    by_poisson_ratio: Floats | float = 0.0
    by_slip: Floats | float = 0.0
    by_tip: Floats | float = 0.0


def _half_space_shape(k: Floats, pressed: PressedContacts) -> _Shape:
    from underskin.mechanisms.models.sigma_kernels import sphere_and_punch

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
