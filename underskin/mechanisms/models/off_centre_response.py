"""σ of many contacts on one skin at any offset, with derivatives, fast enough for a fit.

The table's bottom profile, averaged over the sensor's disc at its offset, is tabulated once as a cubic spline in a/h,
L^(1/3), log(rT/h) and e/h. To it may be added what a linear layer of another transmission or a pressure of another
shape puts there, by its Hankel integral (underskin/physics/hankel_transform.py):

    σ = linear(p̂, M; a, e) + [table(a, L, e) − table(a, 0, e)].

A contact beyond the table is reported in `inside`. Beyond the table's L it is continued along the tangent, beyond its
a/h along the tangent over 1/a², as which the pressure under a wide contact falls (on the axis within 3 % up to a/h =
4.2); beyond the profile's end, r/h = 8, the stress is 0 (below 1e-6 of its peak).
"""

from functools import cached_property, lru_cache

import numpy as np
from scipy.special import j0

from underskin.autodiff import Differentiated, as_columns, chain, contiguous, unfilled
from underskin.mechanisms.models.cubic_basis import CubicBasis
from underskin.physics.contact_curves import CurveGrid
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Indices, Mask

PROFILE_END = 8.0
_SPACING = 0.0625  # of the profile and of the offsets; the profile turns over lengths of 0.3 h and more
_MIRRORED = 4  # offsets below 0, so that the curve is even
_RADIAL, _ANGULAR = 10, 20  # quadrature over the disc
_RHO_RATIO = 1.1  # of neighbouring rT/h in the table
_WAVENUMBER_END, _NODES_PER_TURN = 24.0, 4  # M decays as e^(−k)
PANEL = 16  # wave numbers in each of several equal panels


class OffsetSigma:
    """σ(a/h, L^(1/3), rT/h, e/h) around one rT/h, for offsets up to `largest_offset` (in h)."""

    def __init__(self, table: SigmaTable, rt_over_h: float, stretch: float, largest_offset: float) -> None:
        """Tabulate for rT/h up to `stretch` times larger or smaller; takes hundredths to tenths of a second."""
        offsets = _SPACING * np.arange(-_MIRRORED, int(np.ceil(largest_offset / _SPACING)) + _MIRRORED + 1)
        rho_nodes = max(5, 1 + int(np.ceil(2 * np.log(stretch) / np.log(_RHO_RATIO))))
        rho = rt_over_h * np.geomspace(1 / stretch, stretch, rho_nodes)
        radii = np.arange(0.0, min(PROFILE_END, offsets[-1] + rho[-1]) + _SPACING / 2, _SPACING)
        radii = np.append(radii, radii[-1] + _SPACING * np.arange(1, 4)) if len(radii) < 4 else radii
        a, x = table.contact_axes
        along = CubicBasis(radii)
        self.bases = of_a, of_x, of_rho, of_offset = [CubicBasis(np.asarray(at)) for at in (a, x, np.log(rho), offsets)]
        # Splines and averages are all linear: the smaller arrays are turned into coefficients before their product
        profile = of_x.coefficients(of_a.coefficients(table.profile_over(radii), 1), 2)
        average = np.stack([_disc_averages(along, np.abs(offsets), ratio) for ratio in rho])
        average = of_offset.coefficients(of_rho.coefficients(average, 0), 1)
        self._table: Floats = np.ascontiguousarray(np.tensordot(profile, average, (0, 2)))
        self._ends = np.array([[basis.nodes[0], basis.nodes[-1]] for basis in self.bases])
        self._ends[3, 1] = self.end
        self._axes = [part for basis in self.bases for part in (basis.knots, basis.cubics)]
        self._turns = float(offsets[-1] + rho[-1] + a[-1])

    @cached_property
    def _strained(self) -> Floats:
        """What finite strain adds: the first coefficient over L^(1/3) is the value at L = 0, and splines sum to 1."""
        return np.ascontiguousarray(self._table - self._table[:, :1])

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
        bessel = j0(np.multiply.outer(k, self.bases[3].nodes)) * (weight * k / 3)[:, None]
        return np.ascontiguousarray(self.bases[3].coefficients(bessel, 1).T)

    @cached_property
    def contact_grid(self) -> CurveGrid:
        """The grid of contacts with a layer whose pressures' transforms are at this object's wavenumbers."""
        return CurveGrid(self.wavenumber)

    def contains(self, a_over_h: Floats, cbrt_load: Floats) -> Mask:
        """Which contacts the table holds; the others are continued."""
        return np.asarray((a_over_h <= self.bases[0].nodes[-1]) & (cbrt_load <= self.bases[1].nodes[-1]))

    @property
    def end(self) -> float:
        """The largest offset e/h that has a place; beyond it σ is 0."""
        return min(float(self.bases[3].nodes[-1]), PROFILE_END)

    def at(
        self,
        contact: Indices,
        a_over_h: Differentiated,
        cbrt_load: Differentiated,
        rt_over_h: Differentiated,
        offset: Differentiated,
        *,
        strained: bool,
    ) -> Differentiated:
        """σ of the table at rows (…, rows) of these contacts (rows,) and offsets e/h (…, rows).

        `strained`: less its own value at L = 0, which is what finite strain adds.
        """
        from underskin.mechanisms.models.sigma_kernel import table_sigma

        variables = self._within(a_over_h), cbrt_load, rt_over_h, offset
        points = np.broadcast_shapes(*(variable.value.shape[:-1] for variable in variables))
        result = unfilled(len(offset.slopes), (*points, len(contact)))
        columns = [array for variable in (*variables, result) for array in as_columns(variable)]
        table_sigma(self._strained if strained else self._table, self._ends, *self._axes, contact, *columns)
        return result

    def _within(self, a_over_h: Differentiated) -> Differentiated:
        """a/h, beyond the table's end e replaced by e (3 − (e/a)²)/2: the tangent there is then one over 1/a²."""
        end = self.bases[0].nodes[-1]
        beyond = np.maximum(a_over_h.value / end, 1.0)
        if (beyond == 1.0).all():
            return a_over_h
        value = np.where(beyond > 1.0, end * (1.5 - 0.5 * beyond**-2), a_over_h.value)
        return chain(value, (beyond**-3, a_over_h))

    def linear_at(self, transforms: Floats, contact: Indices, offset: Floats, points: tuple[int, ...]) -> Floats:
        """Hankel integrals of transforms p̂ · M · 2 J1(kρ)/(kρ) (quantities, …, contacts, k) of these contacts (rows,)
        at offsets e/h (…, rows), and the first one's derivative by e/h: (quantities + 1, *points, rows)."""
        from underskin.mechanisms.models.sigma_kernel import linear_sigma

        whole = np.empty((len(transforms) + 1, *points, len(contact)))
        linear_sigma(
            self._bessel,
            self._ends[3],
            *self._axes[6:],
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
