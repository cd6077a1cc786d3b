"""The shape of what no mechanism describes: on which axis it lies, and which simple form fits it best there.

Forms over an axis x: power law (x^n), step (at a level of x), periodic (sine and cosine of one period), drift (linear
in x), over frequency also a peak (a Lorentzian, real and imaginary part free), along a curve a bump (a Lorentzian).
They are compared by the Bayesian information criterion; what is said is a description, not an explanation.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from underskin.diagnosis.data.axes import WORDS, order, preload_before, recording_axes
from underskin.diagnosis.data.names import in_words
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import Residuals, residuals, whole_prediction
from underskin.diagnosis.selection.frequency_gp import frequency_bins
from underskin.diagnosis.selection.recording_gp import relative_place_slopes
from underskin.diagnosis.validation.cross_validation import HeldOut, in_sample, total
from underskin.formatting import in_digits
from underskin.recordings.campaign import Campaign
from underskin.recordings.finding import Finding
from underskin.units import Floats

_GRID = 40
_LEAST_IN_ORDER = 8  # recordings
_WORTH_TELLING, _LEAST_TOLD = 2.0, 3e-3  # times the noise, and of the largest force
NOISY = 2.0  # times what the lines' own roughness says
_STRUCTURED = 2.0**0.5  # the same, where what is added is as large as the noise
REACHES_NOISE = 1.5  # times the noise floor: an error that noise explains
_ALONG_CURVES = {"displacement_mm": "mm", "time_s": "s"}
_BEFORE = "the preload of the recording before over its own"
_LOGARITHMIC = ("preload_n", "indenter_radius_mm", "dynamic_force_n", "load_cycles", "dwell_s", "frequency_hz", _BEFORE)


def describe(problem: FittingProblem, explanation: Explanation) -> str:
    """One or two sentences; the axis is the one where a form takes away most."""
    beyond = f" beyond {in_words(explanation.names)}" if explanation.names else ""
    gain, text = (_along_curves if problem.lines.curves else _over_axes)(problem, explanation)
    return f"What remains{beyond} {f'looks like {text}' if gain else 'has no simple form over one axis'}."


def worth_telling(problem: FittingProblem, explanation: Explanation, groups: Sequence[HeldOut]) -> list[Finding]:
    """Of curves: what is left beyond the noise, and whether parts that were left out are predicted no better."""
    if problem.lines.smooth is None:
        return []
    found = []
    smooth, noise = _smooth_part(problem, explanation)
    if _is_above_noise(smooth, noise):
        size = f"{100 * smooth:.2g} % of the largest force, {smooth / noise:.0f} times a sample's noise"
        text = f"a smooth part of about {size}, is left that no mechanism here describes"
        found.append(Finding("remainder", "", "force_n", text))
    before, after = total(groups)
    if explanation.names and after.recordings and after.rmse_percent >= before.rmse_percent:
        text = (
            f"what was left out ({', '.join(entry.group for entry in groups)}) is predicted no better with "
            f"{' and '.join(explanation.names)}: {before.rmse_percent:.3g} % before, {after.rmse_percent:.3g} % after; "
            "do not extrapolate with it"
        )
        found.append(Finding("held_out_no_better", "", "force_n", text))
    return found


def contradicts(problem: FittingProblem, null: Explanation) -> bool:
    """Whether the recordings contradict the null hypothesis, however improbable its rivals are: its residual keeps
    structure above the noise. Of curves that is a smooth part, of FRFs lines that scatter about the model more than
    about their neighbours by as much as those do."""
    if problem.lines.smooth is not None:
        return _is_above_noise(*_smooth_part(problem, null))
    return null.best.at.marginal.levels.level > _STRUCTURED


def largest_floor_percent(problem: FittingProblem, null: Explanation, groups: Sequence[HeldOut]) -> float:
    """What noise alone would make of the error, in the recordings and in each group held out, the largest [%]."""
    return max(entry.floor_percent for entry in (in_sample(problem, null), *(entry.before for entry in groups)))


def _smooth_part(problem: FittingProblem, explanation: Explanation) -> tuple[float, float]:
    """Of curves: the size of what is left smoothly, and a sample's noise, both relative to the largest force."""
    lines, levels = problem.lines, explanation.best.at.marginal.levels
    assert lines.smooth is not None
    return levels.smooth, levels.level * float(np.median(lines.deviation / lines.smooth.scale))


def _is_above_noise(smooth: float, noise: float) -> bool:
    return smooth > max(_WORTH_TELLING * noise, _LEAST_TOLD)


def _along_curves(problem: FittingProblem, explanation: Explanation) -> tuple[float, str]:
    """The best form of the residual, relative to each curve's largest force, over displacement and over time."""
    lines = problem.lines
    assert lines.smooth is not None
    relative = (lines.value - whole_prediction(problem, explanation)).real / lines.smooth.scale
    weight = (lines.smooth.scale / lines.deviation) ** 2
    best: tuple[float, str] = (0.0, "")
    for name in ("displacement_mm", "time_s"):
        columns = [getattr(entry, name) for entry in lines.campaign.recordings]
        if all(column is not None for column in columns):
            gain, text = _best_form(np.concatenate(columns), relative[:, None], weight, name)
            best = max(best, (gain, f"{text} of the largest force over {name}"))
    return best


