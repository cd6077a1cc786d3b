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
from underskin.diagnosis.planning.rig_limits import RigLimits
from underskin.diagnosis.reporting.numbers import (
    law_shares,
    parameters_of,
    rounded,
    with_ends,
)
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.unlisted_search import law_of
from underskin.diagnosis.validation import cross_validation
from underskin.findings.formatting import in_percent
from underskin.inversion.mixed_model import SDS_OF_95
from underskin.mechanisms.unlisted.expressions import CurveLaw, change_along, expression, wave
from underskin.mechanisms.unlisted.forms import EVERYWHERE, Axis
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
    def combination(self) -> tuple[str, str, str]:
        """Quantity, axis and form."""
        return self.law.description.acts_on, self.law.description.axis, self.form

    @property
    def other_names(self) -> tuple[str, ...]:
        """The mechanisms beside it."""
        return tuple(name for name in self.explanation.names if name != self.law.name)

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
    def is_outside_band(self) -> bool:
        """Whether it leaves the magnitude over most of the band unchanged: a peak, a notch, or a change of phase over
        frequency."""
        return self.law.description.axis == "frequency_hz" and (self.is_phase or self.law.description.form == "peak")

    @property
    def is_constant(self) -> bool:
        """Whether it is the same all along its axis."""
        return isinstance(self.law, RecordingLaw) and self.law.shape.variant == EVERYWHERE

    def variance(self, x: Floats) -> Floats:
        """Variance of the change, from the covariance of the law's parameters."""
        span = self.explanation.spans[self.law.name]
        here = self.change(x)
        slopes = []
        for parameter in self.law.parameters_stated:
            at = parameter.to_fit(self.values[parameter.name]) + _STEP
            slopes.append((self.change(x, {**self.values, parameter.name: parameter.from_fit(at)}) - here) / _STEP)
        covariance = self.explanation.best.covariance_of(range(span.start, span.stop))
        return np.maximum(np.einsum("px,pq,qx->x", np.array(slopes), covariance, np.array(slopes)), 0.0)


def law_document(
    search: Search, problem: FittingProblem, leading: LeadingLaw, groups: Sequence[cross_validation.HeldOut]
) -> dict[str, Any]:
    """The report's `unnamed`: expression, parameters, probability, rivals, held-out errors and range."""
    shares = _shares(search, problem)
    before, after = cross_validation.total(groups)
    acts_on, axis, form = leading.combination
    is_relative = leading.axis is not None and leading.axis.relative
    suffix = "_h" if axis in SHOWN_AS_HOURS else "_over_own" if is_relative else ""
    words = () if leading.axis is None else leading.axis.words
    return {
        "acts_on": acts_on,
        "axis": axis,
        "form": form,
        "expression": expression(leading.law, leading.values),
        "parameters": _parameters(leading),
        "probability": round(shares[leading.combination], 3),
        "rivals": [
            {"acts_on": acts_on, "axis": axis, "form": form, "probability": round(share, 3)}
            for (acts_on, axis, form), share in list(shares.items())[: _RIVALS + 1]
            if (acts_on, axis, form) != leading.combination and share >= _LEAST_RIVAL
        ],
        "heldout_rmse_percent": {"before": rounded(before.rmse_percent), "after": rounded(after.rmse_percent)},
        "range": {axis + suffix: list(words) or [rounded(end) for end in leading.ends]},
        **({"course": _change_along_axis(leading)} if form == "free" else {}),
    }


def _change_along_axis(leading: LeadingLaw) -> list[dict[str, Any]]:
    """The change at values of the measured axis with its 95 % interval: relative, of a force in N, of a position the
    distance in mm, over frequency the magnitude minus 1."""
    words = () if leading.axis is None else leading.axis.words
    x = np.geomspace(*leading.ends, _STATED) if leading.axis is None else _axis_values(leading.axis, _STATED)
    change, half = leading.change(x), SDS_OF_95 * np.sqrt(leading.variance(x))
    return [
        {
            "at": words[round(at)] if words else rounded(at),
            "change": rounded(middle, 3),
            "low": rounded(middle - half_width, 3),
            "high": rounded(middle + half_width, 3),
        }
        for at, middle, half_width in zip(x.tolist(), change.tolist(), half.tolist(), strict=True)
    ]


def _axis_values(axis: Axis, most: int) -> Floats:
    """Values at which a change is evaluated: the levels of words or of few values, otherwise an even grid."""
    few = axis.words or len(axis.levels) <= most
    return axis.levels if few else np.linspace(axis.low, axis.high, most)


def _shares(search: Search, problem: FittingProblem) -> dict[tuple[str, str, str], float]:
    """Probability of each combination of quantity, axis and form among all unlisted laws, the largest first."""
    shares: dict[tuple[str, str, str], float] = {}
    for explanation, share in law_shares(search):
        law = LeadingLaw.of(problem, explanation)
        assert law is not None
        shares[law.combination] = shares.get(law.combination, 0.0) + share
    return dict(sorted(shares.items(), key=lambda item: -item[1]))


