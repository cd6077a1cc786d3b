"""The shapes that a law may have along an axis, as bases b_k(x).

A law turns an axis into u(x) = link(sum_k c_k b_k(x)), which is added to the logarithm of what it acts on (to a
position in mm). With link `relative` the quantity is multiplied by 1 + sum c_k b_k, so that u = ln(1 + sum c_k b_k);
with `direct`, and for positions and angles, u is the sum itself. t = (x - x_min)/(x_max - x_min), of ln x for axes
that span decades.

=========== ========= ==================================================================
form        link      b
=========== ========= ==================================================================
linear      relative  (x - x_min)/(x_max - x_min)
power       direct    ln(x/x_ref), x_ref the geometric mean: quantity proportional to x^c
exponential direct    (x - x_min)/(x_max - x_min): quantity proportional to e^(c b)
saturating  relative  1 - exp(-(x - x_min)/tau)
threshold   relative  max(0, t - t_c) or max(0, t_c - t)
step        relative  1 beyond x_c; for words: 1 for one of them
periodic    relative  sin(2 pi x/P), cos(2 pi x/P)
peak        relative  exp(-(t - t_c)^2/(2 w^2)); with c < 0 it is a notch
free        relative  a value for each level, or a cubic spline of t with 5 knots
=========== ========= ==================================================================

A missing value (the preload before the first recording) counts as the axis's least value.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from rig.unlisted.design import Column

Array = npt.NDArray[np.float64]

TIMES = ("recorded_at", "order")
FREE_KNOTS = 5
MOST_LEVELS = 6
MULTIPLICATIVE = ("power", "exponential")
"""Forms that mean something only where a law multiplies."""
FORMS = ("linear", "power", "exponential", "saturating", "threshold", "step", "periodic", "peak", "free")


@dataclass(frozen=True)
class Shape:
    """One form with its shape parameters fixed; `basis` is (columns, recordings)."""

    form: str
    parameters: tuple[float, ...]
    basis: Array
    direct: bool = False


def filled(column: Column) -> Array:
    """The axis with missing values filled in."""
    return np.asarray(np.where(np.isnan(column.values), np.nanmin(column.values), column.values))


def unit(column: Column, x: Array | float) -> Array:
    """t of the module's table."""
    at = filled(column)
    low, high = float(at.min()), float(at.max())
    if column.logarithmic:
        return np.asarray(np.log(np.asarray(x) / low) / np.log(high / low))
    return np.asarray((np.asarray(x) - low) / (high - low))


def from_unit(column: Column, t: float) -> float:
    """The inverse of `unit`."""
    at = filled(column)
    low, high = float(at.min()), float(at.max())
    return float(low * (high / low) ** t) if column.logarithmic else low + t * (high - low)


def shape(form: str, column: Column, parameters: tuple[float, ...] = ()) -> Shape:
    """A form on an axis; `parameters` are tau, (t_c, side), x_c, P, (t_c, w) or nothing, as the form asks."""
    x = filled(column)
    low, span = float(x.min()), float(np.ptp(x))
    p = parameters
    if form == "linear":
        return Shape(form, p, ((x - low) / span)[None])
    if form == "power":
        return Shape(form, p, np.log(x / np.exp(np.log(x).mean()))[None], direct=True)
    if form == "exponential":
        return Shape(form, p, ((x - low) / span)[None], direct=True)
    if form == "saturating":
        return Shape(form, p, (1.0 - np.exp(-(x - low) / p[0]))[None])
    if form == "threshold":
        return Shape(form, p, np.maximum(0.0, p[1] * (unit(column, x) - p[0]))[None])
    if form == "step":
        return Shape(form, p, ((x == p[0]) if column.words else (x > p[0])).astype(np.float64)[None])
    if form == "periodic":
        return Shape(form, p, np.stack([np.sin(2.0 * np.pi * x / p[0]), np.cos(2.0 * np.pi * x / p[0])]))
    if form == "peak":
        return Shape(form, p, np.exp(-0.5 * ((unit(column, x) - p[0]) / p[1]) ** 2)[None])
    if form == "free":
        return Shape(form, p, _free(column, x))
    raise ValueError(f"no form {form!r}")


