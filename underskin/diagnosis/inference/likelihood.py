"""How probable the recordings are under a model, with all of its noise marginalised exactly.

Recording i of sensor s, rows j:  y_ij = m_ij (1 + g_i) e^(b_s) + ∂m_ij·δ_i + n_ij, with
    n ~ N(0, κ² d_ij² + q_ij²) in real and imaginary part, g ~ N(0, s²), δ ~ N(0, p² I), b ~ N(0, τ²);
q is mains pick-up, 0 on most rows.
The contact's place scales a recording by a real factor, so m and ∂m are one direction u in each recording; where m
vanishes, u is that of ∂m. C_i = κ² D + Q + V_i u uᵀ, V_i = s² a² + p² |t|² + ½ p⁴ tr(H²) a², with
m = a u and ∂m = t u; sensors add τ² m mᵀ over their recordings. All of it is taken out by Sherman and Morrison's
identity, so that time is linear in rows and recordings. The covariance follows the model, so log|C| stays.

e^b is linearised at `bend`, the most probable b of each sensor: Laplace's method for b. Where a contact sits on an
extremum of σ, p acts in second order: on the mean by the factor exp(½ p² ∇²σ/σ), on the variance as above, with H of
the base model.
"""

from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.pickup_rows import PickupRows
from underskin.diagnosis.noise.noise_levels import NoiseLevels, SeveralLevels
from underskin.mechanisms.models.composed import Prediction
from underskin.units import Array, Floats

_FROM_SLOPES = 1e-3  # m: a recording whose response changes by more than itself over this way is led by its slopes


@dataclass(frozen=True)
class Curvature:
    """Of σ over the contact's place, relative to σ (recordings,) [1/m²] and [1/m⁴]: ∇²σ/σ and tr(H²)/σ²."""

    laplacian: Floats
    square: Floats


