"""The base model: a skin pressed by a sphere, and the limits of its domain.

`transmission` gives contact radius, a/h, L, σ, stress on the sensor and FRF, and d33 from a measured FRF, for columns
in SI that broadcast. The contact edge stands still; the contact is one of two models: `paper`, the σ table (Hertz'
radius on a half space, σ of the bonded finite-strain layer under Hertz' pressure as a dead load; Seminara 2018,
equations 7 to 16), and `solved`, a sphere in frictionless contact with that layer.

`in_words` says which limit a row outside the domain exceeds, `L = 1.17 exceeds 0.1: at most 25.6 N`; `reasons` why a
recording cannot be used; `declared_skin` and `log_slopes` relate the FRF to the declared values.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.physics import charge_response, hertz
from underskin.physics.charge_response import INCOMPRESSIBLE, Indenter, Skin
from underskin.recordings.campaign import Conditions, FrfRecording, SkinDescription, offsets
from underskin.surrogate.off_centre_sigma import positioned_sigma
from underskin.surrogate.sigma_table import ContactModel
from underskin.units import GRAM_FORCE, Floats, Mask, to_si


@dataclass(frozen=True)
class Transmission:
    """Contact and stress on the sensor (rows,); NaN in σ, rel_error and stress where not `inside`."""

    contact_radius: Floats  # a [m]
    a_over_h: Floats
    small_strain_a_over_h: Floats  # of the contact at small strain, over which σ is tabulated
    rt_over_h: Floats
    load_parameter: Floats  # L
    sigma: Floats
    rel_error: Floats
    mean_stress: Floats  # T0 [Pa], compression positive
    inside: Mask

    def frf(self, d33: ArrayLike) -> Floats:
        """Charge over force [C/N] for d33 [C/N]."""
        return charge_response.frf(d33, self.sigma, self.rt_over_h)

    def d33(self, frf: ArrayLike, frf_uncertainty: ArrayLike) -> tuple[Floats, Floats]:
        """d33 [C/N] and its standard uncertainty from a measured FRF [C/N]."""
        return charge_response.d33(frf, frf_uncertainty, self.sigma, self.rel_error, self.rt_over_h)


def transmission(contact_model: ContactModel, skin: Skin, indenter: Indenter, preload: ArrayLike) -> Transmission:
    """Contact radius, σ and mean stress of a skin pressed by a sphere, by the base model.

    Parameters
    ----------
    contact_model
        The σ table (`load_table`), or the solved contact (`solved_contact`).
    skin, indenter
        In SI, scalars or columns that broadcast.
    preload
        F [N], (rows,) or one.

    Returns
    -------
    Transmission
        NaN in σ, error and stress where a row is outside the table; rows with ν ≠ 0.5 are outside, since the tables are
        of an incompressible elastomer.

    Source: Seminara, Sensors 18 (2018) 459, equations 7 to 16.
    """
    columns = np.broadcast_arrays(
        skin.thickness,
        skin.youngs_modulus,
        skin.sensor_radius,
        skin.poisson_ratio,
        indenter.radius,
        np.asarray(preload, dtype=float),
    )
    h, modulus, sensor_radius, poisson_ratio, radius, force = columns
    contact = contact_model.radius(force, radius, modulus, poisson_ratio, h)
    load = hertz.load_parameter(force, radius, modulus)
    answer = contact_model.sigma(contact.small_strain_over_h, sensor_radius / h, load)
    inside = answer.inside & (poisson_ratio == INCOMPRESSIBLE)
    sigma = np.where(inside, answer.sigma, np.nan)
    return Transmission(
        contact_radius=contact.radius,
        a_over_h=contact.radius / h,
        small_strain_a_over_h=contact.small_strain_over_h,
        rt_over_h=sensor_radius / h,
        load_parameter=load,
        sigma=sigma,
        rel_error=np.where(inside, answer.rel_error, np.nan),
        mean_stress=charge_response.mean_stress(force, sigma, h),
        inside=inside,
    )


def frf_gradient(
    contact_model: ContactModel, skin: Skin, indenter: Indenter, preload: ArrayLike, d33: ArrayLike
) -> dict[str, Floats]:
    """The derivatives of FRF = d33 · (3/2) ρ² σ(α, ρ, L), α = a/h of F R/(E h³), ρ = rT/h, L = F/(R² E).

    Parameters
    ----------
    contact_model, skin, indenter, preload
        As for `transmission`.
    d33
        [C/N], (rows,) or one.

    Returns
    -------
    dict
        ∂FRF/∂ each of thickness, youngs_modulus, sensor_radius, indenter_radius, preload and d33, in SI, (rows,); NaN
        where the row is outside the table.
    """
    reached = transmission(contact_model, skin, indenter, preload)
    alpha, rho = reached.small_strain_a_over_h, reached.rt_over_h
    scale = np.where(reached.inside, charge_response.frf(d33, 1.0, rho), np.nan)
    slopes = contact_model.gradient(alpha, rho, reached.load_parameter)
    # ∂FRF/∂ of the logarithm of each dimensionless number, F R/(E h³), L and ρ.
    _, radius_exponent = contact_model.load_over_cube(alpha)
    in_force, in_load = scale * slopes[0] * alpha * radius_exponent, scale * slopes[2] * reached.load_parameter
    in_rho = scale * (2 * reached.sigma + slopes[1] * rho)
    return {
        "thickness": -(3 * in_force + in_rho) / skin.thickness,
        "youngs_modulus": -(in_force + in_load) / skin.youngs_modulus,
        "sensor_radius": in_rho / skin.sensor_radius,
        "indenter_radius": (in_force - 2 * in_load) / indenter.radius,
        "preload": (in_force + in_load) / np.asarray(preload, dtype=float),
        "d33": charge_response.gain(reached.sigma, rho),
    }


OTHER_MODULUS = "Poisson's ratio = {:g}: the table is of incompressible elastomer, 0.5"
NOT_FINITE = "the result is too large a number"
SYMBOLS = {"load_parameter": "L", "a_over_h": "a/h", "rt_over_h": "rT/h"}
Domain = Mapping[str, tuple[float, float]]
Words = Sequence[str | None]


@dataclass(frozen=True)
class Limit:
    """A limited quantity: its symbol, its values (rows,), its lowest and highest value; and `most_n`, the force [N] of
    each row at which it reaches the highest value."""

    symbol: str
    values: Floats
    low: float
    high: float
    most_n: Floats | None = None


def of_numbers(numbers: Mapping[str, Floats], domain: Domain) -> list[Limit]:
    """The limits of dimensionless numbers by their names."""
    return [Limit(SYMBOLS[name], numbers[name], *domain[name]) for name in SYMBOLS if name in domain]


def of_pressed(reached: Transmission, preload_n: Floats, contact_model: ContactModel) -> list[Limit]:
    """The limits of a skin under a sphere, with the preload at which each is reached."""
    domain, alpha = contact_model.domain, reached.small_strain_a_over_h
    load, over_h = (domain[name][1] for name in ("load_parameter", "a_over_h"))
    with np.errstate(all="ignore"):
        at_limit, _ = contact_model.load_over_cube(np.array(over_h))
        at_rows, _ = contact_model.load_over_cube(alpha)
        most = {
            "load_parameter": preload_n * (load / reached.load_parameter),
            "a_over_h": preload_n * (over_h / alpha) ** 3 * (at_limit / at_rows),
        }
    values = {"load_parameter": reached.load_parameter, "a_over_h": alpha, "rt_over_h": reached.rt_over_h}
    return [Limit(SYMBOLS[name], values[name], *domain[name], most_n=most.get(name)) for name in SYMBOLS]


def in_words(
    inside: Mask, count: int, limits: Sequence[Limit], poisson_ratio: Floats | float = INCOMPRESSIBLE
) -> Words | None:
    """For each row outside, the limits that it exceeds, and the highest force inside, if any; None where all rows are
    inside."""
    rows = np.flatnonzero(~np.broadcast_to(inside, (count,)))
    if not rows.size:
        return None
    words: list[str | None] = [None] * count
    ratio = _at(np.asarray(poisson_ratio), rows, count)
    values = [_at(limit.values, rows, count) for limit in limits]
    most = [[math.inf] * len(rows) if limit.most_n is None else _at(limit.most_n, rows, count) for limit in limits]
    for index, row in enumerate(rows.tolist()):
        if ratio[index] != INCOMPRESSIBLE:
            words[row] = OTHER_MODULUS.format(ratio[index])
            continue
        beyond = [
            (message, most[limit_index][index])
            for limit_index, limit in enumerate(limits)
            for message in _excess(limit, values[limit_index][index])
        ]
        forces = [force for _, force in beyond]
        # No force is inside for a row that exceeds a limit independent of force.
        at_most = f": at most {_rounded_down(min(forces))} N" if forces and all(map(math.isfinite, forces)) else ""
        words[row] = (", ".join(message for message, _ in beyond) or NOT_FINITE) + at_most
    return words


def _at(values: Floats, rows: np.ndarray[tuple[int], np.dtype[np.intp]], count: int) -> list[float]:
    return np.broadcast_to(values, (count,))[rows].tolist()


def _excess(limit: Limit, value: float) -> Iterator[str]:
    if value > limit.high:
        yield f"{limit.symbol} = {_distinguishable(value, limit.high)} exceeds {limit.high:g}"
    elif value < limit.low:
        yield f"{limit.symbol} = {_distinguishable(value, limit.low)} is below {limit.low:g}"


def _distinguishable(value: float, limit: float) -> str:
    """A number with three digits, or as many as distinguish it from a limit."""
    return next((text for digits in (3, 6, 9) if float(text := f"{value:.{digits}g}") != limit), repr(value))


def _rounded_down(force: float) -> str:
    """A force rounded down to three digits, up to float rounding."""
    if not force > 0:
        return "0"
    step = 10.0 ** (math.floor(math.log10(force)) - 2)
    return f"{math.floor(force / step * (1 + 1e-12)) * step:.3g}"


_MOST_CHARGE = 1.0  # C/N
_LIKE_MILLI = 100.0  # N: a larger preload that is inside at 1/1000 may be in mN


def usable(level: Floats, noise: Floats, sigma: Floats, transmitted: Transmission) -> Mask:
    """The rows inside the table's domain, at an offset within it, with a line in the band and an FRF below 1 C/N."""
    return transmitted.inside & np.isfinite(sigma) & (np.hypot(level, noise) < _MOST_CHARGE)


