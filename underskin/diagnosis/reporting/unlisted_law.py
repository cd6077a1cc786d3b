"""The report's entry for an unlisted law (`unnamed`), and the recordings that would confirm or refute it.

The entry holds the law's expression, parameters, rivals, held-out errors and range.

The confirming recordings alternate between the two values of the axis where the law changes the charge least and most,
all else equal. There the logarithms of the charge differ by d if the law holds, and by 0 if it does not. With n
recordings at each end and the scatter s of one recording, their difference has the standard deviation s √(2/n), and
the two cases are told apart with the probability Φ(d/(2 s √(2/n))).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import ndtr

from underskin.autodiff import Differentiated
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.hypothesis import parameter_slices
from underskin.diagnosis.planning.rig_limits import RigLimits
from underskin.diagnosis.reporting.numbers import SDS_OF_95, parameter_with_interval, rounded
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.unlisted_search import law_of
from underskin.diagnosis.validation import cross_validation
from underskin.findings.formatting import in_percent
from underskin.mechanisms.unlisted.axes import Axis
from underskin.mechanisms.unlisted.expressions import CurveLaw, change_along, expression, wave
from underskin.mechanisms.unlisted.forms import EVERYWHERE
from underskin.mechanisms.unlisted.grammar import FrequencyLaw
from underskin.mechanisms.unlisted.laws import LagLaw, RecordingLaw, UnlistedLaw
from underskin.mechanisms.unlisted.vocabulary import AXES
from underskin.recordings.campaign import FrfConditions, frf_of
from underskin.units import Floats

_RIVALS, _LEAST_RIVAL = 5, 0.01
_AXIS_POINTS = 41  # at which a change along the axis is evaluated
_STATED = 21  # at which a smooth change is stated
_LEVEL = 0.1  # relative change of a phase along the band up to which it is called constant
_STEP = 1e-4  # of fit coordinates, for derivatives
SHOWN_AS_HOURS = ("recorded_at", "time_of_day")


@dataclass(frozen=True)
class LeadingLaw:
    """The unlisted law of the leading explanation, with its parameters in their units."""

    law: UnlistedLaw
    values: Mapping[str, float]
    explanation: Explanation

    @classmethod
    def of(cls, problem: FittingProblem, explanation: Explanation) -> "LeadingLaw | None":
        """The law of an explanation; None where it holds none."""
        law = law_of(problem, explanation)
        if law is None:
            return None
        values = {
            parameter.name: parameter.from_fit(at)
            for parameter, at in zip(law.parameters_stated, explanation.coordinates(law.name), strict=True)
        }
        return cls(law, values, explanation)

    @property
    def as_fitted(self) -> dict[str, Any]:
        """Name and parameters, from which an adopted model is made."""
        return {"law": self.law.name, "parameters": {name: rounded(value, 10) for name, value in self.values.items()}}

    @property
    def form(self) -> str:
        """The form of the law: a peak of negative size is a notch; peaks of a position or lag have no such sign."""
        if self.law.description.form == "peak" and self.values.get("law_change", 0.0) < 0:
            return "notch"
        return self.law.description.form

    @property
    def axis(self) -> Axis | None:
        """The axis of recordings or samples; None for frequency."""
        return self.law.axis if isinstance(self.law, RecordingLaw | LagLaw | CurveLaw) else None

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the measured axis."""
        if self.axis is not None:
            return self.axis.low, self.axis.high
        frequency = self.explanation.best.hypothesis.lines.frequency
        return float(frequency.min()), float(frequency.max())

    def largest(self) -> tuple[float, float, float]:
        """The value of the measured axis where the change is largest, the change there and its standard deviation.

        The change of a position is the distance; over frequency it is the magnitude minus 1, or for laws of the phase
        the phase [rad].
        """
        low, high = self.ends
        x = np.geomspace(low, high, 8 * _AXIS_POINTS) if self.axis is None else _axis_values(self.axis, _AXIS_POINTS)
        sizes = self.change(x, self.values)
        index = int(np.argmax(np.abs(sizes)))
        return float(x[index]), float(sizes[index]), float(np.sqrt(self.variance(x[[index]])[0]))

    def change(self, x: Floats, values: Mapping[str, float] | None = None) -> Floats:
        """The change at values x of the axis, with these parameters or the fitted ones; see `largest`."""
        change = change_along(self.law, self.values if values is None else values, x)
        if change.ndim == 2:
            return np.hypot(*change.T)
        if np.iscomplexobj(change):
            return np.angle(1 + change) if self.is_phase else np.abs(1 + change) - 1
        return np.asarray(change, dtype=float)

    @property
    def is_phase(self) -> bool:
        """Whether it changes the phase only."""
        return isinstance(self.law, FrequencyLaw) and self.law.variant in ("phase", "delay")

    @property
    def is_constant_phase(self) -> bool:
        """Whether it changes the phase only, by nearly the same angle all along the band."""
        ends = self.change(np.array(self.ends)) if self.is_phase else np.zeros(2)
        return bool(np.ptp(ends) < _LEVEL * np.abs(ends).max())

    @property
    def is_constant(self) -> bool:
        """Whether it is the same all along its axis."""
        return isinstance(self.law, RecordingLaw) and self.law.shape.variant == EVERYWHERE

    def variance(self, x: Floats) -> Floats:
        """Variance of the change, from the covariance of the law's parameters."""
        span = parameter_slices(self.explanation.names, self.explanation.best.hypothesis.lines)[self.law.name]
        mean = self.explanation.best.hypothesis.mean_indices
        rows = [mean.index(index) for index in range(span.start, span.stop)]
        covariance = self.explanation.best.covariance[np.ix_(rows, rows)]
        here = self.change(x, self.values)
        slopes = []
        for parameter in self.law.parameters_stated:
            moved = {
                **self.values,
                parameter.name: parameter.from_fit(parameter.to_fit(self.values[parameter.name]) + _STEP),
            }
            slopes.append((self.change(x, moved) - here) / _STEP)
        jacobian = np.array(slopes)
        return np.maximum(np.einsum("px,pq,qx->x", jacobian, covariance, jacobian), 0.0)


