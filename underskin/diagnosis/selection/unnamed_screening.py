"""A score test of several hundred laws that nobody listed: what each would gain on top of an explanation, roughly.

What an explanation leaves is projected onto the change that a law would make, over a small grid of what bends it:
linear algebra under the noise, no fit. A law that acts on whole recordings is weighed on their gains (recording_gp.py),
one that acts along frequency on what lines lie off their own recording's best real multiple (residuals.py).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

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
    their priors, and what bends it; `others` are fit coordinates elsewhere from which a fit may begin as well."""

    law: UnnamedLaw
    gain: float
    log_share: float
    amplitudes: Floats
    bending: Floats
    others: tuple[Floats, ...] = ()

    @property
    def guess(self) -> Floats:
        """The law's fit coordinates there."""
        count = len(self.law.parameters_bound) - len(self.law.amplitudes)
        return np.concatenate([self.amplitudes * prior_deviations(self.law), self.bending[:count]])


@dataclass(frozen=True, eq=False)
class _Group(Generic[Law]):
    """Laws with equally many amplitudes that enter at one place.

    `log_shares` of each; `first` point of each on the grid of what bends it, and one more; `grid` of each point;
    `scale`, the sds of the amplitudes' priors at each (points, amplitudes).
    """

    laws: list[Law]
    log_shares: list[float]
    first: Indices
    grid: Floats
    scale: Floats

    @classmethod
    def of(cls, laws: Sequence[tuple[Law, float]], alike: Callable[[Law], str]) -> list["_Group[Law]"]:
        """Laws with their log shares, by what they are `alike` in."""
        groups: dict[tuple[str, int], list[tuple[Law, float]]] = {}
        for law, log_share in laws:
            groups.setdefault((alike(law), len(law.amplitudes)), []).append((law, log_share))
        each = []
        for members in groups.values():
            own = [law for law, _ in members]
            counts = [len(law.grid) for law in own]
            first = np.cumsum([0, *counts])
            grid = np.zeros((first[-1], max(law.grid.shape[1] for law in own)))
            for law, start, end in zip(own, first[:-1], first[1:], strict=True):
                grid[start:end, : law.grid.shape[1]] = law.grid
            scale = np.repeat([prior_deviations(law) for law in own], counts, axis=0)
            each.append(cls(own, [log_share for _, log_share in members], first, grid, scale))
        return each

    def scores(self, gains: Floats, amplitudes: Floats) -> Iterator[Score]:
        """From the gain at each point, and the most probable amplitudes there."""
        start = self.first[:-1]
        counts = np.diff(self.first)
        means = np.logaddexp.reduceat(gains, start) - np.log(counts)
        highest = np.flatnonzero(gains == np.repeat(np.maximum.reduceat(gains, start), counts))
        best = highest[np.searchsorted(highest, start)]  # the first of each law
        return map(Score, self.laws, means.tolist(), self.log_shares, amplitudes[best], self.grid[best])


