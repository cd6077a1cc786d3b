"""What the figure of FRFs shows of each recording: its lines, what two explanations predict of them, and the noise.

A prediction holds the gain that the fit found of the sensor, but neither gain nor place of the single recording: how
far these two shift all of its lines is part of the noise, as is the noise of each line.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import whole_prediction
from underskin.recordings.campaign import FrfRecording, frf_recordings
from underskin.units import Complexes, Floats, Indices

MOST_RECORDINGS = 120
_FEWEST_LINES, _MOST_LINES = 40, 160  # of a recording
_MOST_POINTS = 6000  # of all together
_PC_PER_C = 1e12


@dataclass(frozen=True)
class ShownFrf:
    """One recording: those of its `count` lines that are shown (shown,); responses in pC/N.

    `deviation` (2, shown): the noise's standard deviation about the explanation after, of real and imaginary part.
    `left_before`, `left_after`: 100 √(Σ|y − m|²/Σ|m|²) over all its lines.
    """

    name: str
    sensor: str
    indenter_radius_mm: float
    preload_n: float
    count: int
    frequency_hz: Floats
    measured: Complexes
    before: Complexes
    after: Complexes
    deviation: Floats
    left_before: float
    left_after: float


def shown_frfs(problem: FittingProblem, before: Explanation, after: Explanation) -> list[ShownFrf]:
    """The recordings that were fitted, the one that is explained worst after first; of very many those explained worst,
    of each sensor as many as of another."""
    lines = problem.lines
    measured, was, now = (
        _PC_PER_C * rows for rows in (lines.value, *(_predicted(problem, e) for e in (before, after)))
    )
    deviation = _PC_PER_C * _deviation(problem, after)
    left = [[_left_percent(measured[own], rows[own]) for own in lines.spans] for rows in (was, now)]
    chosen = _worst([entry.sensor for entry in frf_recordings(lines.campaign)], left[1])
    most = int(np.clip(_MOST_POINTS // len(chosen), _FEWEST_LINES, _MOST_LINES))
    shown = []
    for number in chosen:
        entry, own = lines.campaign.recordings[number], lines.spans[number]
        assert isinstance(entry, FrfRecording)
        some = own.start + _thinned(lines.frequency[own], most)
        shown.append(
            ShownFrf(
                name=entry.id,
                sensor=entry.sensor,
                indenter_radius_mm=entry.indenter_radius_mm,
                preload_n=entry.preload_n,
                count=own.stop - own.start,
                frequency_hz=lines.frequency[some],
                measured=measured[some],
                before=was[some],
                after=now[some],
                deviation=deviation[:, some],
                left_before=left[0][number],
                left_after=left[1][number],
            )
        )
    return shown


def _predicted(problem: FittingProblem, explanation: Explanation) -> Complexes:
    """Of each row [C/N], with the sensors' gains and what scatter of the place does to the mean."""
    lines, best = problem.lines, explanation.best
    gain = best.sensor_gains[lines.sensor] + 0.5 * best.levels.position**2 * problem.curvature.laplacian
    predicted: Complexes = whole_prediction(problem, explanation) * np.exp(gain)[lines.recording]
    return predicted


def _deviation(problem: FittingProblem, explanation: Explanation) -> Floats:
    """Of real and imaginary part of each row about the prediction (2, rows) [C/N]: the lines' noise, mains pick-up, and
    gain and place of the recording."""
    lines, best = problem.lines, explanation.best
    levels, predicted = best.levels, _predicted(problem, explanation)
    pickup = best.pickup_variance
    of_line = (levels.level * lines.deviation) ** 2 + (
        pickup if len(pickup) == len(lines.value) else pickup[lines.recording]
    )
    placed = levels.position**2 * (best.relative_place_slopes**2).sum(axis=0)
    relative = levels.gain**2 + placed + 0.5 * levels.position**4 * problem.curvature.square
    parts = np.array([predicted.real, predicted.imag])
    return np.sqrt(of_line + relative[lines.recording] * parts**2)


def _left_percent(measured: Complexes, predicted: Complexes) -> float:
    size = float(np.linalg.norm(predicted))
    return 100 * float(np.linalg.norm(measured - predicted)) / size if size else 100.0


def _worst(sensors: Sequence[str], left: Sequence[float]) -> list[int]:
    """Which recordings are shown, in order."""
    order = sorted(range(len(left)), key=lambda number: -left[number])
    if len(order) <= MOST_RECORDINGS:
        return order
    seen: dict[str, int] = {}
    ranks = {}
    for number in order:
        ranks[number] = seen[sensors[number]] = seen.get(sensors[number], -1) + 1
    kept = set(sorted(order, key=lambda number: ranks[number])[:MOST_RECORDINGS])
    return [number for number in order if number in kept]


def _thinned(frequency: Floats, most: int) -> Indices:
    """Which of a recording's lines are shown, about evenly over the logarithm of frequency; `frequency` rises."""
    count = len(frequency)
    if count <= most:
        return np.arange(count)
    place = np.log(np.maximum(frequency, np.min(frequency[frequency > 0], initial=np.inf)))
    wanted = np.linspace(place[0], place[-1], most)
    return np.unique(np.minimum(np.searchsorted(place, wanted), count - 1))