def reasons(
    recorded: Sequence[FrfRecording],
    skin: SkinDescription,
    transmitted: Transmission,
    level: Floats,
    contact_model: ContactModel,
) -> Iterator[Finding]:
    """Why each recording is not `usable`; `level`: its averaged FRF [C/N], NaN without a line in the band."""
    rt_over_h = np.broadcast_to(transmitted.rt_over_h, level.shape)
    numbers = np.stack([transmitted.small_strain_a_over_h, rt_over_h, transmitted.load_parameter], axis=-1).tolist()
    for row, recording in enumerate(recorded):
        if skin.poisson_ratio != INCOMPRESSIBLE or not transmitted.inside[row]:
            assert skin.youngs_modulus_mpa is not None
            declared = recording.indenter_radius_mm, skin.youngs_modulus_mpa, skin.poisson_ratio
            limit = beyond(contact_model, numbers[row], recording.preload_n, *declared)
            yield Finding(Reason.BEYOND_TABLE, recording.id, "preload_n", {"limit": limit})
        elif not np.isfinite(level[row]):
            yield Finding(Reason.NO_LINE_IN_BAND, recording.id, "frequency_hz")
        elif not abs(level[row]) < _MOST_CHARGE:
            arguments = {"frf_pc_per_n": float(1e12 * level[row])}
            yield Finding(Reason.IMPOSSIBLE_FRF, recording.id, "frf_pc_per_n", arguments)
        else:
            yield Finding(Reason.PLACE_BEYOND_TABLE, recording.id, "position_mm")


