"""A law that nobody listed, and the measurement that would confirm it.

The report's `unnamed`: a law that nobody listed, its numbers, its rivals, what it is worth, and where it holds.

The recordings that would best confirm or refute a law that nobody listed, as the report's `next_experiment`.

They are taken in turns at the two ends between which the law changes the charge most, all else equal. There the
logarithm of the charge differs by d if the law holds, and by nothing if it does not. n recordings at each end leave it
uncertain by s √(2/n), s the scatter of one recording, and tell the two apart with the probability Φ(d/(2 s √(2/n))).
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
from underskin.diagnosis.reporting.numbers import SDS_OF_95, parameter, rounded
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.unlisted_search import law_of
from underskin.diagnosis.validation import cross_validation
from underskin.findings.formatting import in_percent
from underskin.mechanisms.unlisted.axes import Axis
from underskin.mechanisms.unlisted.expressions import CurveLaw, course, expression, wave
from underskin.mechanisms.unlisted.forms import EVERYWHERE
from underskin.mechanisms.unlisted.grammar import FrequencyLaw
from underskin.mechanisms.unlisted.laws import LagLaw, RecordingLaw, UnlistedLaw
from underskin.mechanisms.unlisted.vocabulary import AXES
from underskin.recordings.campaign import FrfConditions, frf_of
from underskin.units import Floats

_RIVALS, _LEAST_RIVAL = 5, 0.01
_PLACES = 41  # along the axis, at which a course is looked at
_STATED = 21  # of these, at which a smooth one is stated
_LEVEL = 0.1  # of a phase, that it may change along the band and still be called constant
_STEP = 1e-4  # of fit coordinates, for a course's band
SHOWN_AS_HOURS = ("recorded_at", "time_of_day")


@dataclass(frozen=True)
class LeadingLaw:
    """The law of an explanation that leads, its parameters in their units, and the quadratic around them."""

    law: UnlistedLaw
    values: Mapping[str, float]
    explanation: Explanation

    @classmethod
    def of(cls, problem: FittingProblem, explanation: Explanation) -> "LeadingLaw | None":
        """None where the explanation holds no law."""
        law = law_of(problem, explanation)
        if law is None:
            return None
        values = {
            entry.name: entry.from_fit(at)
            for entry, at in zip(law.parameters_bound, explanation.own(law.name), strict=True)
        }
        return cls(law, values, explanation)

    @property
    def as_fitted(self) -> dict[str, Any]:
        """What an adopted model is made of."""
        return {"law": self.law.name, "parameters": {name: rounded(value, 10) for name, value in self.values.items()}}

    @property
    def form(self) -> str:
        """A peak of negative size is a notch; that of a place or of a lag has a direction and no such sign."""
        if self.law.description.form == "peak" and self.values.get("law_change", 0.0) < 0:
            return "notch"
        return self.law.description.form

    @property
    def axis(self) -> Axis | None:
        """That of recordings, or of samples; None of frequency."""
        return self.law.axis if isinstance(self.law, RecordingLaw | LagLaw | CurveLaw) else None

    @property
    def ends(self) -> tuple[float, float]:
        """Of the axis, as measured."""
        if self.axis is not None:
            return self.axis.low, self.axis.high
        frequency = self.explanation.best.hypothesis.lines.frequency
        return float(frequency.min()), float(frequency.max())

    def largest(self) -> tuple[float, float, float]:
        """Where along the measured axis the change is largest, the change there and its standard deviation.

        Of a place it is the distance, over frequency the magnitude less 1, or where that hardly changes the phase.
        """
        low, high = self.ends
        x = np.geomspace(low, high, 8 * _PLACES) if self.axis is None else _places(self.axis, _PLACES)
        sizes = self.change(x, self.values)
        place = int(np.argmax(np.abs(sizes)))
        return float(x[place]), float(sizes[place]), float(np.sqrt(self.variance(x[[place]])[0]))

    def change(self, x: Floats, values: Mapping[str, float] | None = None) -> Floats:
        """At values x of the axis, with these parameters or as fitted; see `largest`."""
        change = course(self.law, self.values if values is None else values, x)
        if change.ndim == 2:
            return np.hypot(*change.T)
        if np.iscomplexobj(change):
            return np.angle(1 + change) if self.is_phase else np.abs(1 + change) - 1
        return np.asarray(change, dtype=float)

    @property
    def is_phase(self) -> bool:
        """Whether it turns the phase alone."""
        return isinstance(self.law, FrequencyLaw) and self.law.variant in ("phase", "delay")

    @property
    def is_constant_phase(self) -> bool:
        """Whether it turns the phase alone, by nearly the same angle all along the band."""
        ends = self.change(np.array(self.ends)) if self.is_phase else np.zeros(2)
        return bool(np.ptp(ends) < _LEVEL * np.abs(ends).max())

    @property
    def is_constant(self) -> bool:
        """Whether it is the same along all of its axis."""
        return isinstance(self.law, RecordingLaw) and self.law.shape.variant == EVERYWHERE

    def variance(self, x: Floats) -> Floats:
        """Of the change, from the quadratic of the law's own parameters."""
        places = parameter_slices(self.explanation.names, self.explanation.best.hypothesis.lines)[self.law.name]
        mean = self.explanation.best.hypothesis.mean_indices
        rows = [mean.index(place) for place in range(places.start, places.stop)]
        covariance = self.explanation.best.covariance[np.ix_(rows, rows)]
        here = self.change(x, self.values)
        slopes = []
        for entry in self.law.parameters_bound:
            moved = {**self.values, entry.name: entry.from_fit(entry.to_fit(self.values[entry.name]) + _STEP)}
            slopes.append((self.change(x, moved) - here) / _STEP)
        jacobian = np.array(slopes)
        return np.maximum(np.einsum("px,pq,qx->x", jacobian, covariance, jacobian), 0.0)


