"""A score test of the laws that nobody listed on indentation curves: what each would gain on top of an explanation.

What the explanation leaves is projected onto the change that a law would make of each sample, over a small grid of what
bends it, beside the explanation's own parameters: linear algebra, no fit.
"""

import numpy as np

from underskin.autodiff import Differentiated
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.taken_up import beside, force_and_slopes, information, precision_of
from underskin.diagnosis.selection.unnamed_screening import Score, grid_values, prior_deviations
from underskin.mechanisms.models.curve_state import Samples
from underskin.mechanisms.models.curves import CurveModel, times_of
from underskin.mechanisms.unnamed.curve_laws import CurveLaw, Extent, curve_laws, of_samples
from underskin.recordings.conditions import curves_of
from underskin.units import Floats

_HELD = 2e-3  # of the range of displacement: off the deepest sample while a sphere is held
_ELSEWHERE = 30.0  # nats behind the best point of a grid within which a fit begins too


class CurveScreening:
    """The laws of a campaign of indentations."""

    def __init__(self, problem: FittingProblem, nothing: Explanation, best: Explanation) -> None:
        """With contact as the null hypothesis, `nothing`, has it; `best` is the best explanation."""
        self._lines, self._best = problem.lines, best
        curves = curves_of(self._lines.campaign)
        model = nothing.best.hypothesis.model
        assert isinstance(model, CurveModel)
        contacts = nothing.point.fit[model.contact_points].tolist()
        depths = [float(one.displacement_mm.max()) - at for one, at in zip(curves, contacts, strict=True)]
        times = {one.id: times_of(one) for one in curves}
        turns = {one.id: _last_deep(one.displacement_mm) for one in curves}
        back = any(turns[one.id] < len(one.displacement_mm) - 1 for one in curves)
        extent = Extent(
            depth_mm=max(depths),
            force_n=float(np.abs(self._lines.value.real).max()),
            time_s=max(float(np.ptp(own)) for own in times.values()),
            begins={name: float(own[0]) for name, own in times.items()},
            turns={name: float(own[turns[name]]) for name, own in times.items()} if back else {},
        )
        self.laws = curve_laws(extent, timed=all(one.time_s is not None for one in curves))

    def scores(self, explanation: Explanation) -> list[Score]:
        """Of every law, the grid of what bends it averaged; under the noise that the best explanation found, since a
        worse one takes what a law would change for noise."""
        force, slopes, stiffness = force_and_slopes(explanation)
        samples = self._samples(explanation)
        changes = [self._changes(law, samples, force, stiffness) for law, _ in self.laws]
        left = self._lines.value.real - force
        flat = [one.reshape(-1, len(force)) for one in changes]
        whole = information(explanation, np.concatenate([slopes, *flat, left[None]]), self._best)
        shown = beside(whole, np.arange(len(slopes)), precision_of(explanation.best.hypothesis))
        scores, first = [], 0
        for (law, log_share), own in zip(self.laws, changes, strict=True):
            points, count = own.shape[:2]
            rows = first + np.arange(points * count).reshape(points, count)
            first += points * count
            gram = shown[rows[:, :, None], rows[:, None, :]] + np.eye(count)
            moment = shown[rows, -1]
            amplitudes = np.linalg.solve(gram, moment[..., None])[..., 0]
            gains = 0.5 * (amplitudes * moment).sum(axis=1) - 0.5 * np.linalg.slogdet(gram)[1]
            best = int(np.argmax(gains))
            mean = float(np.logaddexp.reduce(gains) - np.log(points))
            others = [place for place in range(points) if place != best and gains[place] > gains[best] - _ELSEWHERE]
            guesses = tuple(np.append(amplitudes[place] * prior_deviations(law), law.grid[place]) for place in others)
            scores.append(Score(law, mean, log_share, amplitudes[best], law.grid[best], guesses))
        return scores

    def _samples(self, explanation: Explanation) -> Samples:
        """Each sample as a curve of its own."""
        model = explanation.best.hypothesis.model
        assert isinstance(model, CurveModel)
        curves, recording = curves_of(self._lines.campaign), self._lines.recording
        contact = explanation.point.fit[model.contact_points][recording]
        travel = np.concatenate([one.displacement_mm for one in curves]) - contact
        time = np.concatenate([times_of(one) for one in curves])
        return Samples([curves[number].id for number in recording], 1e-3 * travel[None, :, None], time[:, None])

    @staticmethod
    def _changes(law: CurveLaw, samples: Samples, force: Floats, stiffness: Floats) -> Floats:
        """What each feature changes in the force by an amplitude of its prior's deviation (grid, features, samples)."""
        values = {name: of_samples(value) for name, value in grid_values(law.shape.bending, law.grid).items()}
        unit = {"force": np.ones_like(force), "position": stiffness}.get(law.spoken.acts_on, force)
        each = []
        for feature, deviation in zip(
            law.features(samples, force[None, :, None], values), prior_deviations(law), strict=True
        ):
            value = feature.value if isinstance(feature, Differentiated) else feature
            whole = np.broadcast_to(value, (len(law.grid), *samples.travel.shape[1:]))[..., 0]
            each.append(deviation * unit * whole)
        return np.stack(each, axis=1)


def _last_deep(displacement: Floats) -> int:
    """The last sample before a sphere turns back: the deepest one, or that with which a hold ends."""
    return int(np.flatnonzero(displacement >= displacement.max() - _HELD * np.ptp(displacement))[-1])
