"""A hypothesis (a model, its priors and the rows it explains), points at which it is evaluated, and its likelihood.

Recording i of sensor s, rows j:  y_ij = m_ij (1 + g_i) e^(b_s) + ∂m_ij·δ_i + n_ij, with
    n ~ N(0, κ² d_ij² + q_ij²) in real and imaginary part, g ~ N(0, s²), δ ~ N(0, p² I), b ~ N(0, τ²);
q is mains pick-up, 0 on most rows. All of this noise is marginalised exactly.

The contact's position scales a recording by a real factor, so m = L u and ∂m = t u with one direction u a recording.
C_i = κ² D + Q + V_i u uᵀ, V_i = s² a² + p² |t|² + ½ p⁴ tr(H²) a², with m = a u; sensors add τ² m mᵀ over their
recordings. C is inverted by Sherman and Morrison's identity: the time is linear in rows and in recordings. As C depends
on the model, log|C| is part of the likelihood.

e^b is linearised at `sensor_log_gain`, the most probable b of each sensor (Laplace's method for b). Where σ has an
extremum at the contact, p acts in second order: on the mean by the factor exp(½ p² ∇²σ/σ), on the variance as above,
with H, the Hessian of σ, of the base model.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from underskin.autodiff import contiguous
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.gaussian import Gaussian
from underskin.diagnosis.inference.products import (
    AtPoints,
    CurveLines,
    CurveProducts,
    FrfLines,
    PickupRows,
    Products,
    SlopeSums,
    frf_lines,
    pickup_rows,
)
from underskin.diagnosis.noise import (
    GAIN_PRIOR,
    POSITION_PRIOR,
    USUAL,
    NoiseLevels,
    Plateau,
    SeveralLevels,
    level_prior,
)
from underskin.mechanisms.base import Normal, Parameter
from underskin.mechanisms.models.composed import Model, compose
from underskin.mechanisms.models.composition import parameters_together
from underskin.mechanisms.models.curves import CurveModel
from underskin.mechanisms.models.frf import FrfModel
from underskin.recordings.campaign import Conditions, frf_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Indices, Mask


@dataclass(frozen=True)
class Curvature:
    """∇²σ/σ [1/m²] and tr(H²)/σ² [1/m⁴] over the contact's position (recordings,)."""

    laplacian: Floats
    square: Floats


def log_likelihoods(
    lines: Lines, curvature: Curvature, products: Products, levels: SeveralLevels, sensor_log_gain: Floats
) -> Floats:
    """Log likelihoods (points, sets) of predictions at several points, at sets of noise levels (points, sets, 1).

    `sensor_log_gain` is (points, sensors).
    """
    from underskin.diagnosis.kernels import log_likelihoods as add

    sums = products.summed(levels)
    about_means, numbers = lines.about_means
    further = sums.log_determinant + 2 * numbers * np.log(levels.level) + about_means / levels.level**2
    log_likelihood = np.ascontiguousarray(-0.5 * np.asarray(further)[..., 0])
    slopes = products.squared_slopes
    squared_slopes = np.zeros((len(sensor_log_gain), 0)) if slopes is None else slopes
    noise = np.concatenate([levels.gain, levels.level, levels.position, levels.spread], axis=-1)
    arrays = map(contiguous, (products.level, sums.uu, sums.uy, sums.across, squared_slopes))
    add(
        *arrays, lines.sensor, contiguous(sensor_log_gain), curvature.laplacian, curvature.square, noise, log_likelihood
    )
    return log_likelihood


_FROM_SLOPES = 1e-3  # m: the slopes dominate where the response changes by more than itself over this distance