def unnamed(
    search: Search, problem: FittingProblem, leading: LeadingLaw, groups: Sequence[cross_validation.HeldOut]
) -> dict[str, Any]:
    """The document."""
    shares = _shares(search, problem)
    own = _combination(problem, leading.explanation)
    before, after = cross_validation.total(groups)
    low, high = leading.ends
    return {
        "acts_on": leading.law.description.acts_on,
        "axis": leading.law.description.axis,
        "form": leading.form,
        "expression": expression(leading.law, leading.values),
        "parameters": _parameters(leading),
        "probability": round(shares[own], 3),
        "rivals": [
            {"acts_on": acts_on, "axis": axis, "form": form, "probability": round(share, 3)}
            for (acts_on, axis, form), share in list(shares.items())[: _RIVALS + 1]
            if (acts_on, axis, form) != own and share >= _LEAST_RIVAL
        ],
        "heldout_rmse_percent": {"before": rounded(before.rmse_percent), "after": rounded(after.rmse_percent)},
        "range": {_range_name(leading): _range(leading, low, high)},
        **({"course": _course(leading)} if leading.form == "free" else {}),
    }


def _course(leading: LeadingLaw) -> list[dict[str, Any]]:
    """Of a smooth course, or of words, the change at places along the measured axis with its 95 % interval: relative,
    of a force in N, of a place the distance in mm, over frequency the magnitude less 1."""
    low, high = leading.ends
    words: tuple[str, ...] = ()
    if leading.axis is None:
        x = np.geomspace(low, high, _STATED)
    else:
        words, x = leading.axis.words, _places(leading.axis, _STATED)
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


def _places(axis: Axis, most: int) -> Floats:
    """At which a course is looked at: all levels of words, which have nothing between them, or of a few."""
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
    """Of each combination in all of them, the largest first."""
    weights: dict[tuple[str, str, str], float] = {}
    for entry in search.laws:
        if search.is_supported(entry):
            key = _combination(problem, entry)
            weights[key] = float(np.logaddexp(weights.get(key, -np.inf), search.log_weight(entry)))
    total = np.logaddexp.reduce(list(weights.values()))
    ranked = sorted(weights.items(), key=lambda item: -item[1])
    return {key: float(np.exp(weight - total)) for key, weight in ranked}