def _free(column: Column, x: Array) -> Array:
    levels = np.unique(x)
    if column.words or levels.size <= MOST_LEVELS:
        return np.asarray((x[None, :] == levels[1:, None]).astype(np.float64))
    knots = np.linspace(0.0, 1.0, FREE_KNOTS)
    return np.asarray([CubicSpline(knots, row, bc_type="natural")(unit(column, x)) for row in np.eye(FREE_KNOTS)[1:]])


def possible(name: str, column: Column) -> tuple[str, ...]:
    """Forms that can be distinguished on an axis, by its kind and its number of levels."""
    levels = np.unique(filled(column))
    if column.words:
        return ("step", "free") if levels.size > 2 else ("step",)
    if name == "time_of_day":
        return ("linear", "threshold", "step", "periodic", "peak", "free")
    forms = ["linear", "exponential", "step"]
    if levels.size > 2:
        forms += ["saturating", "threshold", "peak"]
    if column.logarithmic:
        forms += ["power"]
    if levels.size > 12 and not column.logarithmic:
        forms += ["periodic"]
    if levels.size > 3:
        forms += ["free"]
    return tuple(forms)


def candidates(name: str, column: Column) -> list[Shape]:
    """Every form on an axis over a grid of its shape parameters."""
    x = filled(column)
    levels = np.unique(x)
    low, span = float(levels[0]), float(np.ptp(levels))
    shapes: list[Shape] = []
    for form in possible(name, column):
        if form == "saturating":
            least = max(float(levels[1] - low), 0.02 * span)
            grid: list[tuple[float, ...]] = [(tau,) for tau in np.geomspace(least, span, 8)]
        elif form == "threshold":
            places = np.linspace(0.1, 0.9, 9)
            grid = [(t, 1.0) for t in places] + [(t, -1.0) for t in places]
        elif form == "step" and column.words:
            grid = [(float(v),) for v in levels]
        elif form == "step":
            middle = 0.5 * (levels[1:] + levels[:-1])
            grid = [(float(v),) for v in middle[:: max(1, middle.size // 32)]]
        elif form == "periodic":
            grid = [(period,) for period in periods(name, column)]
        elif form == "peak":
            grid = [(t, w) for t in np.linspace(0.0, 1.0, 13) for w in (0.06, 0.12, 0.25)]
        else:
            grid = [()]
        shapes += [shape(form, column, p) for p in grid]
    return shapes


def periods(name: str, column: Column) -> list[float]:
    """Periods from about the whole axis down to four recordings, in equal steps of frequency."""
    if name == "time_of_day":
        return [24.0, 12.0]
    x = np.unique(filled(column))
    span = float(np.ptp(x))
    most = min(x.size / 4.0, 16.0)
    daily = [24.0] if name == "recorded_at" and span > 24.0 else []
    return daily + [span / n for n in np.arange(1.0, most, 0.25)]


def draw_parameters(rng: np.random.Generator, form: str, name: str, column: Column) -> tuple[float, ...]:
    """Shape parameters of a hidden law, anywhere between the points of the grid of `candidates`."""
    x = filled(column)
    levels = np.unique(x)
    span = float(np.ptp(levels))
    if form == "saturating":
        least = max(float(levels[1] - levels[0]), 0.06 * span)
        return (float(np.exp(rng.uniform(np.log(least), np.log(0.6 * span)))),)
    if form == "threshold":
        return (float(rng.uniform(0.3, 0.7)), float(rng.choice([-1.0, 1.0])))
    if form == "step" and column.words:
        return (float(rng.choice(levels)),)
    if form == "step":
        inner = np.quantile(x, [0.2, 0.8])
        middle = 0.5 * (levels[1:] + levels[:-1])
        usable = middle[(middle > inner[0]) & (middle < inner[1])]
        return (float(rng.choice(usable if usable.size else middle)),)
    if form == "periodic":
        choices = [p for p in periods(name, column) if p <= span / 1.5] or [24.0]
        return (float(rng.choice(choices)) * (1.0 if name == "time_of_day" else float(rng.uniform(0.95, 1.05))),)
    if form == "peak":
        return (float(rng.uniform(0.15, 0.85)), float(rng.uniform(0.08, 0.25)))
    return ()


def combine(form: Shape, coefficients: Array, relative: bool = True) -> Array:
    """u(x) for one set of coefficients; `relative=False` for positions, which are added."""
    total = coefficients @ form.basis
    return np.asarray(total if form.direct or not relative else np.log(np.maximum(1.0 + total, 0.05)))
