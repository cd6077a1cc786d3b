"""A score test of several hundred laws that nobody listed: what each would gain on top of an explanation, roughly.

What an explanation leaves is projected onto the change that a law would make, over a small grid of what bends it:
linear algebra under the noise, no fit. A law that acts on whole recordings is weighed on their gains (recording_gp.py),
one that acts along frequency on what lines lie off their own recording's best real multiple (residuals.py).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from underskin.autodiff import Differentiated
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import line_residuals
from underskin.diagnosis.selection.recording_gp import GainResidual
from underskin.mechanisms.parameter import Normal, Parameter
from underskin.mechanisms.unnamed.axes import Axis
from underskin.mechanisms.unnamed.forms import Shape
from underskin.mechanisms.unnamed.frequency_laws import FrequencyLaw
from underskin.mechanisms.unnamed.grammar import Grammar
from underskin.mechanisms.unnamed.laws import LagLaw, RecordingLaw, UnnamedLaw
from underskin.units import Array, Floats, Indices

_USUAL_CHANGE = np.array([1.0])  # times the sd of each amplitude's prior


@dataclass(frozen=True, eq=False)
class Score:
    """What a law gains in log evidence on top of an explanation; where it gains most, its amplitudes over the sds of
    their priors, and what bends it."""

    law: UnnamedLaw
    gain: float
    log_share: float
    amplitudes: Floats
    bending: Floats

    @property
    def guess(self) -> Floats:
        """The law's fit coordinates there."""
        count = len(self.law.parameters_bound) - len(self.law.amplitudes)
        return np.concatenate([self.amplitudes * _sds(self.law), self.bending[:count]])


class Screening:
    """The laws of a campaign, and the change that each would make by a small amplitude; the same for every score."""

    def __init__(self, problem: FittingProblem, grammar: Grammar) -> None:
        """Differentiate the laws at amplitudes of 0."""
        self._problem, self._grammar = problem, grammar
        self._ids = tuple(entry.id for entry in problem.collapsed.campaign.recordings)
        self._features: dict[tuple[Axis, Shape], Floats] = {}
        sensitivity: dict[str, Floats] = {}

        def change(law: UnnamedLaw) -> Array:
            assert isinstance(law, RecordingLaw)
            acts_on = law.spoken.acts_on
            if acts_on not in sensitivity:
                sensitivity[acts_on] = law.sensitivity(self._ids)
            features = self._features_of(law)
            return np.concatenate([features * column[:, None] for column in sensitivity[acts_on].T], axis=2)

        self._of_recordings = _Columns.of(self._some(RecordingLaw), change)

    def _some(self, kind: type[UnnamedLaw]) -> list[tuple[int, UnnamedLaw]]:
        return [(place, law) for place, law in enumerate(self._grammar.laws) if isinstance(law, kind)]

    def _features_of(self, law: RecordingLaw | LagLaw) -> Floats:
        """Of its form over its axis (points, recordings, features)."""
        key = law.axis, law.shape
        if key not in self._features:
            grid = np.array(law.shape.grid, dtype=float).reshape(len(law.shape.grid), -1)
            values = _at(law.shape.bending, grid)
            each = [
                np.broadcast_to(one.value if isinstance(one, Differentiated) else one, (len(grid), len(self._ids)))
                for one in law.shape.features(law.axis.of(self._ids), values)
            ]
            self._features[key] = np.stack(each, axis=2)
        return self._features[key]

    def scores(self, explanation: Explanation) -> list[Score]:
        """Of every law, the grid of what bends it averaged."""
        each: list[Score] = []
        residual = GainResidual(self._problem, explanation)
        for columns in self._of_recordings:
            gains = residual.gains(columns.changes.real, _USUAL_CHANGE)
            amplitudes = residual.amplitudes(columns.changes.real)
            each += self._collected(columns, gains, amplitudes)
        for columns, gains, amplitudes in self._along_lines(explanation):
            each += self._collected(columns, gains, amplitudes)
        return each

    def _collected(self, columns: "_Columns", gains: Floats, amplitudes: Floats) -> list[Score]:
        first, counts = columns.first[:-1], np.diff(columns.first)
        means = np.logaddexp.reduceat(gains, first) - np.log(counts)
        scores = []
        for number, (place, gain) in enumerate(zip(columns.laws, means.tolist(), strict=True)):
            law, start = self._grammar.laws[place], int(first[number])
            best = start + int(np.argmax(gains[start : start + counts[number]]))
            scores.append(
                Score(law, gain, float(self._grammar.log_shares[place]), amplitudes[best], columns.grid[best])
            )
        return scores

    @cached_property
    def _over_frequency(self) -> list["_Columns"]:
        frequency = self._distinct[0]

        def change(law: UnnamedLaw) -> Array:
            assert isinstance(law, FrequencyLaw)
            return law.tangents(frequency)

        return _Columns.of(self._some(FrequencyLaw), change)

    @cached_property
    def _lags(self) -> list["_Columns"]:
        """Features of the recordings; what they make of lines depends on the kind of lag."""

        def change(law: UnnamedLaw) -> Array:
            assert isinstance(law, LagLaw)
            features = self._features_of(law)
            return np.exp(law.grid[:, :, None] * features) if law.shape.logarithmic else features

        return _Columns.of(self._some(LagLaw), change)

    @cached_property
    def _distinct(self) -> tuple[Floats, Indices]:
        frequency, line = np.unique(self._problem.lines.frequency, return_inverse=True)
        return frequency, line

    def _along_lines(self, explanation: Explanation) -> list[tuple["_Columns", Floats, Floats]]:
        lines = self._problem.lines
        frequency, line = self._distinct
        if len(frequency) < 2:
            return []
        relative, weight = line_residuals(self._problem, explanation)
        size = lines.recordings, len(frequency)
        place = lines.recording * len(frequency) + line
        weights = np.bincount(place, weight, size[0] * size[1]).reshape(size)
        moments = (
            np.bincount(place, weight * relative.real, size[0] * size[1])
            + 1j * np.bincount(place, weight * relative.imag, size[0] * size[1])
        ).reshape(size)
        noise = _Levels(float((weight * np.abs(relative) ** 2).sum()), 2 * len(relative) - lines.recordings)
        found = []
        total, moment, own = weights.sum(axis=0), moments.sum(axis=0), weights.sum(axis=1)
        for columns in self._over_frequency:
            changes = columns.changes.transpose(0, 2, 1)  # (points, features, frequencies)
            gram = np.einsum("pif,f,pjf->pij", changes.conj(), total, changes, optimize=True).real
            means = changes.real @ weights.T  # (points, features, recordings)
            gram = gram - np.einsum("pir,r,pjr->pij", means, 1 / own, means, optimize=True)
            along = (changes.conj() @ moment).real
            found.append((columns, *noise.gains(gram, along)))
        sums: dict[str, tuple[Floats, Floats]] = {}  # of each kind of lag, by recording
        for _, law in self._some(LagLaw):
            assert isinstance(law, LagLaw)
            if law.kind not in sums:
                pattern = law.pattern(frequency)
                spread = weights @ np.abs(pattern) ** 2 - (weights @ pattern.real) ** 2 / own
                sums[law.kind] = spread, (moments @ pattern.conj()).real
        for columns in self._lags:
            kinds = np.array(
                [law.kind for law in (self._grammar.laws[place] for place in columns.owner) if isinstance(law, LagLaw)]
            )
            count = columns.changes.shape[2]
            gram, along = np.empty((len(kinds), count, count)), np.empty((len(kinds), count))
            for kind, (gram_of, along_of) in sums.items():
                own = kinds == kind
                changes = columns.changes[own].real
                turned = changes.transpose(0, 2, 1)
                along[own] = turned @ along_of
                if count == 1:
                    gram[own, :, 0] = turned**2 @ gram_of
                else:
                    gram[own] = (turned * gram_of) @ changes
            found.append((columns, *noise.gains(gram, along)))
        return found