def _parameters(leading: LeadingLaw) -> list[dict[str, Any]]:
    """Those of the fit, with the names that readers know; of a sine its amplitude, start and period."""
    law, explanation = leading.law, leading.explanation
    first = parameter_slices(explanation.names, explanation.best.hypothesis.lines)[law.name].start
    stated = [parameter(explanation, first + place) for place in range(len(law.parameters_bound))]
    if isinstance(law, RecordingLaw | LagLaw | CurveLaw):
        if law.shape.form == "periodic" and len(law.amplitudes) == law.shape.count:
            stated = [*_wave(leading, law), *stated[2:]]
        if law.shape.form == "step" and not (law.axis.words or isinstance(law, CurveLaw)):
            stated.append(_edge(law))
    return [{**entry, "name": entry["name"].removeprefix("law_")} for entry in stated]


def _wave(leading: LeadingLaw, law: RecordingLaw | LagLaw | CurveLaw) -> list[dict[str, Any]]:
    amplitudes = [leading.values[name] for name in law.amplitudes]
    size, start = wave(law, leading.values, amplitudes)
    quarter = np.array([start + leading.values["law_period"] / 4])
    half_width = SDS_OF_95 * float(np.sqrt(leading.variance(quarter)[0]))
    ends = {"value": rounded(size), "low": rounded(max(size - half_width, 0.0)), "high": rounded(size + half_width)}
    turn = half_width / max(size, 1e-12) * leading.values["law_period"] / (2 * np.pi)
    begins = {"value": rounded(start), "low": rounded(start - turn), "high": rounded(start + turn)}
    unit = law.parameters_bound[0].unit
    return [{"name": "amplitude", "unit": unit, **ends}, {"name": "start", "unit": law.axis.unit, **begins}]


def _edge(law: RecordingLaw | LagLaw) -> dict[str, Any]:
    """A step lies between two levels, nobody knows where."""
    at, levels = float(law.shape.variant), law.axis.levels
    low, high = levels[levels < at].max(), levels[levels > at].min()
    ends = {"value": rounded(at), "low": rounded(float(low)), "high": rounded(float(high))}
    return {"name": "at", "unit": law.axis.unit, **ends}


_MOST = 4  # recordings at each end
_SURE = 0.99
_FIELDS = ("sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n", "dwell_s", "load_cycles")
_PAST = ("order", "recorded_at")  # what no recording can be given again
_GIVEN_BY_SKIN = ("x_mm", "y_mm", "sensor")  # what the skin gives
_HOW = {
    "time_of_day": " Take them on another day.",
    "previous_preload_n": " Come to the preload from each of these.",
}


@dataclass(frozen=True)
class _Ends:
    """Where along the axis the law leaves the least and the most charge, and by how much its logarithm differs."""

    low: float
    high: float
    difference: float

    @property
    def both(self) -> tuple[float, float]:
        """The lower end first."""
        return self.low, self.high