class Moments:
    """All inner products over rows that the likelihood of one prediction needs, with 1/d² as the weight.

    Products are real, Re(a* b), summed over the rows of one recording. `bend` (recordings,) is b of each one's sensor;
    `position` is the p at which the second-order mean is taken, `ratio` the η/κ of curves (see correlated_error).
    """

    def __init__(
        self,
        lines: Lines,
        prediction: Prediction,
        bend: Floats,
        curvature: Curvature,
        position: float,
        ratio: float = 0.0,
    ) -> None:
        """Weigh and sum."""
        self._first = self.lines_first = lines.first
        self._lines = lines
        self._bend, self._laplacian, self.position = bend, curvature.laplacian, position
        factor = np.exp(bend + 0.5 * position**2 * curvature.laplacian)
        self._factor = factor[lines.recording]
        self.ratio = ratio
        self.log_determinant = 0.0 if lines.whitening is None else lines.whitening.log_determinant(ratio)
        self._slopes = prediction.slopes
        model = self._weighed(prediction.value * self._factor)
        residual = self._weighed(lines.value) - model * (1 - bend[lines.recording])
        direction, self.along = model, np.ones(lines.recordings)
        self.moved = np.zeros(lines.recordings)
        self.led = np.zeros(lines.recordings, dtype=bool)
        if position > 0 and prediction.position_slopes is not None:
            direction = self._direction(model, self._weighed(prediction.position_slopes * self._factor))
        self._direction_rows = direction
        self._residual = residual
        self.second_order = curvature.square
        self._sum_up()
        self.pickup_rows = None if prediction.pickup_rows is None else PickupRows(lines, prediction.pickup_rows)

    def summed(self, levels: NoiseLevels | SeveralLevels) -> tuple[Array, Array, Array, Floats | float]:
        """uᵀu, uᵀr and rᵀr less what rows lose to pick-up, and what that adds to the log of the determinant."""
        if self.pickup_rows is None or levels.pickup is None:
            return self.uu, self.ur, self.rr, 0.0
        lost, log_determinant = self.pickup_rows.lost(levels.pickup, levels.level)
        u, r = self._direction_rows[self.pickup_rows.rows], self._residual[self.pickup_rows.rows]
        uu, ur, rr = (
            whole - self.pickup_rows.over_recordings(lost * (a.conj() * b).real)
            for whole, a, b in ((self.uu, u, u), (self.ur, u, r), (self.rr, r, r))
        )
        return uu, ur, rr, log_determinant

    def without(self, levels: NoiseLevels) -> "Moments":
        """With all sums less what rows lose to pick-up."""
        if self.pickup_rows is None or levels.pickup is None:
            return self
        other = copy(self)
        other.uu, other.ur, other.rr, _ = self.summed(levels)
        jj, uj, jr = self.slopes
        (lost, _), rows = self.pickup_rows.lost(levels.pickup, levels.level), self.pickup_rows.rows
        slopes, over = self._slope_rows[:, rows], self.pickup_rows.over_recordings
        real = np.concatenate([slopes.real, slopes.imag], axis=1)
        jj = jj - (real * np.tile(lost, 2)) @ real.T
        uj = uj - over(lost * (self._direction_rows[rows].conj() * slopes).real).T
        jr = jr - over(lost * (self._residual[rows].conj() * slopes).real).T
        other.__dict__["slopes"] = jj, uj, jr
        return other

    def at_position(self, position: float | Floats, uu: Array, ur: Array, rr: Array) -> tuple[Array, Array, Array]:
        """a, uᵀr, rᵀr with the second-order mean at another p than these were summed at."""
        if np.all(position == self.position):
            return self.along, ur, rr
        factor = np.exp(0.5 * (position**2 - self.position**2) * self._laplacian)
        less = (factor - 1) * (1 - self._bend) * self.along
        return self.along * factor, ur - less * uu, rr - 2 * less * ur + less**2 * uu

    @property
    def log_slopes(self) -> Floats:
        """log |t|² of each recording's position slopes, without the second-order factor; least where there are none."""
        return np.asarray(np.log(self.moved * self.uu + 1e-300) - self.position**2 * self._laplacian)

    def _direction(self, model: Array, slopes: Array) -> Array:
        """u, whether the slopes lead it (`led`), and along it a (`along`) and |t|² (`moved`)."""
        mm = self._sum(model, model)
        sizes = np.stack([self._sum(slope, slope) for slope in slopes])
        self.led = led = _FROM_SLOPES**2 * sizes.sum(axis=0) > mm
        direction = model
        if led.any():
            larger = np.where((sizes[0] >= sizes[1])[self._lines.recording], slopes[0], slopes[1]) * _FROM_SLOPES
            direction = np.where(led[self._lines.recording], larger, model)
        uu = np.maximum(self._sum(direction, direction), 1e-300)
        self.along = self._sum(direction, model) / uu
        self.moved = (self._sum(direction, slopes[0]) / uu) ** 2 + (self._sum(direction, slopes[1]) / uu) ** 2
        return direction

    def at_ratio(self, ratio: float) -> "Moments":
        """Of curves: the same prediction at another η/κ; the rows are turned already and only weighed again."""
        assert self._lines.whitening is not None
        change = self._lines.whitening.weight(ratio) / self._lines.whitening.weight(self.ratio)
        other = copy(self)
        other.__dict__.pop("slopes", None)
        other.ratio = ratio
        other.log_determinant = self._lines.whitening.log_determinant(ratio)
        other._direction_rows = self._direction_rows * change
        other._residual = self._residual * change
        other._slope_rows = self._slope_rows * change
        other._sum_up()
        return other

    def _sum_up(self) -> None:
        self.uu = self._sum(self._direction_rows, self._direction_rows)
        self.ur = self._sum(self._direction_rows, self._residual)
        self.rr = self._sum(self._residual, self._residual)

    def _weighed(self, rows: Array) -> Array:
        """Over d; of curves such that their samples are independent."""
        whitening = self._lines.whitening
        return rows / self._lines.deviation if whitening is None else whitening(rows, self.ratio)

    def _sum(self, a: Array, b: Array) -> Floats:
        products = (a.conj() * b).real
        return products if len(self._first) == len(products) else np.add.reduceat(products, self._first)

    @cached_property
    def _slope_rows(self) -> Array:
        return self._weighed(self._slopes * self._factor)

    @cached_property
    def slopes(self) -> tuple[Floats, Floats, Floats]:
        """Of the model's derivatives J: JᵀJ (P, P); for each recording uᵀJ and Jᵀr (recordings, P)."""
        rows = self._slope_rows
        real = np.concatenate([rows.real, rows.imag], axis=1)

        def summed(products: Array) -> Array:
            if len(self._first) != products.shape[1]:
                products = np.add.reduceat(products, self._first, axis=1)
            return products.T

        uj = summed((self._direction_rows.conj() * rows).real)
        jr = summed((self._residual.conj() * rows).real)
        return real @ real.T, uj, jr


class LogLikelihoods:
    """Of one prediction at one set of noise levels (), or at several (K,): `each`."""

    def __init__(self, lines: Lines, moments: Moments, levels: NoiseLevels | SeveralLevels) -> None:
        """Take out pick-up, gain and position, recording by recording, then the sensors."""
        self._k2 = k2 = levels.level**2
        uu, ur, rr, from_pickup = moments.summed(levels)
        along, ur, rr = moments.at_position(levels.position, uu, ur, rr)
        self._along = along
        uu, ur, rr = uu / k2, ur / k2, rr / k2
        log_determinant: Any = moments.log_determinant + from_pickup
        self._uu, self._ur = uu, ur
        a2 = along**2
        variance = levels.gain**2 * a2
        if np.any(levels.position):
            p2 = levels.position**2
            variance = variance + p2 * moments.moved + 0.5 * p2**2 * moments.second_order * a2
        self._reduced = 1 / (1 + variance * uu)  # 1 − (share of u taken out)
        self._shrink = variance * self._reduced
        self._mm = a2 * uu * self._reduced  # mᵀ C_i⁻¹ m
        self._mr = along * ur * self._reduced
        self._sensor_mm = _sensor_sums(self._mm, lines.sensor)
        self._sensor_mr = _sensor_sums(self._mr, lines.sensor)
        tau2 = levels.spread**2
        self._sensor_shrink = tau2 / (1 + tau2 * self._sensor_mm)
        scatter, freedom = lines.scatter
        chi2 = _over_recordings(rr - self._shrink * ur**2) - _over_recordings(self._sensor_shrink * self._sensor_mr**2)
        log_determinant = log_determinant + (2 * len(lines.value) + freedom) * np.log(k2)
        log_determinant = log_determinant - _over_recordings(np.log(self._reduced))
        log_determinant = log_determinant + _over_recordings(np.log1p(tau2 * self._sensor_mm))
        self.each: Floats = -0.5 * (chi2 + scatter / k2 + log_determinant)[..., 0]


