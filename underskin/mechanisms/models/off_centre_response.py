"""σ of many contacts on one skin at any offset, with derivatives, fast enough for a fit.

The table's bottom profile, averaged over the sensor's disc at its offset, is tabulated once as a cubic spline in a/h,
L^(1/3), log(rT/h) and e/h. To it may be added what a linear layer of another transmission or a pressure of another
shape puts there, by its Hankel integral (underskin/physics/hankel_transform.py):

    σ = linear(p̂, M; a, e) + [table(a, L, e) − table(a, 0, e)],

where the bracket is what finite strain adds under Hertz' pressure. In contact with the layer itself, the correction of
the contact table (tables/contact.h5) stands in its place.

A contact beyond the table is reported in `inside`. Beyond the table's L it is continued along the tangent, beyond its
a/h along the tangent over 1/a², as which the pressure under a wide contact falls (on the axis within 3 % up to a/h =
4.2); beyond the profile's end, r/h = 8, the stress is 0 (below 1e-6 of its peak).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.special import j0

from underskin.autodiff import Differentiated, as_columns, chain, contiguous, unfilled
from underskin.mechanisms.models.cubic_basis import CubicBasis
from underskin.physics.contact_curves import CurveGrid
from underskin.surrogate.contact_table import load_contact
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Indices, Mask

PROFILE_END = 8.0
_SPACING = 0.0625  # of the profile and of the offsets; the profile turns over lengths of 0.3 h and more
_MIRRORED = 4  # offsets below 0, so that the curve is even
_RADIAL, _ANGULAR = 10, 20  # quadrature over the disc
_RHO_RATIO = 1.1  # of neighbouring rT/h in the table
_WAVENUMBER_END, _NODES_PER_TURN = 24.0, 4  # M decays as e^(−k)
PANEL = 16  # wave numbers in each of several equal panels


@dataclass(frozen=True)
class _Splines:
    """A tensor product of cubic splines in a/h, L^(1/3), ln(rT/h) and e/h; 0 beyond `end` of the last.

    Attributes: `coefficients` (a/h, L^(1/3), ln(rT/h), e/h); `bases` of these axes.
    """

    coefficients: Floats
    bases: tuple[CubicBasis, CubicBasis, CubicBasis, CubicBasis]
    end: float

    @cached_property
    def ends(self) -> Floats:
        """The lowest and highest value along each axis (4, 2)."""
        ends = np.array([[basis.nodes[0], basis.nodes[-1]] for basis in self.bases])
        ends[3, 1] = self.end
        return ends

    @cached_property
    def axes(self) -> list[Floats]:
        """Knots and cubics of each axis in turn."""
        return [part for basis in self.bases for part in (basis.knots, basis.cubics)]

    def contains(self, a_over_h: Floats, cbrt_load: Floats) -> Mask:
        """Which contacts lie inside; the others are continued."""
        return np.asarray((a_over_h <= self.ends[0, 1]) & (cbrt_load <= self.ends[1, 1]))

    def at(
        self,
        contact: Indices,
        a_over_h: Differentiated,
        cbrt_load: Differentiated,
        rt_over_h: Differentiated,
        offset: Differentiated,
    ) -> Differentiated:
        """Values at rows (…, rows) of these contacts (rows,) and offsets e/h (…, rows)."""
        from underskin.mechanisms.models.sigma_kernel import table_sigma

        variables = self._within(a_over_h), cbrt_load, rt_over_h, offset
        points = np.broadcast_shapes(*(variable.value.shape[:-1] for variable in variables))
        result = unfilled(len(offset.slopes), (*points, len(contact)))
        columns = [array for variable in (*variables, result) for array in as_columns(variable)]
        table_sigma(self.coefficients, self.ends, *self.axes, contact, *columns)
        return result

    def _within(self, a_over_h: Differentiated) -> Differentiated:
        """a/h, beyond the end e replaced by e (3 − (e/a)²)/2: the tangent there is then one over 1/a²."""
        end = self.ends[0, 1]
        beyond = np.maximum(a_over_h.value / end, 1.0)
        if (beyond == 1.0).all():
            return a_over_h
        value = np.where(beyond > 1.0, end * (1.5 - 0.5 * beyond**-2), a_over_h.value)
        return chain(value, (beyond**-3, a_over_h))


class OffsetSigma:
    """σ(a/h, L^(1/3), rT/h, e/h) around one rT/h, for offsets up to `largest_offset` (in h).

    Attributes: `hertz`, σ of the table; `end`, the largest offset e/h that has a place, beyond which σ is 0.
    """

    def __init__(self, table: SigmaTable, rt_over_h: float, stretch: float, largest_offset: float) -> None:
        """Tabulate for rT/h up to `stretch` times larger or smaller; takes hundredths to tenths of a second."""
        count = int(np.ceil(largest_offset / _SPACING)) + 2 * _MIRRORED + 1
        offsets = np.asarray(_SPACING * (np.arange(count) - _MIRRORED), dtype=np.float64)
        rho_nodes = max(5, 1 + int(np.ceil(2 * np.log(stretch) / np.log(_RHO_RATIO))))
        rho = np.asarray(rt_over_h * np.geomspace(1 / stretch, stretch, rho_nodes), dtype=np.float64)
        radii = np.arange(0.0, min(PROFILE_END, offsets[-1] + rho[-1]) + _SPACING / 2, _SPACING)
        radii = np.append(radii, radii[-1] + _SPACING * np.arange(1, 4)) if len(radii) < 4 else radii
        along = CubicBasis(radii)
        self._of_rho, self._of_offset = of_rho, of_offset = CubicBasis(np.log(rho)), CubicBasis(offsets)
        self.end = min(float(offsets[-1]), PROFILE_END)
        # Splines and averages are all linear: the smaller arrays are turned into coefficients before their product
        average = np.stack([_disc_averages(along, np.abs(offsets), ratio) for ratio in rho])
        self._radii, self._average = radii, of_offset.coefficients(of_rho.coefficients(average, 0), 1)
        self.hertz = self._splines(*table.contact_axes, table.profile_over(radii))
        self._turns = float(offsets[-1] + rho[-1] + table.contact_axes[0][-1])

    def _splines(self, a_over_h: Floats, cbrt_load: Floats, profile: Floats) -> _Splines:
        """The disc averages of a profile (a, L^(1/3), radii)."""
        of_a, of_x = CubicBasis(a_over_h), CubicBasis(cbrt_load)
        coefficients = of_x.coefficients(of_a.coefficients(profile, 0), 1)
        coefficients = np.ascontiguousarray(np.tensordot(coefficients, self._average, (2, 2)))
        return _Splines(coefficients, (of_a, of_x, self._of_rho, self._of_offset), self.end)

    @cached_property
    def hertz_strain(self) -> _Splines:
        """What finite strain adds under Hertz' pressure: the first coefficient over L^(1/3) is the value at L = 0, and
        splines sum to 1."""
        table = self.hertz.coefficients
        return replace(self.hertz, coefficients=np.ascontiguousarray(table - table[:, :1]))

    @cached_property
    def contact_strain(self) -> _Splines:
        """What finite strain adds in contact with the linear layer."""
        table = load_contact()
        return self._splines(*table.contact_axes, table.profile_over(self._radii))

    @cached_property
    def _wavenumbers(self) -> tuple[Floats, Floats]:
        return _wavenumbers(self._turns)

    @property
    def wavenumbers(self) -> int:
        """How many there are."""
        return PANEL * _panels(self._turns)

    @property
    def wavenumber(self) -> Floats:
        """k, in units of 1/h, at which `linear_at` wants transforms."""
        return self._wavenumbers[0]

    @cached_property
    def _bessel(self) -> Floats:
        """J0(k e) k/3 with the weights of the integral, as functions of the offset (functions, k)."""
        k, weight = self._wavenumbers
        bessel = j0(np.multiply.outer(k, self._of_offset.nodes)) * (weight * k / 3)[:, None]
        return np.ascontiguousarray(self._of_offset.coefficients(bessel, 1).T)

    @cached_property
    def contact_grid(self) -> CurveGrid:
        """The grid of contacts with a layer whose pressures' transforms are at this object's wavenumbers."""
        return CurveGrid(self.wavenumber)

    def linear_at(self, transforms: Floats, contact: Indices, offset: Floats, points: tuple[int, ...]) -> Floats:
        """Hankel integrals of transforms p̂ · M · 2 J1(kρ)/(kρ) (quantities, …, contacts, k) of these contacts (rows,)
        at offsets e/h (…, rows), and the first one's derivative by e/h: (quantities + 1, *points, rows)."""
        from underskin.mechanisms.models.sigma_kernel import linear_sigma

        whole = np.empty((len(transforms) + 1, *points, len(contact)))
        linear_sigma(
            self._bessel,
            self.hertz.ends[3],
            *self.hertz.axes[6:],
            contact,
            contiguous(transforms.reshape(len(transforms), -1, *transforms.shape[-2:])),
            contiguous(offset.reshape(-1, offset.shape[-1])),
            whole.reshape(len(whole), -1, len(contact)),
        )
        return whole


