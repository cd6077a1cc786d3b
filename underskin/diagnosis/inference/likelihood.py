"""How probable the recordings are under predictions, with all of their noise marginalised exactly.

Recording i of sensor s, rows j:  y_ij = m_ij (1 + g_i) e^(b_s) + ∂m_ij·δ_i + n_ij, with
    n ~ N(0, κ² d_ij² + q_ij²) in real and imaginary part, g ~ N(0, s²), δ ~ N(0, p² I), b ~ N(0, τ²);
q is mains pick-up, 0 on most rows.
The contact's place scales a recording by a real factor, so m = L u and ∂m = t u have one direction u in each recording.
C_i = κ² D + Q + V_i u uᵀ, V_i = s² a² + p² |t|² + ½ p⁴ tr(H²) a², with m = a u; sensors add τ² m mᵀ over their
recordings. All of it is taken out by Sherman and Morrison's identity, so that time is linear in rows and in
recordings. The covariance follows the model, so log|C| stays.

e^b is linearised at `bend`, the most probable b of each sensor: Laplace's method for b. Where a contact sits on an
extremum of σ, p acts in second order: on the mean by the factor exp(½ p² ∇²σ/σ), on the variance as above, with H of
the base model.
"""

from dataclasses import dataclass

import numpy as np

from underskin.autodiff import contiguous
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.products import Products
from underskin.diagnosis.noise.noise_levels import SeveralLevels
from underskin.units import Floats


@dataclass(frozen=True)
class Curvature:
    """Of σ over the contact's place, relative to σ (recordings,) [1/m²] and [1/m⁴]: ∇²σ/σ and tr(H²)/σ²."""

    laplacian: Floats
    square: Floats


def log_likelihoods(
    lines: Lines, curvature: Curvature, products: Products, levels: SeveralLevels, bend: Floats
) -> Floats:
    """Of predictions at several points, each at some sets of noise levels (points, sets, 1): (points, sets).

    `bend` (points, sensors).
    """
    from underskin.diagnosis.inference.cost_kernel import log_likelihoods as add

    sums = products.summed(levels)
    about_means, numbers = lines.about_means
    further = sums.log_determinant + 2 * numbers * np.log(levels.level) + about_means / levels.level**2
    each = np.ascontiguousarray(-0.5 * np.asarray(further)[..., 0])
    slopes = products.place_slopes
    place = np.zeros((len(bend), 0)) if slopes is None else slopes[0] ** 2 + slopes[1] ** 2
    noise = np.concatenate([levels.gain, levels.level, levels.position, levels.spread], axis=-1)
    yy = sums.yy if sums.yy.ndim == 3 else sums.yy[None, None]
    arrays = map(contiguous, (products.level, sums.uu, sums.uy, yy, place))
    add(*arrays, lines.sensor, contiguous(bend), curvature.laplacian, curvature.square, noise, each)
    return each