class Marginal(LogLikelihoods):
    """The likelihood of one prediction at one set of noise levels; what is needed of it is worked out when asked."""

    def __init__(self, lines: Lines, moments: Moments, levels: NoiseLevels) -> None:
        """Take out the noise."""
        super().__init__(lines, moments, levels)
        self._lines, self.levels = lines, levels
        self._all = moments
        self.log_likelihood = float(self.each)

    @cached_property
    def moments(self) -> Moments:
        """The inner products, less what rows lose to pick-up."""
        return self._all.without(self.levels)

    @property
    def sensor_gains(self) -> Array:
        """The most probable b of each sensor (sensors,), given the model."""
        return self._sensor_shrink * self._sensor_mr

    def normal_equations(self, growth: Floats | None = None) -> tuple[Array, Array]:
        """Jᵀ C⁻¹ J, the information on the parameters, and the gradient of the log likelihood.

        The gradient is that by the mean and by all columns that follow the model, ∂/∂θ (−½ log|C| − ½ rᵀC⁻¹r) with
        dC = V_i (J mᵀ + m Jᵀ) + dV_i m mᵀ. dV_i, from how the position's slopes t change, is told by their `growth`
        ∂ log |t|²/∂θ (recordings, P); without it they are taken to change as m does, or where they lead, not at all.
        """
        moments, k2 = self.moments, self._k2
        jj, uj, jr = moments.slopes
        jj, uj, jr = jj / k2, uj / k2, jr / k2
        information = jj - uj.T @ (self._shrink[:, None] * uj)
        jr = jr - uj * (self._shrink * self._ur)[:, None]
        mj = uj * (self._along * self._reduced)[:, None]
        sensor = self._lines.sensor
        by_sensor = _sensor_sums(mj.T, sensor).T
        information -= by_sensor.T @ (by_sensor * self._sensor_shrink[:, None])
        # From here on with the sensors' columns in C as well
        gains = self.sensor_gains
        jr = jr - mj * gains[sensor, None]
        mr = self._mr - self._mm * gains[sensor]
        left = 1 - self._sensor_shrink[sensor] * self._mm
        p2 = self.levels.position**2
        placed = p2 * moments.moved
        squares = self.levels.gain**2 + 0.5 * p2**2 * moments.second_order + np.where(moments.led, 0.0, placed)
        own = squares[:, None] * (jr * mr[:, None] - mj * left[:, None])
        tau2 = self.levels.spread**2
        sensor_mr = self._sensor_mr - self._sensor_mm * gains
        sensor_left = 1 - self._sensor_shrink * self._sensor_mm
        shared = _sensor_sums(jr.T, sensor).T * sensor_mr[:, None] - by_sensor * sensor_left[:, None]
        gradient = jr.sum(axis=0) + own.sum(axis=0) + tau2 * shared.sum(axis=0)
        if growth is not None:
            um = self._uu * self._along * self._reduced
            explained = self._ur * self._reduced - um * gains[sensor]  # uᵀ C⁻¹ r
            taken = self._uu * self._reduced - self._sensor_shrink[sensor] * um**2  # uᵀ C⁻¹ u
            as_model = np.where(moments.led, 0.0, 2 / moments.uu)[:, None] * moments.slopes[1]
            gradient = gradient + 0.5 * (placed * (explained**2 - taken)) @ (growth - as_model)
        return information, gradient


def _over_recordings(values: Floats) -> Floats:
    return np.asarray(values.sum(axis=-1, keepdims=True))


def _sensor_sums(values: Floats, sensor: NDArray[np.intp]) -> Floats:
    """Over the recordings of each sensor: (…, recordings) to (…, sensors)."""
    sensors = int(sensor.max()) + 1
    if values.ndim == 1:
        return np.asarray(np.bincount(sensor, values, sensors), dtype=float)
    owner = (np.arange(len(values))[:, None] * sensors + sensor).ravel()
    sums = np.bincount(owner, values.ravel(), len(values) * sensors)
    return np.asarray(sums, dtype=float).reshape(-1, sensors)