def beyond(
    contact_model: ContactModel,
    numbers: Sequence[float],
    force: float,
    radius: float,
    modulus: float,
    poisson_ratio: float,
) -> str:
    """Which of ν and of `numbers` (a/h, rT/h and L) is outside the table's domain, in words with F [N], R [mm] and E
    [MPa]."""
    if poisson_ratio != INCOMPRESSIBLE:
        return OTHER_MODULUS.format(poisson_ratio)
    over_h, rt_over_h, load = numbers
    most_a, most_rt, most_load = (contact_model.domain[name][1] for name in ("a_over_h", "rt_over_h", "load_parameter"))
    row = f"F = {force:g} N, R = {radius:g} mm, E = {modulus:g} MPa, L = {load:.3g}, a/h = {over_h:.3g}"
    if rt_over_h > most_rt:  # first, since no force changes it
        return f"{row}: rT/h = {rt_over_h:.3g} exceeds {most_rt:g}: the sensor is too large for this thickness"
    if load > most_load:
        most = most_load * radius**2 * modulus
        slip = "; is the preload in mN?" if force >= _LIKE_MILLI and force / 1000 <= most else ""
        if slip and force * GRAM_FORCE <= most:
            slip = f"{slip.removesuffix('?')} or gf?"
        return f"{row}: L = {load:.3g} exceeds {most_load:g}: at most {most:.3g} N with this sphere{slip}"
    at_most, at_row = contact_model.load_over_cube(np.array([most_a, over_h]))[0].tolist()
    most = force * (most_a / over_h) ** 3 * (at_most / at_row)
    return f"{row}: a/h = {over_h:.3g} exceeds {most_a:g}: at most {most:.3g} N with this sphere"


