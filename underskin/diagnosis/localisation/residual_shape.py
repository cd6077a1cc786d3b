"""The shape of a residual that no mechanism describes: on which axis it lies, and which simple form fits it best.

Forms over an axis x: power law (x^n), step (at a level of x), periodic (sine and cosine of one period), drift (linear
in x), over frequency also a peak (a Lorentzian, real and imaginary part free), along a curve a bump (a Lorentzian).
They are compared by the Bayesian information criterion; a form is a description, not an explanation.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from underskin.diagnosis.data.axes import recording_axes
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import residuals, whole_prediction
from underskin.diagnosis.selection.frequency_gp import frequency_bins
from underskin.units import Floats

_GRID = 40
ALONG_CURVES = {"displacement_mm": ("the displacement", "mm"), "time_s": ("time", "s")}  # in words, and the unit
_LOGARITHMIC = (
    "preload_n",
    "indenter_radius_mm",
    "dynamic_force_n",
    "load_cycles",
    "dwell_s",
    "frequency_hz",
)


class FormKind(StrEnum):
    """A simple form of a residual over one axis."""

    POWER_LAW = "power_law"
    DRIFT = "drift"
    STEP = "step"
    PERIODIC = "periodic"
    PEAK = "peak"
    BUMP = "bump"


@dataclass(frozen=True)
class ShapeForm:
    """A form, the value `at` which it lies (of periodic ones the period; NaN of none), and its size.

    The size is in percent of the response, of curves in percent of the largest force. `axis` is a field of the
    campaign; `component` 0 or 1 is x or y of an axis of places. `gain` is the gain in information over a constant.
    """

    kind: FormKind
    at: float
    size: float
    axis: str = ""
    component: int | None = None
    gain: float = 0.0


@dataclass(frozen=True)
class Shape:
    """The best form of what remains beyond some mechanisms; None where no simple form fits."""

    beyond: tuple[str, ...]
    form: ShapeForm | None
    of_curves: bool


def describe(problem: FittingProblem, explanation: Explanation) -> Shape:
    """The form on the axis where it takes away most."""
    forms = (_along_curves if problem.lines.curves else _over_axes)(problem, explanation)
    best = max(forms, key=lambda form: form.gain, default=None)
    return Shape(explanation.names, best, problem.lines.curves)


def _along_curves(problem: FittingProblem, explanation: Explanation) -> list[ShapeForm]:
    """The best forms of the residual, relative to each curve's largest force, over displacement and over time."""
    lines = problem.lines
    assert lines.smooth is not None
    relative = (lines.value - whole_prediction(problem, explanation)).real / lines.smooth.scale
    weight = (lines.smooth.scale / lines.deviation) ** 2
    forms = []
    for name in ALONG_CURVES:
        columns = [getattr(entry, name) for entry in lines.campaign.recordings]
        if all(column is not None for column in columns):
            forms += _best_form(np.concatenate(columns), relative[:, None], weight, name)
    return forms


def _over_axes(problem: FittingProblem, explanation: Explanation) -> list[ShapeForm]:
    """The best forms over each of the recordings' axes, and over the lines'."""
    levels = explanation.best.levels
    left = residuals(problem, explanation, float(np.clip(levels.gain, 0.005, 0.05)), levels.position)
    forms: list[ShapeForm] = []
    for name, column in recording_axes(problem.lines.campaign).items():
        for index in range(column.shape[1]):
            component = None if column.shape[1] == 1 else index
            best = _best_form(column[:, index], left.gain[:, None], left.gain_deviation**-2, name)
            forms += [replace(form, component=component) for form in best]
    line, centres = frequency_bins(problem.lines.frequency)
    if len(centres) >= 6:
        total = np.bincount(line, left.line_weight, len(centres)).astype(float)
        parts = [
            np.bincount(line, left.line_weight * part, len(centres)) / total
            for part in (left.line.real, left.line.imag)
        ]
        forms += _best_form(np.log(centres), np.stack(parts, axis=1), total, "frequency_hz")
    return forms


def _best_form(x: Floats, values: Floats, weight: Floats, axis: str) -> list[ShapeForm]:
    """The form of largest information criterion, where one beats a constant; values (rows, parts)."""
    if np.ptp(x) <= 0:
        return []
    root = np.sqrt(weight)[:, None]

    def misfit(basis: Floats) -> tuple[float, Floats]:
        design = np.column_stack([np.ones(len(x)), basis])
        coefficients = np.linalg.lstsq(design * root, values * root, rcond=None)[0]
        return float((((values - design @ coefficients) * root) ** 2).sum()), coefficients

    plain, _ = misfit(np.zeros((len(x), 0)))
    best: list[ShapeForm] = []
    price = np.log(len(x))
    for basis, shapes, kind, at in _forms(x, axis):
        square, coefficients = misfit(basis)
        gain = 0.5 * (plain - square - price * (shapes + basis.shape[1] * values.shape[1]))
        if gain > (best[0].gain if best else 0.0):
            size = 100 * float(np.abs(basis @ coefficients[1:]).max() if basis.size else 0.0)
            best = [ShapeForm(kind, at, size, axis, gain=float(gain))]
    return best


_Candidate = tuple[Floats, int, FormKind, float]


def _forms(x: Floats, axis: str) -> Iterator[_Candidate]:
    """Basis functions, the number of shape parameters, the form and where it lies. Logarithmic axes come as
    logarithms."""
    logarithmic = axis in _LOGARITHMIC
    yield x[:, None], 0, FormKind.POWER_LAW if logarithmic else FormKind.DRIFT, np.nan
    levels = np.unique(x)
    for edge in (levels[1:] + levels[:-1])[:: max(1, len(levels) // _GRID)] / 2:
        yield (x > edge).astype(float)[:, None], 1, FormKind.STEP, float(np.exp(edge) if logarithmic else edge)
    natural = np.exp(x) if logarithmic else x
    if len(levels) >= 6:
        for period in np.ptp(natural) / np.linspace(0.75, min(8.0, len(levels) / 3), _GRID):
            angle = 2 * np.pi * natural / period
            yield np.column_stack([np.sin(angle), np.cos(angle)]), 1, FormKind.PERIODIC, float(period)
    if axis == "frequency_hz":
        yield from _peaks(x)
    if axis in ALONG_CURVES:
        yield from _bumps(x)


def _bumps(x: Floats) -> Iterator[_Candidate]:
    for centre in np.linspace(x.min(), x.max(), _GRID):
        for width in (0.03, 0.1, 0.3):
            lorentzian = 1 / (1 + ((x - centre) / (width * np.ptp(x))) ** 2)
            yield lorentzian[:, None], 2, FormKind.BUMP, float(centre)


def _peaks(x: Floats) -> Iterator[_Candidate]:
    for centre in np.linspace(x.min(), x.max(), 2 * _GRID):
        for width in (0.05, 0.1, 0.2, 0.4):
            if width < 0.5 * np.ptp(x):
                offset = (x - centre) / width
                lorentzian = 1 / (1 + offset**2)
                basis = np.column_stack([lorentzian, offset * lorentzian])
                yield basis, 2, FormKind.PEAK, float(np.exp(centre))
