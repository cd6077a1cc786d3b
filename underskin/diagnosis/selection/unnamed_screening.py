"""A score test of several hundred laws that nobody listed: what each would gain on top of an explanation, roughly.

What an explanation leaves is projected onto the change that a law would make, over a small grid of what bends it:
linear algebra under the noise, no fit. A law that acts on whole recordings is weighed on their gains (recording_gp.py),
one that acts along frequency on what lines lie off their own recording's best real multiple (residuals.py).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

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

Law = TypeVar("Law", bound=UnnamedLaw)
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
        """Of all laws of the grammar."""
        self._problem, self._grammar = problem, grammar
        self._ids = tuple(entry.id for entry in problem.collapsed.campaign.recordings)
        self._features: dict[tuple[Axis, Shape], Floats] = {}

    def _some(self, kind: type[Law]) -> list[tuple[int, Law]]:
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
        return [*self._along_recordings(explanation), *self._along_lines(explanation)]

    def _along_recordings(self, explanation: Explanation) -> Iterator[Score]:
        residual = GainResidual(self._problem, explanation)
        for acts_on in self._sensitivity:
            laws = [(place, law) for place, law in self._some(RecordingLaw) if law.spoken.acts_on == acts_on]
            for columns in _Columns.of(laws, self._changes):
                changes = columns.changes.real
                gains, amplitudes = residual.gains(changes, _USUAL_CHANGE), residual.amplitudes(changes)
                yield from self._collected(columns, gains, amplitudes)

    @cached_property
    def _sensitivity(self) -> dict[str, Floats]:
        """∂ ln level by the features of laws that act on this (recordings, 1 or 2)."""
        laws = {law.spoken.acts_on: law for _, law in self._some(RecordingLaw)}
        return {acts_on: law.sensitivity(self._ids) for acts_on, law in laws.items()}

    def _changes(self, laws: Sequence[RecordingLaw]) -> Floats:
        features = np.concatenate([self._features_of(law) for law in laws])
        columns = self._sensitivity[laws[0].spoken.acts_on].T
        return np.concatenate([features * column[:, None] for column in columns], axis=2)

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

    def _tangents(self, laws: Sequence[FrequencyLaw]) -> Array:
        return np.concatenate([law.tangents(self._distinct[0]) for law in laws])

    def _lags(self, laws: Sequence[LagLaw]) -> Floats:
        """Features of the recordings; what they make of lines depends on the kind of lag."""
        each = []
        for law in laws:
            features = self._features_of(law)
            each.append(np.exp(law.grid[:, :, None] * features) if law.shape.logarithmic else features)
        return np.concatenate(each)

    @cached_property
    def _distinct(self) -> tuple[Floats, Indices]:
        frequency, line = np.unique(self._problem.lines.frequency, return_inverse=True)
        return frequency, line

    def _along_lines(self, explanation: Explanation) -> Iterator[Score]:
        frequency = self._distinct[0]
        if len(frequency) < 2:
            return
        weights, moments, noise = self._moments(explanation)
        total, moment, own = weights.sum(axis=0), moments.sum(axis=0), weights.sum(axis=1)
        for columns in _Columns.of(self._some(FrequencyLaw), self._tangents):
            changes = columns.changes.transpose(0, 2, 1)  # (points, features, frequencies)
            gram = np.einsum("pif,f,pjf->pij", changes.conj(), total, changes, optimize=True).real
            means = changes.real @ weights.T  # (points, features, recordings)
            gram = gram - np.einsum("pir,r,pjr->pij", means, 1 / own, means, optimize=True)
            along = (changes.conj() @ moment).real
            yield from self._collected(columns, *noise.gains(gram, along))
        sums: dict[str, tuple[Floats, Floats]] = {}  # of each kind of lag, by recording
        for _, law in self._some(LagLaw):
            assert isinstance(law, LagLaw)
            if law.kind not in sums:
                pattern = law.pattern(frequency)
                spread = weights @ np.abs(pattern) ** 2 - (weights @ pattern.real) ** 2 / own
                sums[law.kind] = spread, (moments @ pattern.conj()).real
        for columns in _Columns.of(self._some(LagLaw), self._lags):
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
            yield from self._collected(columns, *noise.gains(gram, along))

    def _moments(self, explanation: Explanation) -> tuple[Floats, Array, "_Levels"]:
        """Of lines by recording and distinct frequency: the weights, the residuals times them, and their χ²."""
        lines, (frequency, line) = self._problem.lines, self._distinct
        relative, weight = line_residuals(self._problem, explanation)
        size = lines.recordings, len(frequency)
        place = lines.recording * len(frequency) + line
        weights, real, imag = (
            np.asarray(np.bincount(place, values, size[0] * size[1]), dtype=float).reshape(size)
            for values in (weight, weight * relative.real, weight * relative.imag)
        )
        chi2 = float((weight * np.abs(relative) ** 2).sum())
        return weights, real + 1j * imag, _Levels(chi2, 2 * len(relative) - lines.recordings)


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
    def of(cls, laws: Sequence[tuple[int, Law]], changes: Callable[[Sequence[Law]], Array]) -> Iterator["_Columns"]:
        """Group by group, since all together take much memory; `changes` are by the amplitudes of some laws (points,
        rows, amplitudes)."""
        groups: dict[int, list[tuple[int, Law]]] = {}
        for place, law in laws:
            groups.setdefault(len(law.amplitudes), []).append((place, law))
        for members in groups.values():
            places = [place for place, _ in members]
            counts = [len(law.grid) for _, law in members]
            edges = np.cumsum([0, *counts])
            grid = np.zeros((edges[-1], max(law.grid.shape[1] for _, law in members)))
            for (_, law), start, end in zip(members, edges[:-1], edges[1:], strict=True):
                grid[start:end, : law.grid.shape[1]] = law.grid
            scale = np.repeat([_sds(law) for _, law in members], counts, axis=0)
            each = changes([law for _, law in members]) * scale[:, None, :]
            yield cls(places, edges, np.repeat(places, counts), each, grid)


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