DECLARED = ("thickness", "sensor_radius", "youngs_modulus")


def declared_skin(described: SkinDescription) -> Skin:
    """The declared skin in SI; the campaign's reader has checked that FRFs have all fields, and their units."""
    assert described.thickness_mm is not None
    assert described.youngs_modulus_mpa is not None
    assert described.sensor_radius_mm is not None
    return Skin.from_lab(
        thickness_mm=described.thickness_mm,
        youngs_modulus_mpa=described.youngs_modulus_mpa,
        sensor_radius_mm=described.sensor_radius_mm,
        poisson_ratio=described.poisson_ratio,
        units_checked=True,
    )


def log_slopes(contact_model: ContactModel, skin: Skin, indenter: Indenter, preload: Floats) -> dict[str, Floats]:
    """∂ ln FRF/∂ ln of each of `DECLARED` (rows,); NaN where the row is outside the domain."""
    slopes = frf_gradient(contact_model, skin, indenter, preload, 1.0)
    size = transmission(contact_model, skin, indenter, preload).frf(1.0)
    return {name: np.asarray(slopes[name] * getattr(skin, name) / size) for name in DECLARED}


# Cross-talk and pick-up of a sensor's channel, over the charge of the sensor under the contact: unshielded leads couple
# by up to 20 % (Ott, Electromagnetic Compatibility Engineering, 2009, section 2.1), shielded ones by some tenths of a
# percent. Their geometric mean:
PICK_UP = 0.02


def contact_offsets(skin: SkinDescription, recorded: Sequence[FrfRecording]) -> Floats:
    """The distance of each contact from the centre of its recording's sensor [m]."""
    return np.hypot(*offsets(Conditions("", skin, tuple(recorded))).T)


