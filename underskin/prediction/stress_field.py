"""The stress σ_zz in the layer under a sphere: a section through its depth, the last row of which is the base.

Stresses are per undeformed area. With the contact `paper` the surface carries the Hertz pressure as a dead load, as in
the σ table; with `solved` that of the linear layer's own contact, a sum of Hertz pressures. For small strain (L → 0)
the whole section is exact (`physics.layer_stress`). What finite strain changes is tabulated on the base alone, for
incompressible elastomer; that change is added in proportion to the depth:

    σ_zz(r, d; L) ≈ σ_zz(r, d; 0) + d [σ_zz(r, 1; L) − σ_zz(r, 1; 0)]

On the base this is as good as the table, and on the surface exact under a dead load. Between them the finite elements
of the σ table differ by up to `section_error`: their change is largest under the contact and is not that of the base.
Of a solved contact, whose surface finite strain changes too, no such bound is known. The force on every plane is F,
since the change on the base has none.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from underskin.physics import charge_response, elastic_layer
from underskin.physics.charge_response import INCOMPRESSIBLE, Indenter, Skin
from underskin.physics.contact_pressure import SpherePressure
from underskin.physics.elastic_layer import ContactEquation, Layer
from underskin.physics.layer_stress import layer_stress
from underskin.prediction.pressed_skin import Transmission, in_words, of_pressed, transmission
from underskin.surrogate.sigma_table import ContactModel
from underskin.units import Floats, checked

_AROUND_CONTACT, _AROUND_SENSOR, _LEAST = 2.0, 1.0, 3.0  # thicknesses that a section shows
# Largest difference between depths 0 and 1 from finite elements of order 4 at a/h 0.05 to 3 and L up to 0.1, over the
# largest stress at that depth: it grows like L^(1/3), and towards 0.1 faster (tests/prediction/test_stress_field.py).
_ERROR_OF_STRAIN, _ERROR_OF_LOAD = 0.6, 2.6


@dataclass(frozen=True)
class StressField:
    """The stress under one sphere at several forces.

    Attributes
    ----------
    contact : Transmission
        One row a force; for ν ≠ 0.5 σ is that of the linear layer, without an error.
    preload : ndarray, (forces,)
        F [N].
    indenter_radius : float
        R [m].
    r : ndarray, (radii,)
        Distance from the contact's axis [m], the same for all forces.
    depth : ndarray, (depths,)
        Below the surface [m], from 0 to the thickness.
    sigma_zz : ndarray, (forces, depths, radii)
        [Pa], tension positive; NaN where a force is not inside the table's domain.
    section_error : ndarray, (forces,)
        Bound on the error between surface and base, over the largest stress at the same depth [-]; NaN where it is not
        known, of a solved contact.
    limits : sequence of str or None
        Which limit each force exceeds; None where it is inside.
    """

    contact: Transmission
    preload: Floats
    indenter_radius: float
    r: Floats
    depth: Floats
    sigma_zz: Floats
    section_error: Floats
    limits: tuple[str | None, ...]


def stress_field(
    contact_model: ContactModel, skin: Skin, indenter: Indenter, preload: Floats, radii: int, depths: int
) -> StressField:
    """The stress under a sphere.

    Parameters
    ----------
    contact_model
        The σ table, or the solved contact, which is defined for ν = 0.5 only.
    skin, indenter
        One skin and one sphere, in SI.
    preload
        F (forces,) [N].
    radii, depths
        Number of distances from the axis and of depths, evenly spaced.
    """
    contact = _contact(contact_model, skin, indenter, preload)
    h, inside = float(skin.thickness), contact.inside
    over_h = np.linspace(0.0, _end(contact), radii)
    depth = np.linspace(0.0, 1.0, depths)
    stress = np.full((preload.size, depths, radii), np.nan)
    error = np.full(preload.size, np.nan)
    if inside.any():
        a, load = contact.small_strain_a_over_h[inside], contact.load_parameter[inside]
        section = layer_stress if contact_model.name == "paper" else _solved_section
        stress[inside] = section(float(skin.poisson_ratio), a, over_h, depth)
        if float(skin.poisson_ratio) == INCOMPRESSIBLE:
            strained, linear = (contact_model.profile(over_h, a[:, None], x) for x in (load[:, None], 0.0))
            stress[inside] += depth[:, None] * (strained - linear)[:, None, :]
    if contact_model.name == "paper":
        load = contact.load_parameter[inside]
        error[inside] = _ERROR_OF_STRAIN * np.cbrt(load) + _ERROR_OF_LOAD * load
    scale = charge_response.mean_stress(preload, 1.0, h)
    limits = in_words(inside, preload.size, of_pressed(contact, preload, contact_model))
    return StressField(
        contact=contact,
        preload=preload,
        indenter_radius=float(indenter.radius),
        r=h * over_h,
        depth=h * depth,
        sigma_zz=0.0 - scale[:, None, None] * stress,  # no stress is 0, not −0
        section_error=error,
        limits=tuple(limits or [None] * preload.size),
    )


def field_from_lab(
    contact_model: ContactModel, given: Mapping[str, float], radii: int, depths: int, *, units_checked: bool
) -> StressField:
    """`stress_field` from numbers in lab units by field name: the skin's, `indenter_radius_mm` and `preload_n`.

    Raises
    ------
    InvalidInput
        Names the field that cannot be used.
    """
    names = ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio")
    skin = Skin.from_lab(**{name: given[name] for name in names}, units_checked=units_checked)
    indenter = Indenter.from_lab(indenter_radius_mm=given["indenter_radius_mm"], units_checked=units_checked)
    preload = np.atleast_1d(checked("preload_n", given["preload_n"], units_checked=units_checked))
    with np.errstate(all="ignore"):  # what overflows is outside
        return stress_field(contact_model, skin, indenter, preload, radii, depths)


def _solved_section(poisson_ratio: float, a: Floats, r: Floats, depth: Floats) -> Floats:
    """`layer_stress` under the pressures of the linear layer's contacts of these radii."""
    solved = ContactEquation(a).solve(Layer(poisson_ratio)).sphere_shape.value
    parts = (SpherePressure(float(radius), shape).hertz_parts() for radius, shape in zip(a, solved, strict=True))
    sections = [
        np.tensordot(shares, layer_stress(poisson_ratio, radius * radii, r, depth), 1)
        for radius, (radii, shares) in zip(a, parts, strict=True)
    ]
    return np.stack(sections)