class Tangent:
    """The likelihood of predictions at several points, linearised: what any changes J of the predictions would tell.

    All columns are (points, 1, recordings), with the noise of each recording alone taken out (`reduced`), and
    (points, 1, sensors) with that of the sensors.
    """

    def __init__(
        self, lines: Lines, curvature: Curvature, products: Products, levels: SeveralLevels, sensor_log_gain: Floats
    ) -> None:
        """`levels` (points, 1, 1), `sensor_log_gain` (points, sensors)."""
        self._products, self._levels = products, levels
        self._sensors = lines.sensors
        self._log_gains = sensor_log_gain[:, None, lines.sensor]
        self._k2, p2 = levels.level**2, levels.position**2
        self._sums = sums = products.summed(levels)
        self._curvature = curvature
        self._factor = factor = np.exp(self._log_gains + 0.5 * p2 * curvature.laplacian)
        self._a = a = products.level[:, None] * factor
        self._mean = a * (1 - self._log_gains)
        self._uu, self._ur = sums.uu / self._k2, (sums.uy - self._mean * sums.uu) / self._k2
        self._as_model = levels.gain**2 + 0.5 * p2**2 * curvature.square
        slopes = products.squared_slopes
        self._moved = np.zeros(a.shape) if slopes is None else p2 * slopes[:, None] * factor**2
        self._variance = self._as_model * a**2 + self._moved
        self._reduced = 1 / (1 + self._variance * self._uu)  # 1 − (share of u taken out)
        tau2 = levels.spread**2
        of_sensors = (a * self._reduced * np.concatenate([a * self._uu, self._ur], axis=1)) @ self._sensors
        self._sensor_shrink = tau2 / (1 + tau2 * of_sensors[:, :1])
        self._sensor_gains = self._sensor_shrink * of_sensors[:, 1:]

    @property
    def sensor_gains(self) -> Floats:
        """The most probable b of each sensor (points, sensors)."""
        return np.asarray(self._sensor_gains[:, 0])

    def projections(self, position: float) -> tuple[Floats, Floats, Floats]:
        """Re u*m, Re u*r and Re u*u of the first point's recordings (recordings,) at another positioning scatter [m],
        with weights 1/d² (without κ)."""
        log_gain, level = self._log_gains[0, 0], self._products.level[0]
        uu, uy = (np.broadcast_to(of[0, 0], level.shape) for of in (self._sums.uu, self._sums.uy))
        a = level * np.exp(log_gain + 0.5 * position**2 * self._curvature.laplacian)
        return a * uu, uy - a * (1 - log_gain) * uu, uu

    @cached_property
    def _slope_sums(self) -> SlopeSums | None:
        return self._products.slope_sums(self._levels)

    @property
    def slope_projections(self) -> Floats:
        """Re u*J (points, P, recordings) of the derivatives by the parameters, with weights 1/d² (without κ)."""
        by_level, sums = self._products.level_slopes, self._slope_sums
        along = 0.0 if by_level is None else by_level * self._factor * self._sums.uu
        return np.asarray(along if sums is None else along + sums.uv * self._a)

    def information(self, uj: Floats, square: Floats) -> Floats:
        """Jᵀ C⁻¹ J (points, P, P) of any J, from Re u*J (points, P, recordings) and Re JᵀJ (points, P, P), with weights
        1/d²."""
        along = uj / self._k2
        by_sensor = (along * self._a * self._reduced) @ self._sensors
        shared = (along * self._variance * self._reduced) @ along.swapaxes(1, 2)
        shared += (by_sensor * self._sensor_shrink) @ by_sensor.swapaxes(1, 2)
        return np.asarray(square / self._k2 - shared)

    def information_on_forces(self, changes: Floats) -> Floats:
        """The same of changes of the force of curves (P, samples), at the first point (P, P)."""
        assert isinstance(self._products, CurveProducts)
        along, square = self._products.with_force_changes(changes, self._levels)
        return np.asarray(self.information(along[None], square[None])[0])

    @property
    def normal_equations(self) -> tuple[Floats, Floats]:
        """Information Jᵀ C⁻¹ J (points, P, P) on the parameters and gradient of the log likelihood (points, P).

        J = F ∂L u + a v. The gradient follows from those by L, Re u*u and Re u*y of each recording, and includes log|C|
        and the columns of C that depend on the model: exact without positioning scatter and at sensor gains of 0, else
        as `_gradients` says.
        """
        by_level, sums = self._products.level_slopes, self._slope_sums
        of_level, of_uv, of_vr = self._gradients
        gradient, square = np.zeros(1), np.zeros(1)
        if by_level is not None:
            leveled = by_level * self._factor
            square = (leveled * self._sums.uu) @ leveled.swapaxes(1, 2)
            gradient = by_level @ of_level
        if sums is not None:
            square = square + (sums.vv @ (self._a**2)[..., None])[..., 0]
            gradient = gradient + sums.uv @ of_uv + (sums.vy - self._mean * sums.uv) @ of_vr
        if by_level is not None and sums is not None:
            mixed = leveled @ (self._a * sums.uv).swapaxes(1, 2)
            square = square + mixed + mixed.swapaxes(1, 2)
        return self.information(self.slope_projections, square), gradient[..., 0]

    @property
    def _gradients(self) -> list[Floats]:
        """Derivatives of the log likelihood (points, recordings, 1) by L, by Re u*v with Re v*r held, and by Re v*r, v
        being a change of u and r the residual.

        The position slopes are taken to change as L does, or not at all where they dominate, and the mean as if the
        sensors' gains were 0.
        """
        a, uu, ur, variance, reduced = self._a, self._uu, self._ur, self._variance, self._reduced
        gain = self._sensor_gains @ self._sensors.T
        doubt = (self._sensor_gains**2 + self._sensor_shrink) @ self._sensors.T
        by_ur = reduced * (variance * ur + a * gain)
        by_reduced = 0.5 * variance * ur**2 - 0.5 * doubt * a**2 * uu + gain * a * ur
        by_variance = 0.5 * reduced * (ur**2 - uu) - by_reduced * reduced**2 * uu
        by_uu = -0.5 * reduced * (variance + doubt * a**2) - by_reduced * reduced**2 * variance
        by_a = a * (2 * self._as_model * by_variance - doubt * uu * reduced) + gain * ur * reduced
        by_level = self._factor * (by_a + ur - by_ur * uu)
        if (slopes := self._products.squared_slopes) is not None:
            level = self._products.level
            along = _FROM_SLOPES**2 * slopes < level**2
            moved = np.divide(2 * self._moved[:, 0], level, out=np.zeros(level.shape), where=along)
            by_level = by_level + moved[:, None] * by_variance
        columns = by_level, (2 * by_uu - by_ur * a) / self._k2, (a + by_ur) / self._k2
        return [column.swapaxes(1, 2) for column in columns]