def confirming(problem: FittingProblem, leading: LeadingLaw) -> dict[str, Any]:
    """The document; empty for a law over frequency, over words, over the places of the skin, or the same everywhere."""
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
    past = law.axis.name in _PAST
    like = [_nearest(problem, law.axis, at) if past else base for at in ends.both]
    count, probability = _enough(abs(ends.difference) / max(_scatter(problem, leading, number) for number in like))
    recordings = [_like(problem, number) for number in like]
    if not past:
        for entry, at in zip(recordings, ends.both, strict=True):
            entry[law.axis.name] = float(f"{at:.4g}")
    many = "one recording" if count == 1 else f"{count} recordings"
    differs = f"{100 * abs(np.expm1(ends.difference)):.2g} %"
    told = f"with a probability of {in_percent(probability)}"
    if past:
        first, second = (problem.collapsed.campaign.recordings[number].id for number in like)
        statement = (
            f"Repeating {first} and {second} after one another, {many} of each in turns, should tell whether it is the "
            f"time, {told}: if it is, the {differs} are gone by which they differ beyond what the known physics says."
        )
    else:
        words = AXES[law.axis.name][0] if law.axis.name in AXES else law.axis.name
        low, high = (f"{at:.4g}{'' if law.axis.unit == '-' else f' {law.axis.unit}'}" for at in ends.both)
        statement = (
            f"{many.capitalize()} with {words} at {low} and as many at {high}, in turns and all else equal, should "
            f"tell whether the law holds, {told}: if it does, the charge differs by {differs} "
            f"beyond what the known physics says."
            f"{_HOW.get(law.axis.name, '')}"
        )
    beside = [name for name in leading.explanation.names if name != law.name]
    return {
        "recordings": [entry | {"repeats": count} for entry in recordings],
        "separates": [beside, [*beside, "unnamed"]],
        "probability_of_deciding": round(probability, 3),
        "without_it": 0.5,
        "minutes": round(2 * count * RigLimits().minutes_per_recording, 1),
        "statement": statement,
    }


def _commonest(problem: FittingProblem) -> int:
    """The first recording of the contact that was recorded most often."""
    keys = [
        (entry.sensor, entry.indenter_radius_mm, entry.preload_n, entry.dynamic_force_n)
        for entry in frf_of(problem.collapsed.campaign)
    ]
    return keys.index(max(keys, key=keys.count))


def _ends(leading: LeadingLaw, law: RecordingLaw, base: int) -> _Ends:
    levels = law.axis.levels
    changes = np.array([_log_factor(leading, law, base, at) for at in levels.tolist()])
    low, high = int(np.argmin(changes)), int(np.argmax(changes))
    low, high = min(low, high), max(low, high)
    return _Ends(float(levels[low]), float(levels[high]), float(changes[high] - changes[low]))


def _log_factor(leading: LeadingLaw, law: RecordingLaw, base: int, at: float) -> float:
    """By which the law multiplies the charge of a recording, with this value on its axis."""
    design = leading.explanation.best.hypothesis.frf_model.design
    moved = law.on(replace(law.axis, values=dict.fromkeys(design.ids, at), range=leading.ends), law.tables)
    seeds = {name: Differentiated(np.array([[value]]), np.zeros((0, 1, 1))) for name, value in leading.values.items()}
    factor: Floats = np.broadcast_to(moved.on_recordings(design, seeds).value, (1, len(design.ids)))
    return float(np.log(max(float(factor[0, base]), 1e-12)))


def _scatter(problem: FittingProblem, leading: LeadingLaw, base: int) -> float:
    """Of one recording's charge, relative: from its gain, its place and its lines."""
    best, collapsed = leading.explanation.best, problem.collapsed
    line = best.levels.level * collapsed.deviation[base] / max(float(np.abs(collapsed.value[base])), 1e-300)
    place = best.levels.position * float(np.hypot(*best.relative_place_slopes[:, base]))
    return float(np.sqrt(best.levels.gain**2 + place**2 + line**2))


def _enough(size: float) -> tuple[int, float]:
    """How many recordings at each end make sure, or the most; and the probability that they tell."""
    sure = [float(ndtr(0.5 * size * np.sqrt(count / 2))) for count in range(1, _MOST + 1)]
    count = next((number for number, probability in enumerate(sure, 1) if probability >= _SURE), _MOST)
    return count, sure[count - 1]


def _nearest(problem: FittingProblem, axis: Axis, at: float) -> int:
    """The recording that lies nearest on the axis."""
    values = axis.of([entry.id for entry in problem.collapsed.campaign.recordings])
    return int(np.argmin(np.abs(values - at)))


def _like(problem: FittingProblem, number: int) -> dict[str, Any]:
    """What a recording was made with, in lab units."""
    entry: FrfConditions = frf_of(problem.collapsed.campaign)[number]
    known = {name: getattr(entry, name) for name in _FIELDS}
    return {name: value for name, value in known.items() if value is not None}