def offset_sigma(table: SigmaTable, rt_over_h: float, stretch: float, largest_offset: float) -> OffsetSigma:
    """The same, kept for the next model of the same skin; with room for offsets up to the next half of h."""
    return _kept(table, rt_over_h, stretch, min(PROFILE_END, float(np.ceil(2 * largest_offset) / 2)))


@lru_cache(maxsize=8)
def _kept(table: SigmaTable, rt_over_h: float, stretch: float, largest_offset: float) -> OffsetSigma:
    return OffsetSigma(table, rt_over_h, stretch, largest_offset)


def _disc_averages(along: CubicBasis, offsets: Floats, rt_over_h: float) -> Floats:
    """The matrix (offsets, radii) that averages a profile given at its radii over the offset disc; 0 beyond them."""
    from underskin.mechanisms.models.sigma_kernel import disc_averages

    x, weight = np.polynomial.legendre.leggauss(_RADIAL)
    radius = rt_over_h * (x + 1) / 2
    cosine = np.cos(np.pi * (np.arange(_ANGULAR) + 0.5) / _ANGULAR)
    total = np.zeros((len(offsets), len(along.nodes)))
    disc_averages(
        offsets, radius, weight * (x + 1) / 2 / _ANGULAR, cosine, along.nodes[-1], along.knots, along.cubics, total
    )
    return total @ along.to_coefficients


def _panels(highest: float) -> int:
    """Panels of [0, end] that are short enough for an oscillation over this distance."""
    turns = _WAVENUMBER_END * highest / (2 * np.pi)
    return int(np.ceil((turns * _NODES_PER_TURN + 48) / PANEL))


def _wavenumbers(highest: float) -> tuple[Floats, Floats]:
    """Gauss–Legendre nodes and weights on panels of [0, end], short enough for the fastest oscillation."""
    panels = _panels(highest)
    x, w = np.polynomial.legendre.leggauss(PANEL)
    half = _WAVENUMBER_END / panels / 2
    k = 2 * half * np.arange(panels)[:, None] + half * (1 + x)
    return k.ravel(), np.tile(half * w, panels)