@dataclass(frozen=True)
class CellResponse:
    """Most probable zero and drift `offset` (rows,) [N] and relative `gain` (recordings,) of the cells, and the
    variance (rows,) [N²] of the prediction by their uncertainty."""

    offset: Floats
    gain: Floats
    variance: Floats

    def reading(self, lines: Lines, force: Floats) -> Floats:
        """The cells' readings (rows,) [N] of a force (rows,) [N]."""
        return force * (1 + self.gain[lines.recording]) + self.offset


def cell_response(lines: Lines, levels: NoiseLevels, force: Floats, observed: Mask | None = None) -> CellResponse:
    """Estimated from the rows that are `observed` (default: all): y = F (1 + g) + P c + ε, with the priors of g and c.

    `force` (rows,) is F, the prediction without g and c.
    """
    assert lines.smooth is not None
    observed = np.ones(len(force), dtype=bool) if observed is None else observed
    offset, variance, gain = np.zeros(len(force)), np.zeros(len(force)), []
    for span in lines.spans:
        design = np.column_stack([levels.gain * force[span], lines.smooth.columns[span]])
        rows = np.flatnonzero(observed[span])
        error = lines.smooth.part(span.start + rows)
        noise = error.covariance(levels.smooth) + np.diag((levels.level * lines.deviation[span][rows]) ** 2)
        weighed = np.linalg.solve(noise, design[rows])
        information = np.eye(design.shape[1]) + design[rows].T @ weighed
        coefficients = np.linalg.solve(information, weighed.T @ (lines.value.real[span] - force[span])[rows])
        offset[span] = design[:, 1:] @ coefficients[1:]
        gain.append(levels.gain * coefficients[0])
        variance[span] = np.einsum("ri,ij,rj->r", design, np.linalg.inv(information), design)
    return CellResponse(offset, np.array(gain), variance)


_STEP = 0.05  # of the finite difference, in h; σ varies over lengths of 0.3 h and more
_LEAST = 0.2  # of the largest σ: where σ is smaller, the first derivative describes the effect of scatter


