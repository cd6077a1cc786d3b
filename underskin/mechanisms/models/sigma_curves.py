"""σ over the offset for each contact, from the table alone or from the linear layer at hand plus finite strain.

The table serves Hertz' pressure on a bonded incompressible layer. Where a mechanism changes the pressure's shape or the
layer, σ = linear(p̂, M; a, e) + [table(a, L, e) − table(a, 0, e)], with the transform of the pressure

    p̂ = s p̂_sphere + (1 − s) p̂_punch,

s the sphere's share of the load; on the half space p̂_sphere is Hertz', 3 (sin x − x cos x)/x³, and p̂_punch sin x/x,
x = k a/h; on the layer both come from its own contact (contact_curves).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import jv

from underskin.autodiff import Differentiated
from underskin.mechanisms.models.contact_stage import PressedContacts
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.off_centre_response import OffsetSigma
from underskin.physics.contact_curves import LARGEST_A_OVER_H, ContactCurves
from underskin.physics.elastic_layer import Layer
from underskin.physics.hankel_transform import disc_average, hertz_transform, punch_transform
from underskin.physics.skin import INCOMPRESSIBLE
from underskin.units import Floats


@dataclass(frozen=True)
class SigmaCurves:
    """Coefficients over e/h (quantities, contacts, offsets): σ, then ∂σ/∂ each of the `variables`."""

    coefficients: Floats
    variables: tuple[Differentiated, ...]
    inside: NDArray[np.bool_]  # (contacts,)


def sigma_curves(
    sigma: OffsetSigma, contacts: Contacts, pressed: PressedContacts, rho: Differentiated, layer: ContactCurves | None
) -> SigmaCurves:
    """The curves of all contacts; `layer` where the contact is the layer's own."""
    variables = (pressed.a_over_h, pressed.cbrt_load, rho)
    a_over_h, cbrt_load, rt_over_h = (variable.value for variable in variables)
    if layer is None and _as_in_the_table(contacts, pressed):
        curves = sigma.table_curves(a_over_h, cbrt_load, float(rt_over_h[0]))
        return SigmaCurves(curves.coefficients, variables, curves.inside)
    strained = sigma.finite_strain_curves(a_over_h, cbrt_load, float(rt_over_h[0]))
    transforms, further = _transforms(sigma.wavenumber, contacts, pressed, float(rt_over_h[0]), layer)
    linear = sigma.linear_curves(transforms)
    coefficients = np.concatenate([strained.coefficients, linear[3:]])
    coefficients[[0, 1, 3]] += linear[:3]
    return SigmaCurves(coefficients, variables + further, strained.inside & (a_over_h < LARGEST_A_OVER_H))


def layer_of(contacts: Contacts) -> Layer:
    """The linear layer at hand."""
    slip = 0.0 if contacts.slip is None else float(contacts.slip.value[0])
    return Layer(float(contacts.poisson_ratio.value[0]), slip)


def _as_in_the_table(contacts: Contacts, pressed: PressedContacts) -> bool:
    nu = contacts.poisson_ratio
    incompressible = nu.value[0] == INCOMPRESSIBLE and not nu.slopes.any()
    return pressed.sphere_share is None and contacts.slip is None and bool(incompressible)


def _transforms(
    k: Floats, contacts: Contacts, pressed: PressedContacts, rt_over_h: float, layer: ContactCurves | None
) -> tuple[Floats, tuple[Differentiated, ...]]:
    """p̂ · M · disc (contacts, k) with its derivatives by a/h, rT/h and what follows, and what follows."""
    shape = _half_space_shape(k, pressed) if layer is None else _layer_shape(pressed, layer)
    transmission = layer_of(contacts).transmission(k)
    by_poisson_ratio, by_slip = transmission.slopes
    disc, by_rho = _disc(k, rt_over_h)
    passed = transmission.value * disc
    entries = [shape.value * passed, shape.by_alpha * passed, shape.value * (transmission.value * by_rho)]
    further = []
    if pressed.sphere_share is not None:
        entries.append(shape.by_share * passed)
        further.append(pressed.sphere_share)
    if contacts.poisson_ratio.slopes.any():
        entries.append(shape.value * (by_poisson_ratio * disc) + shape.by_poisson_ratio * passed)
        further.append(contacts.poisson_ratio)
    if contacts.slip is not None:
        entries.append(shape.value * (by_slip * disc) + shape.by_slip * passed)
        further.append(contacts.slip)
    return np.stack(entries), tuple(further)


@dataclass(frozen=True)
class _Shape:
    """p̂ (contacts, k) and its derivatives; those that are 0 are numbers."""

    value: Floats
    by_alpha: Floats
    by_share: Floats
    by_poisson_ratio: Floats | float = 0.0
    by_slip: Floats | float = 0.0


def _half_space_shape(k: Floats, pressed: PressedContacts) -> _Shape:
    alpha = pressed.a_over_h.value[:, None]
    argument = alpha * k
    sphere, punch = hertz_transform(argument), punch_transform(argument)
    sphere_slope = 3 * (punch - sphere) / alpha
    punch_slope = (np.cos(argument) - punch) / alpha
    if pressed.sphere_share is None:
        return _Shape(sphere, sphere_slope, sphere - punch)
    share = pressed.sphere_share.value[:, None]
    return _Shape(punch + share * (sphere - punch), punch_slope + share * (sphere_slope - punch_slope), sphere - punch)


def _layer_shape(pressed: PressedContacts, layer: ContactCurves) -> _Shape:
    share = 1.0 if pressed.sphere_share is None else pressed.sphere_share.value[:, None]
    basis = layer.interval.basis(pressed.a_over_h.value)
    to_coefficients = layer.interval.coefficients(np.eye(len(layer.interval.nodes)))
    at, slope = basis @ to_coefficients, basis @ layer.interval.derivative(to_coefficients)

    def mixed(weights: Floats, sphere: Floats, punch: Floats) -> Floats:
        of_sphere = weights @ sphere
        if pressed.sphere_share is None:
            return of_sphere
        of_punch = weights @ punch
        return of_punch + share * (of_sphere - of_punch)

    sphere, punch = layer.sphere_transform, layer.punch_transform
    by_layer = [mixed(at, *slopes) for slopes in zip(sphere.slopes, punch.slopes, strict=True)]
    value, by_alpha = (mixed(weights, sphere.value, punch.value) for weights in (at, slope))
    return _Shape(value, by_alpha, at @ (sphere.value - punch.value), *by_layer)


def _disc(k: Floats, rt_over_h: float) -> tuple[Floats, Floats]:
    """2 J1(kρ)/(kρ) and its derivative by ρ."""
    return disc_average(k * rt_over_h), -2 * jv(2, k * rt_over_h) / rt_over_h