def law_document(
    search: Search, problem: FittingProblem, leading: LeadingLaw, groups: Sequence[cross_validation.HeldOut]
) -> dict[str, Any]:
    """The report's `unnamed`: expression, parameters, probability, rivals, held-out errors and range."""
    shares = _shares(search, problem)
    combination = _combination(problem, leading.explanation)
    before, after = cross_validation.total(groups)
    low, high = leading.ends
    return {
        "acts_on": leading.law.description.acts_on,
        "axis": leading.law.description.axis,
        "form": leading.form,
        "expression": expression(leading.law, leading.values),
        "parameters": _parameters(leading),
        "probability": round(shares[combination], 3),
        "rivals": [
            {"acts_on": acts_on, "axis": axis, "form": form, "probability": round(share, 3)}
            for (acts_on, axis, form), share in list(shares.items())[: _RIVALS + 1]
            if (acts_on, axis, form) != combination and share >= _LEAST_RIVAL
        ],
        "heldout_rmse_percent": {"before": rounded(before.rmse_percent), "after": rounded(after.rmse_percent)},
        "range": {_range_name(leading): _range(leading, low, high)},
        **({"course": _change_along_axis(leading)} if leading.form == "free" else {}),
    }


def _change_along_axis(leading: LeadingLaw) -> list[dict[str, Any]]:
    """The change at values of the measured axis with its 95 % interval: relative, of a force in N, of a position the
    distance in mm, over frequency the magnitude minus 1."""
    low, high = leading.ends
    words: tuple[str, ...] = ()
    if leading.axis is None:
        x = np.geomspace(low, high, _STATED)
    else:
        words, x = leading.axis.words, _axis_values(leading.axis, _STATED)
    change, half = leading.change(x), SDS_OF_95 * np.sqrt(leading.variance(x))
    ends = zip(x.tolist(), change.tolist(), (change - half).tolist(), (change + half).tolist(), strict=True)
    return [
        {
            "at": words[round(at)] if words else rounded(at),
            "change": rounded(middle, 3),
            "low": rounded(least, 3),
            "high": rounded(most, 3),
        }
        for at, middle, least, most in ends
    ]


def _axis_values(axis: Axis, most: int) -> Floats:
    """Values at which a change is evaluated: the levels of words or of few values, otherwise an even grid."""
    few = axis.words or len(axis.levels) <= most
    return axis.levels if few else np.linspace(axis.low, axis.high, most)


def _range_name(leading: LeadingLaw) -> str:
    name = leading.law.description.axis
    if name in SHOWN_AS_HOURS:
        return f"{name}_h"
    return f"{name}_over_own" if leading.axis is not None and leading.axis.relative else name


def _range(leading: LeadingLaw, low: float, high: float) -> list[Any]:
    if leading.axis is not None and leading.axis.words:
        return list(leading.axis.words)
    return [rounded(low), rounded(high)]


def _combination(problem: FittingProblem, explanation: Explanation) -> tuple[str, str, str]:
    leading = LeadingLaw.of(problem, explanation)
    assert leading is not None
    return leading.law.description.acts_on, leading.law.description.axis, leading.form


