"""σ for a sphere off the sensor's centre, and the effect of a scatter of its position.

An offset sensor averages the contact model's base profile T3(r; a/h, L) over its disc:
    σ(e) = (1/πρ²) ∫_disc profile(|e + s|) d²s, lengths in units of h.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from underskin.surrogate.sigma_table import ContactModel, CubicAxis
from underskin.units import Floats

_SPACING = 0.05  # of the grids in r/h and e/h; the profile turns over lengths of 0.3 h and more
_SCATTER_NODES = 7  # Gauss–Hermite, in x and y


@dataclass(frozen=True)
class PositionedSigma:
    """σ against the offset for each row (contact): `sigma` at the commanded offset, and the effect of scatter.

    NaN beyond the table's profile, in contact or offset. Beyond its end, where σ is nearly 0, scattered positions take
    the last value of σ.
    """

    sigma: Floats
    _offset_over_h: Floats
    _curve: CubicSpline

    def scattered(self, scatter_over_h: float) -> tuple[Floats, Floats]:
        """Mean and variance (rows,) of σ(e + δ)/σ(e), where δ is normal in x and in y.

        Parameters
        ----------
        scatter_over_h
            Standard deviation of δ in each direction, over the thickness.
        """
        nodes, weights = np.polynomial.hermite_e.hermegauss(_SCATTER_NODES)
        weights = weights / weights.sum()
        x = self._offset_over_h[:, None, None] + scatter_over_h * nodes[:, None]
        distance = np.hypot(x, scatter_over_h * nodes)
        ratio = (
            _evaluate_rows(self._curve, distance.reshape(len(x), -1)).reshape(distance.shape)
            / self.sigma[:, None, None]
        )
        weight = np.outer(weights, weights)
        mean = (ratio * weight).sum(axis=(1, 2))
        return mean, (ratio**2 * weight).sum(axis=(1, 2)) - mean**2


def positioned_sigma(
    contact_model: ContactModel,
    a_over_h: Floats,
    rt_over_h: float,
    load_parameter: Floats,
    offset_over_h: Floats,
    largest_scatter_over_h: float,
) -> PositionedSigma:
    """σ of contacts off the centre of a sensor, σ(e) = (1/πρ²) ∫_disc profile(|e + s|) d²s.

    Parameters
    ----------
    contact_model
        The σ table, or the solved contact.
    a_over_h, load_parameter, offset_over_h
        (rows,) contact radius at small strain over thickness, L, and distance of the contact from the sensor's centre
        over thickness.
    rt_over_h
        Sensor radius over thickness, one for all rows.
    largest_scatter_over_h
        Largest standard deviation of the position, over the thickness, for later calls of `scattered`.
    """
    largest_disc = contact_model.domain["rt_over_h"][1]
    disc_inside = rt_over_h <= largest_disc
    largest_offset = float(np.max(offset_over_h, initial=0.0)) + 4 * largest_scatter_over_h + 4 * _SPACING
    offsets, sigma = sigma_off_centre(
        contact_model, a_over_h, min(rt_over_h, largest_disc), load_parameter, largest_offset
    )
    curve = CubicSpline(offsets, np.nan_to_num(sigma), axis=1, bc_type=((1, np.zeros(len(sigma))), "not-a-knot"))
    commanded = _evaluate_rows(curve, offset_over_h[:, None])[:, 0]
    inside = disc_inside & (offset_over_h <= offsets[-1]) & np.isfinite(sigma).all(axis=1)
    return PositionedSigma(np.where(inside, commanded, np.nan), offset_over_h, curve)


def sigma_off_centre(
    contact_model: ContactModel,
    a_over_h: ArrayLike,
    rt_over_h: float,
    load_parameter: ArrayLike,
    largest_offset: float = np.inf,
) -> tuple[Floats, Floats]:
    """Offsets e/h (offsets,), up to the largest or to the end of the table's profile, and σ there of contacts (…,
    offsets); NaN outside the domain."""
    farthest = contact_model.profile_end
    offsets = _grid(min(largest_offset, farthest - rt_over_h))
    radii = np.minimum(_grid(min(offsets[-1] + rt_over_h + 4 * _SPACING, farthest)), farthest)
    profile = contact_model.profile(radii, np.asarray(a_over_h)[..., None], np.asarray(load_parameter)[..., None])
    return offsets, profile @ CubicAxis(radii).disc_averages(offsets, rt_over_h).T


def _grid(end: float) -> Floats:
    """Grid from 0 to `end`, which the last point may exceed by rounding only."""
    return _SPACING * np.arange(np.floor(end / _SPACING + 1e-9) + 1)


def _evaluate_rows(curve: CubicSpline, at: Floats) -> Floats:
    """Row i of the curve at the points of row i (rows, points); beyond its end, the curve's end."""
    at = np.minimum(at, curve.x[-1])
    cell = np.minimum((at / _SPACING).astype(int), len(curve.x) - 2)
    step = at - curve.x[cell]
    row = np.arange(len(at))[:, None]
    c = curve.c  # (power, cell, row), highest power first
    return ((c[0, cell, row] * step + c[1, cell, row]) * step + c[2, cell, row]) * step + c[3, cell, row]