def _parameters(leading: LeadingLaw) -> list[dict[str, Any]]:
    """The fitted parameters with readable names; of a sine the amplitude, start and period; of a step its position,
    between two neighbouring levels of the axis."""
    law = leading.law
    stated = parameters_of(leading.explanation, law.name)
    if isinstance(law, RecordingLaw | LagLaw | CurveLaw):
        if law.shape.form == "periodic" and len(law.amplitudes) == law.shape.count:
            stated = [*_wave(leading, law), *stated[2:]]
        if law.shape.form == "step" and not (law.axis.words or isinstance(law, CurveLaw)):
            at, levels = float(law.shape.variant), law.axis.levels
            ends = with_ends(at, levels[levels < at].max(), levels[levels > at].min())
            stated.append({"name": "at", "unit": law.axis.unit, **ends})
    return [{**parameter, "name": parameter["name"].removeprefix("law_")} for parameter in stated]


def _wave(leading: LeadingLaw, law: RecordingLaw | LagLaw | CurveLaw) -> list[dict[str, Any]]:
    size, start = wave(law, leading.values, [leading.values[name] for name in law.amplitudes])
    period = leading.values["law_period"]
    half_width = SDS_OF_95 * float(np.sqrt(leading.variance(np.array([start + period / 4]))[0]))
    turn = half_width / max(size, 1e-12) * period / (2 * np.pi)
    amplitude = with_ends(size, max(size - half_width, 0.0), size + half_width)
    return [
        {"name": "amplitude", "unit": law.parameters_stated[0].unit, **amplitude},
        {"name": "start", "unit": law.axis.unit, **with_ends(start, start - turn, start + turn)},
    ]


_MOST = 4  # recordings at each end
_SURE = 0.99
_FIELDS = ("sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n", "dwell_s", "load_cycles")
_NOT_REPEATABLE = ("order", "recorded_at")  # values that no new recording can have
_GIVEN_BY_SKIN = ("x_mm", "y_mm", "sensor")
_HOW = {
    "time_of_day": " Take them on another day.",
    "previous_preload_n": " Come to the preload from each of these.",
}


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
    recordings, axis = frf_of(problem.collapsed.campaign), law.axis
    contacts = [(one.sensor, one.indenter_radius_mm, one.preload_n, one.dynamic_force_n) for one in recordings]
    commonest = contacts.index(max(contacts, key=contacts.count))
    # The values of the axis where the law gives the least and the most charge, the lower one first
    changes = np.array([_log_factor(leading, law, commonest, at) for at in axis.levels.tolist()])
    first, last = sorted((int(np.argmin(changes)), int(np.argmax(changes))))
    ends = axis.levels[[first, last]]
    difference = float(changes[last] - changes[first])
    is_past = axis.name in _NOT_REPEATABLE
    values = axis.of([recording.id for recording in recordings])
    templates = [int(np.argmin(np.abs(values - at))) if is_past else commonest for at in ends]
    size = abs(difference) / max(_scatter(problem, leading, index) for index in templates)
    probabilities = {count: float(ndtr(0.5 * size * np.sqrt(count / 2))) for count in range(1, _MOST + 1)}
    count = next((number for number, probability in probabilities.items() if probability >= _SURE), _MOST)
    count_text = "one recording" if count == 1 else f"{count} recordings"
    differs = f"{100 * abs(np.expm1(difference)):.2g} %"
    chance = f"with a probability of {in_percent(probabilities[count])}"
    planned = [_conditions_of(recordings[index]) for index in templates]
    if is_past:
        first_id, second_id = (recordings[index].id for index in templates)
        statement = (
            f"Repeating {first_id} and {second_id} after one another, {count_text} of each in turns, should tell "
            f"whether it is the time, {chance}: if it is, the {differs} are gone by which they differ beyond what the "
            "known physics says."
        )
    else:
        for recording, at in zip(planned, ends, strict=True):
            recording[axis.name] = float(f"{at:.4g}")
        words = AXES[axis.name][0] if axis.name in AXES else axis.name
        low, high = (f"{at:.4g}{'' if axis.unit == '-' else f' {axis.unit}'}" for at in ends)
        statement = (
            f"{count_text.capitalize()} with {words} at {low} and as many at {high}, in turns and all else equal, "
            f"should tell whether the law holds, {chance}: if it does, the charge differs by {differs} "
            f"beyond what the known physics says.{_HOW.get(axis.name, '')}"
        )
    other_names = list(leading.other_names)
    return {
        "recordings": [recording | {"repeats": count} for recording in planned],
        "separates": [other_names, [*other_names, "unnamed"]],
        "probability_of_deciding": round(probabilities[count], 3),
        "without_it": 0.5,
        "minutes": round(2 * count * RigLimits().minutes_per_recording, 1),
        "statement": statement,
    }


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
    return float(np.sqrt(best.levels.gain**2 + best.position_variance(best.levels.position)[base] + line**2))


def _conditions_of(recording: FrfConditions) -> dict[str, Any]:
    """The conditions of a recording, in lab units."""
    fields = {name: getattr(recording, name) for name in _FIELDS}
    return {name: value for name, value in fields.items() if value is not None}