def _shares(search: Search, problem: FittingProblem) -> dict[tuple[str, str, str], float]:
    """Probability of each combination of quantity, axis and form among all unlisted laws, the largest first."""
    weights: dict[tuple[str, str, str], float] = {}
    for explanation in search.laws:
        if search.is_supported(explanation):
            key = _combination(problem, explanation)
            weights[key] = float(np.logaddexp(weights.get(key, -np.inf), search.log_weight(explanation)))
    total = np.logaddexp.reduce(list(weights.values()))
    ranked = sorted(weights.items(), key=lambda item: -item[1])
    return {key: float(np.exp(weight - total)) for key, weight in ranked}


def _parameters(leading: LeadingLaw) -> list[dict[str, Any]]:
    """The fitted parameters with readable names; of a sine the amplitude, start and period."""
    law, explanation = leading.law, leading.explanation
    first = parameter_slices(explanation.names, explanation.best.hypothesis.lines)[law.name].start
    stated = [parameter_with_interval(explanation, first + index) for index in range(len(law.parameters_stated))]
    if isinstance(law, RecordingLaw | LagLaw | CurveLaw):
        if law.shape.form == "periodic" and len(law.amplitudes) == law.shape.count:
            stated = [*_wave(leading, law), *stated[2:]]
        if law.shape.form == "step" and not (law.axis.words or isinstance(law, CurveLaw)):
            stated.append(_edge(law))
    return [{**parameter, "name": parameter["name"].removeprefix("law_")} for parameter in stated]


def _wave(leading: LeadingLaw, law: RecordingLaw | LagLaw | CurveLaw) -> list[dict[str, Any]]:
    amplitudes = [leading.values[name] for name in law.amplitudes]
    size, start = wave(law, leading.values, amplitudes)
    quarter = np.array([start + leading.values["law_period"] / 4])
    half_width = SDS_OF_95 * float(np.sqrt(leading.variance(quarter)[0]))
    amplitude_interval = {
        "value": rounded(size),
        "low": rounded(max(size - half_width, 0.0)),
        "high": rounded(size + half_width),
    }
    turn = half_width / max(size, 1e-12) * leading.values["law_period"] / (2 * np.pi)
    start_interval = {"value": rounded(start), "low": rounded(start - turn), "high": rounded(start + turn)}
    unit = law.parameters_stated[0].unit
    return [
        {"name": "amplitude", "unit": unit, **amplitude_interval},
        {"name": "start", "unit": law.axis.unit, **start_interval},
    ]


def _edge(law: RecordingLaw | LagLaw) -> dict[str, Any]:
    """The position of a step: between two neighbouring levels of the axis."""
    at, levels = float(law.shape.variant), law.axis.levels
    low, high = levels[levels < at].max(), levels[levels > at].min()
    ends = {"value": rounded(at), "low": rounded(float(low)), "high": rounded(float(high))}
    return {"name": "at", "unit": law.axis.unit, **ends}


_MOST = 4  # recordings at each end
_SURE = 0.99
_FIELDS = ("sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n", "dwell_s", "load_cycles")
_NOT_REPEATABLE = ("order", "recorded_at")  # values that no new recording can have
_GIVEN_BY_SKIN = ("x_mm", "y_mm", "sensor")
_HOW = {
    "time_of_day": " Take them on another day.",
    "previous_preload_n": " Come to the preload from each of these.",
}


@dataclass(frozen=True)
class _Ends:
    """The values of the axis where the law gives the least and the most charge, and the difference of ln charge."""

    low: float
    high: float
    difference: float

    @property
    def both(self) -> tuple[float, float]:
        """The lower end first."""
        return self.low, self.high