class Screening:
    """The laws of a campaign, and the change that each would make by a small amplitude; the same for every score."""

    def __init__(self, problem: FittingProblem, grammar: Grammar) -> None:
        """Of all laws of the grammar."""
        self._problem = problem
        self._ids = tuple(entry.id for entry in problem.collapsed.campaign.recordings)
        self._frequency, self._line = np.unique(problem.lines.frequency, return_inverse=True)
        self._features: dict[tuple[Axis, Shape], Floats] = {}

        def some(kind: type[Law]) -> list[tuple[Law, float]]:
            laws = zip(grammar.laws, grammar.log_shares.tolist(), strict=True)
            return [(law, log_share) for law, log_share in laws if isinstance(law, kind)]

        self._of_recordings = _Group.of(some(RecordingLaw), lambda law: law.spoken.acts_on)
        self._over_frequency = _Group.of(some(FrequencyLaw), lambda _: "")
        self._lags = _Group.of(some(LagLaw), lambda law: law.kind)

    def scores(self, explanation: Explanation) -> list[Score]:
        """Of every law, the grid of what bends it averaged."""
        along_lines = self._along_lines(explanation) if len(self._frequency) > 1 else ()
        return [*self._along_recordings(explanation), *along_lines]

    def _along_recordings(self, explanation: Explanation) -> Iterator[Score]:
        residual = GainResidual(self._problem, explanation)
        for group in self._of_recordings:
            features = np.concatenate([self._features_of(law) for law in group.laws])
            columns = self._sensitivity[group.laws[0].spoken.acts_on].T
            changes = np.concatenate([features * column[:, None] for column in columns], axis=2)
            changes *= group.scale[:, None]
            yield from group.scores(residual.gains(changes, _USUAL_CHANGE), residual.amplitudes(changes))

    def _along_lines(self, explanation: Explanation) -> Iterator[Score]:
        weights, moments, noise = self._moments(explanation)
        total, moment, own = weights.sum(axis=0), moments.sum(axis=0), weights.sum(axis=1)
        for group in self._over_frequency:
            tangents = np.concatenate([law.tangents(self._frequency) for law in group.laws]) * group.scale[:, None]
            changes = tangents.transpose(0, 2, 1)  # (points, features, frequencies)
            gram = np.einsum("pif,f,pjf->pij", changes.conj(), total, changes, optimize=True).real
            means = changes.real @ weights.T  # (points, features, recordings)
            gram = gram - np.einsum("pir,r,pjr->pij", means, 1 / own, means, optimize=True)
            yield from group.scores(*noise.gains(gram, (changes.conj() @ moment).real))
        for lags in self._lags:
            pattern = lags.laws[0].pattern(self._frequency)
            spread = weights @ np.abs(pattern) ** 2 - (weights @ pattern.real) ** 2 / own  # by recording
            lag = np.concatenate([self._lag(law) for law in lags.laws]) * lags.scale[:, None]
            turned = lag.transpose(0, 2, 1)
            gram = (turned * spread) @ lag if lag.shape[2] > 1 else (turned**2 @ spread)[:, None]
            yield from lags.scores(*noise.gains(gram, turned @ (moments @ pattern.conj()).real))

    @cached_property
    def _sensitivity(self) -> dict[str, Floats]:
        """∂ ln level by the features of laws that act on this (recordings, 1 or 2)."""
        laws = {law.spoken.acts_on: law for group in self._of_recordings for law in group.laws[:1]}
        return {acts_on: law.sensitivity(self._ids) for acts_on, law in laws.items()}

    def _lag(self, law: LagLaw) -> Floats:
        """Features of the recordings; what they make of lines depends on the kind of lag."""
        features = self._features_of(law)
        return np.exp(law.grid[:, :, None] * features) if law.shape.logarithmic else features

    def _features_of(self, law: RecordingLaw | LagLaw) -> Floats:
        """Of its form over its axis (points, recordings, features)."""
        key = law.axis, law.shape
        if key not in self._features:
            grid = law.shape.points
            values = grid_values(law.shape.bending, grid)
            each = [
                np.broadcast_to(one.value if isinstance(one, Differentiated) else one, (len(grid), len(self._ids)))
                for one in law.shape.features(law.axis.of(self._ids), values)
            ]
            self._features[key] = np.stack(each, axis=2)
        return self._features[key]

    def _moments(self, explanation: Explanation) -> tuple[Floats, Array, "_Levels"]:
        """Of lines by recording and distinct frequency: the weights, the residuals times them, and their χ²."""
        lines = self._problem.lines
        relative, weight = line_residuals(self._problem, explanation)
        size = lines.recordings, len(self._frequency)
        place = lines.recording * size[1] + self._line
        weights, real, imag = (
            np.asarray(np.bincount(place, values, size[0] * size[1]), dtype=float).reshape(size)
            for values in (weight, weight * relative.real, weight * relative.imag)
        )
        chi2 = float((weight * np.abs(relative) ** 2).sum())
        return weights, real + 1j * imag, _Levels(chi2, 2 * len(relative) - lines.recordings)


def grid_values(bending: Sequence[Parameter], grid: Floats) -> dict[str, Differentiated]:
    """What bends a form at the points of a grid (points, parameters), as values without derivatives."""
    values = {}
    for entry, at in zip(bending, grid.T, strict=True):
        value = np.exp(at) if entry.scale == "log" else at
        values[entry.name] = Differentiated(value[:, None], np.zeros((0, len(grid), 1)))
    return values


def prior_deviations(law: UnnamedLaw) -> Floats:
    """Of the amplitudes (amplitudes,)."""
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
