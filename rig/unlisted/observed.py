"""What a measurement says about each recording: one number with its covariance, and how a law would change it.

Amplitudes: y_i, the logarithm of the weighted mean of measured over frequency response, less the base model. Its
covariance is diag(gain^2 + position scatter + line noise) + 0.01^2 (sensor gains) + 0.02^2 (E) + 0.01^2 (h), nuisances
entering through their derivatives at the base model. One level (d33) and a static companion's parameter are free.

Loss angles: y_i is minus the weighted mean phase; nothing is free.

A table Phi_i(u), kept for each recording, turns a law's value u into the change of y_i.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from rig.unlisted.bench import SPECTRAL, Companion, Measurement, State, base_state, companion_column
from rig.unlisted.design import Design
from rig.unlisted.layer import log_transmission

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

_SLOPE = {"modulus": -1.0 / 3.0, "force": 1.0 / 3.0}


@dataclass(frozen=True)
class Table:
    """Phi on an even grid of u for each recording: cubic Hermite, level beyond the ends."""

    start: float
    step: float
    values: Array
    slopes: Array
    scale: float = 1.0

    def __call__(self, u: Array) -> tuple[Array, Array]:
        """Phi and dPhi/du at u of shape (..., recordings)."""
        last = self.values.shape[1] - 1
        t = np.clip((u * self.scale - self.start) / self.step, 0.0, last - 1e-9)
        i = t.astype(np.intp)
        r, row = t - i, np.arange(self.values.shape[0])
        y0, y1 = self.values[row, i], self.values[row, i + 1]
        d0, d1 = self.slopes[row, i] * self.step, self.slopes[row, i + 1] * self.step
        c, d = 3.0 * (y1 - y0) - 2.0 * d0 - d1, 2.0 * (y0 - y1) + d0 + d1
        slope = (d0 + r * (2.0 * c + 3.0 * r * d)) * self.scale / self.step
        return np.asarray(y0 + r * (d0 + r * (c + r * d))), np.asarray(slope)

    def rows(self, keep: npt.NDArray[np.intp]) -> Table:
        """The same for a subset of the recordings."""
        return Table(self.start, self.step, self.values[keep], self.slopes[keep], self.scale)


def tabulate(start: float, stop: float, columns: Array, scale: float = 1.0) -> Table:
    """A table from values on an even grid between `start` and `stop`."""
    step = (stop - start) / (columns.shape[1] - 1)
    return Table(start, step, columns, np.asarray(np.gradient(columns, step, axis=1, edge_order=2)), scale)


def identity(count: int) -> Table:
    """Phi(u) = u."""
    return tabulate(-3.0, 3.0, np.tile(np.linspace(-3.0, 3.0, 5), (count, 1)))


@dataclass
class Observed:
    """Residuals from the base model, their covariance, the free linear columns, and Phi of each kind of law."""

    design: Design
    residual: Array
    covariance: Array
    linear: Array
    tables: dict[tuple[str, str], Table] = field(default_factory=dict)
    whiteners: dict[bytes, Array] = field(default_factory=dict)

    def phi(self, acts_on: str, along: str = "") -> Table:
        """Change of y with u for a law on one quantity; tables are built when first asked for."""
        kind = "contact_radius" if acts_on in _SLOPE else acts_on
        if (kind, along) not in self.tables:
            self.tables[kind, along] = _build(self.design, kind, along)
        table = self.tables[kind, along]
        return Table(table.start, table.step, table.values, table.slopes, _SLOPE.get(acts_on, 1.0))


def _build(design: Design, kind: str, along: str) -> Table:
    base = base_state(design)
    r_t, h = design.sensor_radius_mm, design.thickness_mm
    a, e = base.radius_mm[:, None], base.offset_mm[:, None]
    if kind in ("gain", "frequency_response"):
        return identity(design.count)
    if kind == "contact_radius":
        u = np.linspace(-0.6, 0.6, 19)
        values = log_transmission(a * np.exp(u), h, r_t, e)
    elif kind == "thickness":
        u = np.linspace(-0.35, 0.35, 13)
        values = log_transmission(a, h * np.exp(u), r_t, e)
    else:
        u = np.linspace(-1.3 * h, 1.3 * h, 27)
        x, y = design.offset_xy[:, :1], design.offset_xy[:, 1:]
        moved = np.hypot(x + u, y) if along == "x" else np.hypot(x, y + u)
        values = log_transmission(a, h, r_t, moved)
    zero = log_transmission(base.radius_mm, h, r_t, base.offset_mm)
    return tabulate(float(u[0]), float(u[-1]), values - zero[:, None])


def amplitudes(
    design: Design, data: Measurement, response: Complex, companion: Companion | None, truth: State
) -> Observed:
    """Amplitudes of a measurement under a given frequency response, (recordings, lines)."""
    exact = np.abs(data.exact)
    weight = np.abs(response) ** 2 / (data.line_variance * exact**2)
    total = weight.sum(axis=1)
    mean = np.maximum((weight * (data.frf / response).real).sum(axis=1) / total, 1e-6)
    variance = design.noise.gain**2 + data.position_variance + 1.0 / (total * mean**2)
    base = base_state(design)
    level = log_transmission(base.radius_mm, base.thickness_mm, design.sensor_radius_mm, base.offset_mm)
    y, columns = np.log(mean) - data.position_mean - level, [np.ones(design.count)]
    if companion is not None and companion.name not in SPECTRAL:
        value, slope = companion_column(design, companion, truth)
        y, columns = y - value, [*columns, slope]
    observed = Observed(design, np.asarray(y), np.diag(variance), np.stack(columns))
    zero = np.zeros(design.count)
    member = (design.sensor[:, None] == np.arange(len(design.sensor_xy))).astype(np.float64).T
    stiff, thick = observed.phi("modulus")(zero)[1], observed.phi("thickness")(zero)[1]
    nuisance = np.concatenate([0.01 * member, 0.02 * stiff[None], 0.01 * thick[None]])
    observed.covariance = np.asarray(observed.covariance + nuisance.T @ nuisance)
    return observed


def loss_angles(design: Design, data: Measurement, response: Complex) -> Observed:
    """Loss angles of a measurement beyond those of a given frequency response."""
    ratio = data.frf / response
    weight = 1.0 / data.line_variance
    total = weight.sum(axis=1)
    unit = ratio / np.abs(ratio.mean(axis=1, keepdims=True))
    angle = -np.angle((weight * unit).sum(axis=1))
    return Observed(design, np.asarray(angle), np.diag(1.0 / total), np.zeros((0, design.count)))