def confirming(problem: FittingProblem, leading: LeadingLaw) -> dict[str, Any]:
    """The report's `next_experiment`; empty for a law over frequency, words or positions of the skin, or a constant
    one."""
    law = leading.law
    if (
        leading.is_constant
        or not isinstance(law, RecordingLaw)
        or law.axis.words
        or law.axis.relative
        or law.axis.name in _GIVEN_BY_SKIN
    ):
        return {}
    base = _commonest(problem)
    ends = _ends(leading, law, base)
    is_past = law.axis.name in _NOT_REPEATABLE
    templates = [_nearest(problem, law.axis, at) if is_past else base for at in ends.both]
    count, probability = _enough(abs(ends.difference) / max(_scatter(problem, leading, index) for index in templates))
    recordings = [_conditions_of(problem, index) for index in templates]
    if not is_past:
        for recording, at in zip(recordings, ends.both, strict=True):
            recording[law.axis.name] = float(f"{at:.4g}")
    count_text = "one recording" if count == 1 else f"{count} recordings"
    differs = f"{100 * abs(np.expm1(ends.difference)):.2g} %"
    chance = f"with a probability of {in_percent(probability)}"
    if is_past:
        first, second = (problem.collapsed.campaign.recordings[index].id for index in templates)
        statement = (
            f"Repeating {first} and {second} after one another, {count_text} of each in turns, should tell whether it "
            f"is the time, {chance}: if it is, the {differs} are gone by which they differ beyond what the known "
            f"physics says."
        )
    else:
        words = AXES[law.axis.name][0] if law.axis.name in AXES else law.axis.name
        low, high = (f"{at:.4g}{'' if law.axis.unit == '-' else f' {law.axis.unit}'}" for at in ends.both)
        statement = (
            f"{count_text.capitalize()} with {words} at {low} and as many at {high}, in turns and all else equal, "
            f"should tell whether the law holds, {chance}: if it does, the charge differs by {differs} "
            f"beyond what the known physics says."
            f"{_HOW.get(law.axis.name, '')}"
        )
    other_names = [name for name in leading.explanation.names if name != law.name]
    return {
        "recordings": [recording | {"repeats": count} for recording in recordings],
        "separates": [other_names, [*other_names, "unnamed"]],
        "probability_of_deciding": round(probability, 3),
        "without_it": 0.5,
        "minutes": round(2 * count * RigLimits().minutes_per_recording, 1),
        "statement": statement,
    }


def _commonest(problem: FittingProblem) -> int:
    """Index of the first recording of the contact that was recorded most often."""
    keys = [
        (recording.sensor, recording.indenter_radius_mm, recording.preload_n, recording.dynamic_force_n)
        for recording in frf_of(problem.collapsed.campaign)
    ]
    return keys.index(max(keys, key=keys.count))


def _ends(leading: LeadingLaw, law: RecordingLaw, base: int) -> _Ends:
    levels = law.axis.levels
    changes = np.array([_log_factor(leading, law, base, at) for at in levels.tolist()])
    low, high = int(np.argmin(changes)), int(np.argmax(changes))
    low, high = min(low, high), max(low, high)
    return _Ends(float(levels[low]), float(levels[high]), float(changes[high] - changes[low]))


def _log_factor(leading: LeadingLaw, law: RecordingLaw, base: int, at: float) -> float:
    """Logarithm of the law's factor on the charge of a recording, with this value on its axis."""
    design = leading.explanation.best.hypothesis.frf_model.design
    moved = law.on(replace(law.axis, values=dict.fromkeys(design.ids, at), range=leading.ends), law.tables)
    seeds = {name: Differentiated(np.array([[value]]), np.zeros((0, 1, 1))) for name, value in leading.values.items()}
    factor: Floats = np.broadcast_to(moved.factor(design.ids, seeds).value, (1, len(design.ids)))
    return float(np.log(max(float(factor[0, base]), 1e-12)))


def _scatter(problem: FittingProblem, leading: LeadingLaw, base: int) -> float:
    """Relative standard deviation of one recording's charge, from its gain, position and lines."""
    best, collapsed = leading.explanation.best, problem.collapsed
    line = best.levels.level * collapsed.deviation[base] / max(float(np.abs(collapsed.value[base])), 1e-300)
    position = best.levels.position * float(np.hypot(*best.relative_place_slopes[:, base]))
    return float(np.sqrt(best.levels.gain**2 + position**2 + line**2))


def _enough(size: float) -> tuple[int, float]:
    """The number of recordings needed at each end, `_MOST` at most, and the probability that they decide."""
    probabilities = [float(ndtr(0.5 * size * np.sqrt(count / 2))) for count in range(1, _MOST + 1)]
    count = next((number for number, probability in enumerate(probabilities, 1) if probability >= _SURE), _MOST)
    return count, probabilities[count - 1]


def _nearest(problem: FittingProblem, axis: Axis, at: float) -> int:
    """Index of the recording nearest on the axis."""
    values = axis.of([recording.id for recording in problem.collapsed.campaign.recordings])
    return int(np.argmin(np.abs(values - at)))


def _conditions_of(problem: FittingProblem, index: int) -> dict[str, Any]:
    """The conditions of a recording, in lab units."""
    recording: FrfConditions = frf_of(problem.collapsed.campaign)[index]
    fields = {name: getattr(recording, name) for name in _FIELDS}
    return {name: value for name, value in fields.items() if value is not None}
