"""The shape of a residual that no mechanism describes: on which axis it lies, and which simple form fits it best.

Forms over an axis x: power law (x^n), step (at a level of x), periodic (sine and cosine of one period), drift (linear
in x), over frequency also a peak (a Lorentzian, real and imaginary part free), along a curve a bump (a Lorentzian).
They are compared by the Bayesian information criterion; a form is a description, not an explanation.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from underskin.diagnosis.data.axes import order, preload_before, recording_axes
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import Residuals, residuals, whole_prediction
from underskin.diagnosis.selection.frequency_gp import frequency_bins
from underskin.diagnosis.selection.recording_gp import relative_place_slopes
from underskin.recordings.campaign import Campaign
from underskin.units import Floats

_GRID = 40
_LEAST_IN_ORDER = 8  # recordings
ALONG_CURVES = {"displacement_mm": "mm", "time_s": "s"}
PRELOAD_BEFORE, ORDER = "preload_before", "order"  # axes that are no fields of the campaign
_LOGARITHMIC = (
    "preload_n",
    "indenter_radius_mm",
    "dynamic_force_n",
    "load_cycles",
    "dwell_s",
    "frequency_hz",
    PRELOAD_BEFORE,
)


class FormKind(StrEnum):
    """A simple form of a residual over one axis; `CIRCLING` is a contact that circles about its place."""

    POWER_LAW = "power_law"
    DRIFT = "drift"
    STEP = "step"
    PERIODIC = "periodic"
    PEAK = "peak"
    BUMP = "bump"
    CIRCLING = "circling"


@dataclass(frozen=True)
class ShapeForm:
    """A form, the value `at` which it lies (of periodic ones the period; NaN of none), and its size.

    The size is in percent of the response, of curves in percent of the largest force; of circling contacts it is the
    distance in mm, and the period counts recordings. `axis` is a field of the campaign, `PRELOAD_BEFORE` or `ORDER`;
    `component` 0 or 1 is x or y of an axis of places. `gain` is the gain in information over a constant.
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
    for name, column in _axes(problem.lines.campaign).items():
        for index in range(column.shape[1]):
            component = None if column.shape[1] == 1 else index
            best = _best_form(column[:, index], left.gain[:, None], left.gain_deviation**-2, name)
            forms += [replace(form, component=component) for form in best]
    forms += _circling(problem, explanation, left)
    line, centres = frequency_bins(problem.lines.frequency)
    if len(centres) >= 6:
        total = np.bincount(line, left.line_weight, len(centres)).astype(float)
        parts = [
            np.bincount(line, left.line_weight * part, len(centres)) / total
            for part in (left.line.real, left.line.imag)
        ]
        forms += _best_form(np.log(centres), np.stack(parts, axis=1), total, "frequency_hz")
    return forms


def _axes(campaign: Campaign) -> dict[str, Floats]:
    """The campaign's own, the order, and what the preload had been before."""
    axes = recording_axes(campaign)
    before = preload_before(campaign)
    if before is not None:
        axes[PRELOAD_BEFORE] = before
    return {**axes, ORDER: order(campaign)[:, None]}


def _circling(problem: FittingProblem, explanation: Explanation, left: Residuals) -> list[ShapeForm]:
    """A contact that circles about its place while recordings are made, with the period that fits best."""
    rank = order(problem.lines.campaign)
    slopes = 1e-3 * relative_place_slopes(explanation.best).T  # per mm
    if not np.abs(slopes).max() > 0 or len(rank) < _LEAST_IN_ORDER:
        return []
    root = 1 / left.gain_deviation
    best: list[ShapeForm] = []
    plain = float((((left.gain - np.average(left.gain, weights=root**2)) * root) ** 2).sum())
    for period in 2 * len(rank) / np.arange(1, len(rank)):
        angle = 2 * np.pi * rank / period
        waves = np.column_stack([np.sin(angle), np.cos(angle)])
        basis = np.column_stack([np.ones(len(rank)), slopes[:, :1] * waves, slopes[:, 1:] * waves])
        coefficients = np.linalg.lstsq(basis * root[:, None], left.gain * root, rcond=None)[0]
        square = float((((left.gain - basis @ coefficients) * root) ** 2).sum())
        gain = 0.5 * (plain - square - 5 * np.log(len(rank)))
        if gain > (best[0].gain if best else 0.0):
            size = float(np.hypot(waves @ coefficients[1:3], waves @ coefficients[3:5]).max())
            best = [ShapeForm(FormKind.CIRCLING, float(period), size, gain=gain)]
    return best


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