def _contact(contact_model: ContactModel, skin: Skin, indenter: Indenter, preload: Floats) -> Transmission:
    """The contact by the base model; for ν ≠ 0.5 in the contact `paper` with the linear layer's σ in the domain of the
    table for 0.5."""
    contact = transmission(contact_model, skin, indenter, preload)
    if float(skin.poisson_ratio) == INCOMPRESSIBLE or contact_model.name != "paper":
        return contact
    a, rho = contact.a_over_h, contact.rt_over_h
    inside = contact_model.sigma(a, rho, contact.load_parameter).inside
    sigma = np.full(a.shape, np.nan)
    sigma[inside] = elastic_layer.sigma(Layer(float(skin.poisson_ratio)), a[inside], rho[inside])
    mean = charge_response.mean_stress(preload, sigma, skin.thickness)
    return replace(contact, inside=inside, sigma=sigma, mean_stress=mean)


def _end(contact: Transmission) -> float:
    """The extent of a section over the thickness: beyond all contacts inside the table, and the sensor."""
    widest = float(contact.a_over_h[contact.inside].max(initial=0.0))
    sensor = float(contact.rt_over_h[0]) if contact.inside.any() else 0.0
    return max(_LEAST, widest + _AROUND_CONTACT, sensor + _AROUND_SENSOR)