def curvature(lines: Lines, table: SigmaTable) -> Curvature:
    """∇²σ/σ and tr(H²)/σ² of each recording's contact, at the declared E and h; `lines` are collapsed."""
    campaign = lines.campaign
    assert campaign.skin.thickness_mm is not None
    step = _STEP * campaign.skin.thickness_mm
    sensors = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    moved = []
    for number, (x, y) in enumerate(((0.0, 0.0), (step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step))):
        for conditions in frf_of(campaign):
            position = conditions.position_mm or sensors[conditions.sensor]
            moved_position = (position[0] + x, position[1] + y)
            moved.append(conditions.without_measurements(id=f"{number} {conditions.id}", position_mm=moved_position))
    model = compose((), Conditions(campaign.name, campaign.skin, tuple(moved)), table, "frf")
    prediction = model.predict(np.array([parameter.start for parameter in model.parameters]))
    assert prediction.position_slopes is not None
    value, *_ = np.split(prediction.value.real, 5)
    _, right, left, up, down = np.split(prediction.position_slopes.real, 5, axis=1)
    hessian_x, hessian_y = (right - left) / (2e-3 * step), (up - down) / (2e-3 * step)
    scale = np.where(np.abs(value) > _LEAST * np.abs(value).max(), value, np.inf)
    square = (hessian_x**2).sum(axis=0) + (hessian_y**2).sum(axis=0)
    return Curvature((hessian_x[0] + hessian_y[1]) / scale, square / scale**2)


@dataclass(frozen=True)
class Points(AtPoints):
    """Coordinates of fits of one hypothesis: of the model (points, parameters), of the covariance, and the sensors' log
    gains."""

    fit: Floats
    covariance: Floats
    sensor_log_gain: Floats

    def __len__(self) -> int:
        return len(self.fit)


@dataclass(frozen=True)
class Evaluated(AtPoints):
    """Points with their products and `cost`, minus the log posterior density up to a constant that all share."""

    points: Points
    products: Products
    cost: Floats

    def __len__(self) -> int:
        return len(self.points)

    def subset(self, points: Indices) -> "Evaluated":
        """Some of the points, in their order; itself where that is all of them."""
        return self if len(points) == len(self) else self[points]

    @property
    def best(self) -> "Evaluated":
        """The point of least cost."""
        return self[np.array([np.argmin(self.cost)])]


FLAT = 1e-3  # standard deviations of a quadratic, at least, within a parameter's bounds: keeps information invertible


@dataclass(frozen=True)
class CovarianceParameter:
    """A parameter that changes the covariance only: its name, and bounds and prior of its coordinate."""

    name: str
    low: float
    high: float
    prior: Plateau