def normal_equations(
    lines: Lines,
    curvature: Curvature,
    products: Products,
    levels: SeveralLevels,
    bend: Floats,
    growth: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Jᵀ C⁻¹ J (points, P, P), the information on the parameters, and the gradient of the log likelihood (points, P),
    at the first set of noise levels.

    The gradient is that by the mean and by all columns that follow the model, ∂/∂θ (−½ log|C| − ½ rᵀC⁻¹r). How the
    position's slopes t change is told by their `growth` ∂ log |t|²/∂θ (points, recordings, P), finite where known;
    else they are taken to change as L does, or where they lead, not at all.
    """
    from underskin.diagnosis.inference.normal_kernel import normal_equations as fill

    sums, slope_sums = products.summed(levels), products.slope_sums(levels)
    points, recordings = products.level.shape
    uu, uy = (np.broadcast_to(x[:, 0], (points, recordings)) for x in (sums.uu, sums.uy))
    none = np.zeros((points, recordings, 0))
    by_level = none if products.level_slopes is None else products.level_slopes
    turned = (none, none, none[..., None]) if slope_sums is None else (slope_sums.uv, slope_sums.vy, slope_sums.vv)
    slopes = products.place_slopes if np.any(levels.position) else None
    place = np.zeros((points, 0)) if slopes is None else slopes[0] ** 2 + slopes[1] ** 2
    noise = np.concatenate([levels.gain, levels.level, levels.position, levels.spread], axis=-1)[:, 0]
    count = max(by_level.shape[-1], turned[0].shape[-1])
    information, gradient = np.empty((points, count, count)), np.empty((points, count))
    arrays = products.level, by_level, uu, uy, *turned, place, none if growth is None else growth
    of_place = curvature.laplacian, curvature.square
    fill(*map(contiguous, arrays), lines.sensor, contiguous(bend), *of_place, contiguous(noise), information, gradient)
    return information, gradient


class Likelihoods:
    """Of predictions at several points, each at some sets of noise levels."""

    def __init__(
        self, lines: Lines, curvature: Curvature, products: Products, levels: SeveralLevels, bend: Floats
    ) -> None:
        """Levels are (points, sets, 1), `bend` (points, sensors)."""
        self.levels, self._products, self._curvature = levels, products, curvature
        self._sensors = lines.sensors
        self._bend = own = bend[:, None, lines.sensor]
        k2, p2 = levels.level**2, levels.position**2
        sums = products.summed(levels)
        self._factor = factor = np.exp(own + 0.5 * p2 * curvature.laplacian)
        a = products.level[:, None] * factor
        uu, ur = sums.uu / k2, (sums.uy - a * (1 - own) * sums.uu) / k2
        variance = (levels.gain**2 + 0.5 * p2**2 * curvature.square) * a**2
        if products.place_slopes is not None:
            variance = variance + p2 * (products.place_slopes**2).sum(axis=0)[:, None] * factor**2
        reduced = 1 / (1 + variance * uu)  # 1 − (share of u taken out)
        self._shrink, self._weight = variance * reduced, a * reduced
        tau2 = levels.spread**2
        self._sensor_mr = (a * ur * reduced) @ self._sensors
        self._sensor_shrink = tau2 / (1 + tau2 * ((a**2 * uu * reduced) @ self._sensors))

    @property
    def sensor_gains(self) -> Floats:
        """The most probable b of each sensor (points, sensors), at the first set of noise levels."""
        return np.asarray((self._sensor_shrink * self._sensor_mr)[:, 0])

    def along(self, position: float) -> tuple[Floats, Floats, Floats]:
        """Re u*m, Re u*r and Re u*u of the first point's recordings (recordings,) at another positioning scatter, with
        weights that leave out κ."""
        sums = self._products.summed(self.levels)
        bend, level = self._bend[0, 0], self._products.level[0]
        uu, uy = np.broadcast_to(sums.uu[0, 0], level.shape), np.broadcast_to(sums.uy[0, 0], level.shape)
        a = level * np.exp(bend + 0.5 * position**2 * self._curvature.laplacian)
        return a * uu, uy - a * (1 - bend) * uu, uu

    @property
    def slopes_along(self) -> Floats:
        """Re u*J of the first point's recordings (recordings, P), with the same weights."""
        uu, factor = self._products.summed(self.levels).uu[0, 0], self._factor[0, 0]
        by_level, sums = self._products.level_slopes, self._products.slope_sums(self.levels)
        along = 0.0 if by_level is None else by_level[0] * (factor * uu)[:, None]
        return np.asarray(along if sums is None else along + sums.uv[0] * (factor * self._products.level[0])[:, None])

    def information(self, uj: Floats, square: Floats) -> Floats:
        """Jᵀ C⁻¹ J (points, P, P) of any J at the first set of noise levels, from Re u*J of the recordings (points,
        recordings, P) and Re JᵀJ (points, P, P), both over κ²."""
        by_sensor = np.swapaxes(np.swapaxes(uj * self._weight[:, 0, :, None], 1, 2) @ self._sensors, 1, 2)
        shared = by_sensor.transpose(0, 2, 1) @ (by_sensor * self._sensor_shrink[:, 0, :, None])
        return np.asarray(square - np.einsum("nrp,nr,nrq->npq", uj, self._shrink[:, 0], uj, optimize=True) - shared)