def _over_axes(problem: FittingProblem, explanation: Explanation) -> tuple[float, str]:
    """The best form over the recordings' axes, or over the lines'."""
    levels = explanation.best.at.marginal.levels
    left = residuals(problem, explanation, float(np.clip(levels.gain, 0.005, 0.05)), levels.position)
    best: tuple[float, str] = (0.0, "")
    for name, column in _axes(problem.lines.campaign).items():
        for index in range(column.shape[1]):
            gain, text = _best_form(column[:, index], left.gain[:, None], left.gain_deviation**-2, name)
            words = WORDS.get(name, (name,))[0]
            axis = words if column.shape[1] == 1 else f"{words} ({'xy'[index]})"
            best = max(best, (gain, f"{text} over {axis}"))
    best = max(best, _wandering(problem, explanation, left))
    line, centres = frequency_bins(problem.lines.frequency)
    if len(centres) >= 6:
        total = np.bincount(line, left.line_weight, len(centres)).astype(float)
        parts = [
            np.bincount(line, left.line_weight * part, len(centres)) / total
            for part in (left.line.real, left.line.imag)
        ]
        gain, text = _best_form(np.log(centres), np.stack(parts, axis=1), total, "frequency_hz")
        best = max(best, (gain, f"{text} over frequency"))
    return best


def _axes(campaign: Campaign) -> dict[str, Floats]:
    """The campaign's own, the order, and what the preload had been before."""
    found = recording_axes(campaign)
    before = preload_before(campaign)
    if before is not None:
        found[_BEFORE] = before
    return {**found, "the order of recordings": order(campaign)[:, None]}


def _wandering(problem: FittingProblem, explanation: Explanation, left: Residuals) -> tuple[float, str]:
    """A place that runs round while recordings are made, of the period that fits best."""
    rank = order(problem.lines.campaign)
    slopes = 1e-3 * relative_place_slopes(explanation.best.at).T  # per mm
    if not np.abs(slopes).max() > 0 or len(rank) < _LEAST_IN_ORDER:
        return 0.0, ""
    root = 1 / left.gain_deviation
    best: tuple[float, str] = (0.0, "")
    plain = float((((left.gain - np.average(left.gain, weights=root**2)) * root) ** 2).sum())
    for period in 2 * len(rank) / np.arange(1, len(rank)):
        angle = 2 * np.pi * rank / period
        waves = np.column_stack([np.sin(angle), np.cos(angle)])
        basis = np.column_stack([np.ones(len(rank)), slopes[:, :1] * waves, slopes[:, 1:] * waves])
        found = np.linalg.lstsq(basis * root[:, None], left.gain * root, rcond=None)[0]
        square = float((((left.gain - basis @ found) * root) ** 2).sum())
        gain = 0.5 * (plain - square - 5 * np.log(len(rank)))
        if gain > best[0]:
            size = float(np.hypot(waves @ found[1:3], waves @ found[3:5]).max())
            best = (gain, f"a place that runs round, up to {size:.2g} mm off, once in {period:.3g} recordings")
    return best


def _best_form(x: Floats, values: Floats, weight: Floats, axis: str) -> tuple[float, str]:
    """The form of largest information criterion over a constant, and its words; values (rows, parts)."""
    if np.ptp(x) <= 0:
        return 0.0, ""
    root = np.sqrt(weight)[:, None]

    def misfit(basis: Floats) -> tuple[float, Floats]:
        design = np.column_stack([np.ones(len(x)), basis])
        coefficients = np.linalg.lstsq(design * root, values * root, rcond=None)[0]
        return float((((values - design @ coefficients) * root) ** 2).sum()), coefficients

    plain, _ = misfit(np.zeros((len(x), 0)))
    best = (0.0, "")
    price = np.log(len(x))
    for basis, shapes, words in _forms(x, axis):
        square, coefficients = misfit(basis)
        gain = 0.5 * (plain - square - price * (shapes + basis.shape[1] * values.shape[1]))
        if gain > best[0]:
            size = 100 * float(np.abs(basis @ coefficients[1:]).max() if basis.size else 0.0)
            best = (gain, f"{words}, up to {in_digits(size, 2)} %")
    return best


def _forms(x: Floats, axis: str) -> Iterator[tuple[Floats, int, str]]:
    """Basis functions, the number of shape parameters, and words. Logarithmic axes come as logarithms."""
    logarithmic = axis in _LOGARITHMIC
    yield x[:, None], 0, "a power law" if logarithmic else "a drift"
    levels = np.unique(x)
    for edge in (levels[1:] + levels[:-1])[:: max(1, len(levels) // _GRID)] / 2:
        value = np.exp(edge) if logarithmic else edge
        yield (x > edge).astype(float)[:, None], 1, f"a step at {value:.4g}"
    natural = np.exp(x) if logarithmic else x
    if len(levels) >= 6:
        for period in np.ptp(natural) / np.linspace(0.75, min(8.0, len(levels) / 3), _GRID):
            angle = 2 * np.pi * natural / period
            yield np.column_stack([np.sin(angle), np.cos(angle)]), 1, f"a periodic change of period {period:.3g}"
    if axis == "frequency_hz":
        yield from _peaks(x)
    if axis in _ALONG_CURVES:
        yield from _bumps(x, _ALONG_CURVES[axis])


def _bumps(x: Floats, unit: str) -> Iterator[tuple[Floats, int, str]]:
    for centre in np.linspace(x.min(), x.max(), _GRID):
        for width in (0.03, 0.1, 0.3):
            bell = 1 / (1 + ((x - centre) / (width * np.ptp(x))) ** 2)
            yield bell[:, None], 2, f"a bump at {centre:.3g} {unit}"


def _peaks(x: Floats) -> Iterator[tuple[Floats, int, str]]:
    for centre in np.linspace(x.min(), x.max(), 2 * _GRID):
        for width in (0.05, 0.1, 0.2, 0.4):
            if width < 0.5 * np.ptp(x):
                offset = (x - centre) / width
                bell = 1 / (1 + offset**2)
                yield np.column_stack([bell, offset * bell]), 2, f"a peak or notch at {np.exp(centre):.3g} Hz"