@dataclass(frozen=True)
class Hypothesis:
    """A model and the lines it explains, with or without positioning scatter, and the priors of the scatters."""

    model: Model
    lines: Lines
    curvature: Curvature
    has_position_scatter: bool
    gain: Plateau = GAIN_PRIOR
    smooth: Plateau = USUAL  # η of curves
    other_kinds: Gaussian | None = None  # from recordings of other kinds

    @cached_property
    def mean_indices(self) -> list[int]:
        """The indices of the model's parameters that change the mean."""
        return [index for index, parameter in enumerate(self.model.parameters) if not parameter.moves_covariance]

    @cached_property
    def covariance(self) -> tuple[CovarianceParameter, ...]:
        """Gain scatter, line level, positioning scatter or smooth error if any, then those of the model's
        mechanisms."""
        low, high = self.lines.level_bounds
        level = level_prior(self.lines.noise.log_level_sd)
        common = [
            CovarianceParameter("gain", np.log(1e-3), np.log(0.5), self.gain),
            CovarianceParameter("level", np.log(low), np.log(high), level),
        ]
        if self.has_position_scatter:
            highest = POSITION_PRIOR.high + np.log(2.0)
            common.append(CovarianceParameter("position", np.log(2e-5), highest, POSITION_PRIOR))
        if self.lines.smooth is not None:
            common.append(CovarianceParameter("smooth", np.log(1e-5), np.log(2.0), self.smooth))
        of_model = [
            CovarianceParameter(parameter.name, *parameter.bounds, _as_plateau(parameter))
            for parameter in self.model.parameters
            if parameter.moves_covariance
        ]
        return (*common, *of_model)

    @cached_property
    def bounds(self) -> Floats:
        """Lowest and highest coordinates of the model's parameters (2, parameters)."""
        return np.array([parameter.bounds for parameter in self.model.parameters]).T

    @cached_property
    def priors(self) -> Floats:
        """Rows of precision and centre of the parameters' priors (see `curvature_of_prior`), log of their height, and
        degrees of freedom of their tails (4, parameters)."""
        rows = []
        for parameter in self.model.parameters:
            freedom = parameter.prior.freedom if isinstance(parameter.prior, Normal) else np.inf
            rows.append((*curvature_of_prior(parameter), parameter.log_height, freedom))
        return np.array(rows).T

    @cached_property
    def prior_precision(self) -> Floats:
        """Of the parameters' priors (parameters,), at least `FLAT` standard deviations within the bounds."""
        return np.asarray(self.priors[0] + (FLAT / np.maximum(np.ptp(self.bounds, axis=0), 1e-300)) ** 2)

    @cached_property
    def spans(self) -> dict[str, slice]:
        """The slice of the model's parameters that belongs to each mechanism."""
        return parameter_slices(self.model.names, self.lines)

    def index(self, name: str) -> int:
        """The index of one of the model's parameters."""
        return [parameter.name for parameter in self.model.parameters].index(name)

    @property
    def mechanism_parameter_count(self) -> int:
        """The number of parameters that belong to mechanisms; they come first."""
        return max((span.stop for span in self.spans.values()), default=0)

    @cached_property
    def _curve_lines(self) -> CurveLines:
        return CurveLines(self.lines)

    def curve_products(self, fit: Floats, *, slopes: bool) -> CurveProducts:
        """Of curves the inner products of the model at points (points, parameters), with derivatives if `slopes`."""
        assert isinstance(self.model, CurveModel)
        force, by_force = self.model.forces_and_slopes(fit) if slopes else (self.model.forces(fit), None)
        return CurveProducts.of(self._curve_lines, force, by_force)

    @property
    def frf_model(self) -> FrfModel:
        """The model, if it is one of FRFs."""
        assert isinstance(self.model, FrfModel)
        return self.model

    @cached_property
    def frf_lines(self) -> FrfLines:
        """The lines as sums over the model's distinct lines."""
        return frf_lines(self.lines, self.frf_model.design)

    @cached_property
    def pickup_rows(self) -> PickupRows | None:
        """The rows that mains pick-up reaches, if the model has any."""
        pickup, design = self.model.pickup, self.frf_model.design
        return None if pickup is None else pickup_rows(self.lines, pickup, design)


@dataclass(frozen=True)
class FitPoint:
    """A fit's coordinates of the model and of the covariance, and each sensor's most probable log gain."""

    fit: Floats
    covariance: Floats
    sensor_log_gain: Floats


def _as_plateau(parameter: Parameter) -> Plateau:
    """A parameter's prior within its bounds, normalised there."""
    if isinstance(parameter.prior, Normal):
        area = float(np.exp(-parameter.log_height))
        return Plateau(parameter.prior.mean, parameter.prior.mean, parameter.prior.sd, parameter.prior.sd, area)
    low, high = parameter.bounds
    return Plateau(low, high, 1.0, 1.0, high - low)


def curvature_of_prior(parameter: Parameter) -> tuple[float, float]:
    """Precision and centre of a parameter's prior; 0 where it is uniform."""
    if isinstance(parameter.prior, Normal):
        return parameter.prior.sd**-2, parameter.prior.mean
    return 0.0, 0.0


def quadratic_of_prior(parameter: Parameter, fit: float) -> tuple[float, float]:
    """Precision and centre of the quadratic with the gradient of a parameter's prior at a fit coordinate, for the
    covariance of a fit; 0 where the prior is uniform."""
    precision, centre = curvature_of_prior(parameter)
    freedom = parameter.prior.freedom if isinstance(parameter.prior, Normal) else np.inf
    if np.isfinite(freedom):
        precision *= (freedom + 1) / (freedom + precision * (fit - centre) ** 2)
    return precision, centre


def parameter_slices(names: Sequence[str], lines: Lines) -> dict[str, slice]:
    """The slice of a composed model's parameters that belongs to each mechanism."""
    mechanisms = [mechanism for name, mechanism in lines.mechanisms.items() if name in names]
    slices, first = {}, 0
    for name, parameters in parameters_together(mechanisms, lines.campaign, lines.kind).items():
        slices[name] = slice(first, first + len(parameters))
        first += len(parameters)
    return slices