def response_shares(skin: SkinDescription, recorded: Sequence[FrfRecording], contact_model: ContactModel) -> Floats:
    """The response of each recording's sensor over that of a sensor under the same contact; NaN outside the table."""
    declared = declared_skin(skin)
    indenter = Indenter(to_si("indenter_radius_mm", [item.indenter_radius_mm for item in recorded]))
    reached = transmission(contact_model, declared, indenter, to_si("preload_n", [item.preload_n for item in recorded]))
    offset = contact_offsets(skin, recorded) / float(declared.thickness)
    positioned = positioned_sigma(
        contact_model, reached.small_strain_a_over_h, float(declared.rt_over_h), reached.load_parameter, offset, 0.0
    )
    return share_of_contact(positioned.sigma, reached)


def share_of_contact(sigma: Floats, reached: Transmission) -> Floats:
    """σ at each offset over that under the contact; 0 beyond the end of the table's profile, where σ is nearly 0."""
    return np.where(reached.inside & np.isnan(sigma), 0.0, sigma / reached.sigma)


def far_contacts(recorded: Sequence[FrfRecording], level: Floats, share: Floats) -> tuple[Mask, list[Finding]]:
    """The recordings that tell nothing of d33, since usual pick-up is as large as what their sensor feels of the
    contact; and a finding on all of them.

    `level` is the FRF of each [C/N], in any sense that is linear in it; `share` as from `response_shares`.
    """
    far = share < PICK_UP
    if not far.any():
        return far, []
    under_contact = np.abs(level[~far] / share[~far])
    read = float(np.nanmedian(np.abs(level[far])) / np.nanmedian(under_contact)) if (~far).any() else math.nan
    shares = {"expected_percent": 100 * float(share[far].max()), "read_percent": 100 * read}
    named = recorded[int(far.argmax())].id if far.sum() == 1 else ""
    arguments = {"recordings": int(far.sum()), "pick_up_percent": 100 * PICK_UP, **shares}
    return far, [Finding(Reason.FAR_CONTACTS, named, "position_mm", arguments)]


_BEYOND = 0.5  # of the recordings as declared, at the least
_WITHIN = 0.9  # of the recordings once exchanged, at the least
_LARGEST_MM = 30.0  # radius of a ball that a laboratory has: beyond it a preload in mN is likelier


def exchanged_values(
    skin: SkinDescription, recorded: Sequence[FrfRecording], contact_model: ContactModel
) -> list[Finding]:
    """A finding where preload and sphere of the recordings look exchanged: loads beyond what a skin bears, which all
    come within range once exchanged.

    Contact radius and depth depend on F R, which an exchange of the numbers of F [N] and R [mm] leaves unchanged; the
    load parameter L = F/(R² E) does change. A small sphere pressed hard makes L equally large: an exchange is one of
    two explanations where every preload [N] is above every radius [mm], and none otherwise.
    """
    if not recorded or skin.youngs_modulus_mpa is None:
        return []
    modulus = float(to_si("youngs_modulus_mpa", skin.youngs_modulus_mpa))
    preload = np.array([recording.preload_n for recording in recorded])
    radius_mm = np.array([recording.indenter_radius_mm for recording in recorded])

    def beyond(force: Floats, sphere_mm: Floats) -> Mask:
        load = hertz.load_parameter(force, to_si("indenter_radius_mm", sphere_mm), modulus)
        return np.asarray(load > contact_model.domain["load_parameter"][1])

    as_declared = beyond(preload, radius_mm)
    as_exchanged = ~beyond(radius_mm, preload) & (preload < _LARGEST_MM)
    if as_declared.mean() < _BEYOND or as_exchanged.mean() < _WITHIN or preload.min() <= radius_mm.max():
        return []
    arguments = {"beyond": int(as_declared.sum()), "recordings": len(recorded)}
    return [Finding(Reason.PRELOAD_AND_RADIUS_EXCHANGED, "", "preload_n", arguments)]