@dataclass(frozen=True, eq=False)
class _Columns:
    """Changes by the amplitudes, times the sd of their priors, of laws with equally many (points, rows, amplitudes).

    `laws`: their places in the grammar; `first` point of each, and one more; `owner` of each point; `grid` of each,
    what bends it.
    """

    laws: list[int]
    first: Indices
    owner: Indices
    changes: Array
    grid: Floats

    @classmethod
    def of(cls, laws: Sequence[tuple[int, UnnamedLaw]], change: Callable[[UnnamedLaw], Array]) -> list["_Columns"]:
        """`change` by the amplitudes of one law (points, rows, amplitudes)."""
        groups: dict[int, list[tuple[int, UnnamedLaw]]] = {}
        for place, law in laws:
            groups.setdefault(len(law.amplitudes), []).append((place, law))
        each = []
        for members in groups.values():
            changes = [change(law) * _sds(law) for _, law in members]
            counts = [len(entry) for entry in changes]
            widest = max((law.grid.shape[1] for _, law in members), default=0)
            grid = np.zeros((sum(counts), widest))
            edges = np.cumsum([0, *counts])
            for (_, law), start, end in zip(members, edges[:-1], edges[1:], strict=True):
                grid[start:end, : law.grid.shape[1]] = law.grid
            each.append(
                cls(
                    [place for place, _ in members],
                    edges,
                    np.repeat([place for place, _ in members], counts),
                    np.concatenate(changes),
                    grid,
                )
            )
        return each


def _at(bending: Sequence[Parameter], grid: Floats) -> dict[str, Differentiated]:
    """What bends a form at the points of a grid (points, parameters), as values without derivatives."""
    values = {}
    for entry, at in zip(bending, grid.T, strict=True):
        value = np.exp(at) if entry.scale == "log" else at
        values[entry.name] = Differentiated(value[:, None], np.zeros((0, len(grid), 1)))
    return values


def _sds(law: UnnamedLaw) -> Floats:
    priors = [entry.prior for entry in law.parameters_bound[: len(law.amplitudes)]]
    return np.array([prior.sd for prior in priors if isinstance(prior, Normal)])


@dataclass(frozen=True)
class _Levels:
    """χ² of the lines and its degrees of freedom; the noise's level is what suits best, at least 1."""

    chi2: float
    freedom: int

    def gains(self, gram: Floats, moment: Floats) -> tuple[Floats, Floats]:
        """log p with amplitudes of prior sd 1 over that without (points,), and their most probable values."""
        eye = np.eye(gram.shape[-1])
        first = max(1.0, self.chi2 / max(self.freedom, 1))
        before = -0.5 * self.chi2 / first - 0.5 * self.freedom * np.log(first)
        level = np.full(len(gram), 1.0)
        for _ in range(4):
            solved = np.linalg.solve(gram + level[:, None, None] * eye, moment[..., None])[..., 0]
            left = self.chi2 - np.maximum((solved * moment).sum(axis=1), 0.0)
            level = np.maximum(1.0, left / max(self.freedom, 1))
        determinant = np.linalg.slogdet(eye + gram / level[:, None, None])[1]
        after = -0.5 * left / level - 0.5 * self.freedom * np.log(level) - 0.5 * determinant
        return np.asarray(after - before), np.asarray(solved)
