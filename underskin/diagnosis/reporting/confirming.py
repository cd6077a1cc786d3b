"""The recordings that would best confirm or refute a law that nobody listed, as the report's `next_experiment`.

They are taken in turns at the two ends between which the law changes the charge most, all else equal. There the
logarithm of the charge differs by d if the law holds, and by nothing if it does not. n recordings at each end leave it
uncertain by s √(2/n), s the scatter of one recording, and tell the two apart with the probability Φ(d/(2 s √(2/n))).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import ndtr

from underskin.autodiff import Differentiated
from underskin.diagnosis.inference.explanation import FittingProblem
from underskin.diagnosis.planning.rig_limits import RigLimits
from underskin.diagnosis.reporting.unnamed_law import LeadingLaw
from underskin.findings.formatting import in_percent
from underskin.mechanisms.unnamed.axes import Axis
from underskin.mechanisms.unnamed.laws import RecordingLaw
from underskin.mechanisms.unnamed.vocabulary import AXES
from underskin.recordings.conditions import FrfConditions, frf_of
from underskin.units import Floats

_MOST = 4  # recordings at each end
_SURE = 0.99
_FIELDS = ("sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n", "dwell_s", "load_cycles")
_PAST = ("order", "recorded_at")  # what no recording can be given again
_PLACES = ("x_mm", "y_mm", "sensor")  # what the skin gives
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
        or law.axis.name in _PLACES
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
