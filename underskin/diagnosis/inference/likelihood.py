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
from functools import cached_property

import numpy as np

from underskin.autodiff import contiguous
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.products import Products
from underskin.diagnosis.inference.sums import SlopeSums
from underskin.diagnosis.noise.noise_levels import SeveralLevels
from underskin.units import Floats

_FROM_SLOPES = 1e-3  # m: a recording whose response changes by more than itself over this way is led by its slopes


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


class Likelihoods:
    """Of predictions at several points, each at some sets of noise levels.

    Attributes, of recordings (points, sets, recordings): `a`; `uu` and `ur`, Re u*u and Re u*r of the residual r, over
    κ².
    """

    def __init__(
        self, lines: Lines, curvature: Curvature, products: Products, levels: SeveralLevels, bend: Floats
    ) -> None:
        """Levels are (points, sets, 1), `bend` (points, sensors)."""
        self.levels, self._products, self._curvature = levels, products, curvature
        self._sensors = lines.sensors
        self._k2 = k2 = levels.level**2
        sums = products.summed(levels)
        self._bend = own = bend[:, None, lines.sensor]
        p2 = levels.position**2
        placed, bent = bool(np.any(p2)), bool(bend.any())
        level = products.level[:, None]
        exponent = own + 0.5 * p2 * curvature.laplacian if placed else own
        self._factor: Floats = np.exp(exponent) if placed or bent else np.ones((1, 1, 1))
        self.a = a = level * self._factor if placed or bent else level
        self._known = known = a * (1 - own) if bent else a
        self.uu = uu = sums.uu / k2
        self.ur = ur = (sums.uy - known * sums.uu) / k2
        a2 = a**2
        self._as_model = levels.gain**2  # of V, in units of a²
        if placed:
            self._as_model = self._as_model + 0.5 * p2**2 * curvature.square
        variance = self._as_model * a2
        self._moved: Floats | float = 0.0
        if placed and products.place_slopes is not None:
            self._moved = p2 * (products.place_slopes**2).sum(axis=0)[:, None] * self._factor**2
            variance = variance + self._moved
        self._reduced = reduced = 1 / (1 + variance * uu)  # 1 − (share of u taken out)
        self._shrink = variance * reduced
        self._mm = a2 * uu * reduced  # mᵀ C_i⁻¹ m
        self._mr = a * ur * reduced
        tau2 = levels.spread**2
        self._tau2 = tau2
        self._sensor_mm = self._mm @ self._sensors
        self._sensor_mr = self._mr @ self._sensors
        self._sensor_shrink = tau2 / (1 + tau2 * self._sensor_mm)

    @property
    def sensor_gains(self) -> Floats:
        """The most probable b of each sensor (points, sensors), at the first set of noise levels."""
        return np.asarray((self._sensor_shrink * self._sensor_mr)[:, 0])

    def along(self, position: float) -> tuple[Floats, Floats, Floats]:
        """Re u*m, Re u*r and Re u*u of the first point's recordings (recordings,) at another positioning scatter, with
        weights that leave out κ."""
        sums = self._products.summed(self.levels)
        uu, uy = np.broadcast_to(sums.uu, self.a.shape)[0, 0], np.broadcast_to(sums.uy, self.a.shape)[0, 0]
        bend = self._bend[0, 0]
        a = self._products.level[0] * np.exp(bend + 0.5 * position**2 * self._curvature.laplacian)
        return a * uu, uy - a * (1 - bend) * uu, uu

    @property
    def slopes_along(self) -> Floats:
        """Re u*J of the first point's recordings (recordings, P), with the same weights."""
        uj, _, _ = self._along_slopes()
        return np.asarray(uj[0] * self._k2[0, 0, 0])

    def information(self, uj: Floats, square: Floats) -> Floats:
        """Jᵀ C⁻¹ J (points, P, P) of any J at the first set of noise levels, from Re u*J of the recordings (points,
        recordings, P) and Re JᵀJ (points, P, P), both over κ²."""
        shrink, weight = self._shrink[:, 0], (self.a * self._reduced)[:, 0, :, None]
        by_sensor = self._over_sensors(uj * weight)
        shared = by_sensor.transpose(0, 2, 1) @ (by_sensor * self._sensor_shrink[:, 0, :, None])
        return np.asarray(square - np.einsum("nrp,nr,nrq->npq", uj, shrink, uj, optimize=True) - shared)

    def normal_equations(self, growth: Floats | None = None) -> tuple[Floats, Floats]:
        """Jᵀ C⁻¹ J (points, P, P), the information on the parameters, and the gradient of the log likelihood (points,
        P), at the first set of noise levels.

        The gradient is that by the mean and by all columns that follow the model, ∂/∂θ (−½ log|C| − ½ rᵀC⁻¹r). How the
        position's slopes t change is told by their `growth` ∂ log |t|²/∂θ (points, recordings, P), finite where known;
        else they are taken to change as L does, or where they lead, not at all.
        """
        a, uu, ur, reduced, shrink, mm, mr = (
            part[:, 0, :, None] for part in (self.a, self.uu, self.ur, self._reduced, self._shrink, self._mm, self._mr)
        )
        uj, jr, square = self._along_slopes()
        information = self.information(uj, square)
        jr = jr - uj * (shrink * ur)
        mj = uj * (a * reduced)
        by_sensor = self._over_sensors(mj)
        sensor_shrink = self._sensor_shrink[:, 0, :, None]
        # From here on with the sensors' columns in C as well
        gains = self.sensor_gains[:, :, None]
        own_gains, own_shrink = self._of_sensors(gains), self._of_sensors(sensor_shrink)
        jr = jr - mj * own_gains
        mr_left = mr - mm * own_gains
        left = 1 - own_shrink * mm
        own = self._as_model[:, 0, :, None] * (jr * mr_left - mj * left)
        sensor_mr = self._sensor_mr[:, 0, :, None] - self._sensor_mm[:, 0, :, None] * gains
        sensor_left = 1 - sensor_shrink * self._sensor_mm[:, 0, :, None]
        shared = self._over_sensors(jr) * sensor_mr - by_sensor * sensor_left
        gradient = jr.sum(axis=1) + own.sum(axis=1) + self._tau2[:, 0] * shared.sum(axis=1)
        if isinstance(self._moved, np.ndarray):
            um = uu * a * reduced
            explained = ur * reduced - um * own_gains  # uᵀ C⁻¹ r
            taken = uu * reduced - own_shrink * um**2  # uᵀ C⁻¹ u
            by_growth = 0.5 * (explained**2 - taken) * self._growth(growth)
            if self._turning is not None:
                uv, vr = self._turning
                mv = uv * (a * reduced)
                by_growth = by_growth + (vr - uv * (shrink * ur) - mv * own_gains) * explained
                by_growth = by_growth - (uv * reduced - own_shrink * um * mv)
            gradient = gradient + (self._moved[:, 0, :, None] * by_growth).sum(axis=1)
        return information, gradient

    def _along_slopes(self) -> tuple[Floats, Floats, Floats]:
        """Re u*J and Re J*r of recordings (points, recordings, P), and Re JᵀJ (points, P, P), over κ²."""
        k2 = self._k2[:, 0, :, None]
        by_level = self._products.level_slopes
        f, uu, ur = (part[:, 0, :, None] for part in (self._factor, self.uu, self.ur))
        parts: list[tuple[Floats, Floats, Floats]] = []
        if by_level is not None:
            square = np.einsum("nrp,nr,nrq->npq", by_level, (f**2 * uu)[..., 0], by_level, optimize=True)
            parts.append((by_level * f * uu, by_level * f * ur, square))
        if self._turning is not None:
            uv, vr = self._turning
            level = self._products.level[..., None]
            assert self._slope_sums is not None
            square = np.einsum("nrpq,nr->npq", self._slope_sums.vv, ((f * level) ** 2 / k2)[..., 0])
            if by_level is not None:
                crossed = np.einsum("nrp,nr,nrq->npq", by_level, (f**2 * level)[..., 0], uv, optimize=True)
                square = square + crossed + crossed.transpose(0, 2, 1)
            parts.append((f * level * uv, f * level * vr, square))
        uj, jr, information = (sum(each[1:], each[0]) for each in zip(*parts, strict=True))
        return uj, jr, information

    @cached_property
    def _slope_sums(self) -> SlopeSums | None:
        return self._products.slope_sums(self.levels)

    @cached_property
    def _turning(self) -> tuple[Floats, Floats] | None:
        """Re u*v and Re v*r over κ² (points, recordings, P), v the derivatives of u; None where u is 1."""
        sums = self._slope_sums
        if sums is None:
            return None
        k2, known = self._k2[:, 0, :, None], self._known[:, 0, :, None]
        return sums.uv / k2, (sums.vy - known * sums.uv) / k2

    def _growth(self, known: Floats | None) -> Floats:
        """∂ log |t|²/∂θ (points, recordings, P)."""
        level, slopes, place = self._products.level, self._products.level_slopes, self._products.place_slopes
        assert slopes is not None
        assert place is not None
        led = _FROM_SLOPES**2 * (place**2).sum(axis=0) > level**2
        as_level = np.where(led[..., None], 0.0, 2 * slopes / np.where(led, 1.0, level)[..., None])
        return as_level if known is None else np.where(np.isfinite(known), known, as_level)

    def _over_sensors(self, rows: Floats) -> Floats:
        """Sums over the recordings of each sensor (points, recordings, P) to (points, sensors, P)."""
        return np.asarray(np.swapaxes(np.swapaxes(rows, 1, 2) @ self._sensors, 1, 2))

    def _of_sensors(self, values: Floats) -> Floats:
        """What each recording's sensor has (points, sensors, 1) to (points, recordings, 1)."""
        return values[:, self._sensors.argmax(axis=1)]
