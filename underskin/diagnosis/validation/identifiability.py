"""Which mechanisms a campaign's design cannot tell from d33, E and h, or from each other; worked out before any fit.

Each mechanism's signature is what a typical strength of it (the quartile of its prior away from the limit) would change
in the base model's response. Under the noise that is usual, the information of all signatures and the nuisances is one
matrix JᵀC⁻¹J. What is left of a signature after the nuisances (with their priors) are taken out is the χ² by which the
mechanism would show; the cosine between two such remainders says whether they are alike. A law has a shape too (when an
ageing sets in, at which stress a d33 saturates): what one mechanism typically does is held against all shapes of
another, each further parameter at its middle and at either end of its usual range.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.explanation import FittingProblem
from underskin.diagnosis.inference.likelihood import Likelihoods
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.diagnosis.noise.correlated_error import TYPICAL
from underskin.diagnosis.noise.noise_levels import SeveralLevels
from underskin.diagnosis.selection.search import Answer
from underskin.mechanisms.base import Normal, Parameter, Unsupported
from underskin.mechanisms.models.composition import SENSOR_SPREAD
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.usual_scatter import USUAL_GAIN
from underskin.units import Array, Floats

_LEAST_CHI2 = 9.0
_TWINS = 0.98
_ENDS = (0.1, 0.9)  # of a shape's usual range
_OPEN = 0.1  # of the leader's probability: a rival beyond that is not told from it


class Likeness(Enum):
    """Why a mechanism is confounded."""

    NOISE = auto()
    TAKEN_UP = auto()  # by d33, E and h
    IMITATED = auto()  # what it typically does, the other can do
    IMITATES = auto()  # what the other typically does, it can do
    FITS_AS_WELL = auto()  # the other explains these recordings as well


@dataclass(frozen=True)
class Confounding:
    """`confounded_with` is another mechanism, "d33", or "noise" where too little of it shows."""

    mechanism: str
    confounded_with: str
    why: Likeness


def confounding(problem: FittingProblem) -> list[Confounding]:
    """What cannot be told apart here; mechanisms that the campaign does not support at all are not listed."""
    fitter = Fitter([problem.hypothesis((), placed=False)])
    base = fitter.begin(np.zeros((1, 0)))
    nuisances = fitter.hypotheses[0].model.predict(base.points.fit[0])
    rows = _Rows(problem, nuisances.value)
    owners, signatures = [], []
    for name, mechanism in CATALOGUE.items():
        if problem.kind not in mechanism.kinds:
            continue
        parameters = mechanism.parameters(problem.lines.campaign, problem.kind)
        if any(entry.moves_covariance for entry in parameters):
            continue
        try:
            hypothesis = problem.hypothesis((name,), placed=False)
        except Unsupported:
            continue
        for own in _shapes(parameters):
            owners.append(name)
            value = hypothesis.model.predict(np.concatenate([own, base.points.fit[0]])).value
            along, rest = rows.split(value, hypothesis.lines)
            signatures.append((along - rows.base, rest))
    if not owners:
        return []
    each = [*(rows.split(slope, fitter.lines) for slope in nuisances.slopes), *signatures]
    gain, level, position, spread, smooth = (
        np.full((1, 1, 1), value) for value in (USUAL_GAIN, 1.0, 0.0, SENSOR_SPREAD, rows.smooth)
    )
    levels = SeveralLevels(gain, level, position, spread, None, smooth)
    likelihood = Likelihoods(fitter.lines, problem.curvature, base.products, levels, base.points.bend)
    information = likelihood.information(*rows.products(each))[0]
    return _confounding(owners, information, fitter.hypotheses[0].model.parameters)


class _Rows:
    """Rows as what they are along the base model's own direction in each recording, and the rest across it."""

    def __init__(self, problem: FittingProblem, base: Array) -> None:
        """From the base model's prediction of the collapsed lines, or of curves."""
        self.smooth = TYPICAL if problem.lines.curves else 0.0
        self._lines = problem.lines
        whitening = problem.lines.whitening
        self._root = 1.0 if whitening is None else np.sqrt(whitening.weight(np.array([self.smooth])))
        self._direction = self._whitened(base.real if problem.lines.curves else np.ones(len(problem.lines.value)))
        self._size = np.sqrt(self._sums(self._direction**2))
        self.base, _ = self.split(base, problem.collapsed)

    def split(self, value: Array, lines: Lines) -> tuple[Floats, Floats | None]:
        """Along it (recordings,), and across it (numbers,), None where that is 0, of a prediction of these lines."""
        if lines is not self._lines:
            return value.real * self._size, None
        whitened = self._whitened(value.real)
        along = self._sums(self._direction * whitened) / self._size
        across = whitened - self._direction * (along / self._size)[lines.recording]
        return along, across if lines.curves else np.concatenate([across, self._whitened(value.imag)])

    def products(self, parts: Sequence[tuple[Floats, Floats | None]]) -> tuple[Floats, Floats]:
        """Re u*J (1, recordings, P) and Re JᵀJ (1, P, P) of columns J split like that."""
        along = np.array([own for own, _ in parts])
        square = along @ along.T
        beside = [number for number, (_, rest) in enumerate(parts) if rest is not None]
        if beside:
            across = np.array([rest for _, rest in parts if rest is not None])
            square[np.ix_(beside, beside)] += across @ across.T
        return (along * self._size).T[None], square[None]

    def _whitened(self, rows: Floats) -> Floats:
        """Real rows such that their errors are independent and of variance 1."""
        whitening = self._lines.whitening
        return rows / self._lines.deviation if whitening is None else whitening.turned(rows) * self._root

    def _sums(self, rows: Floats) -> Floats:
        return np.add.reduceat(rows, self._lines.first)


def _shapes(parameters: Sequence[Parameter]) -> list[Floats]:
    """The fit coordinates of a typical strength, then of the same with one other parameter at the ends of its range."""
    middle = np.array([entry.typical for entry in parameters])
    shapes = [middle]
    for place, entry in enumerate(parameters):
        if entry.limit is not None and np.isfinite(entry.to_fit(entry.limit) if entry.limit > 0 else entry.limit):
            continue  # its strength
        for quantile in _ENDS:
            moved = middle.copy()
            moved[place] = entry.quantile(quantile)
            shapes.append(moved)
    return shapes


def _confounding(owners: Sequence[str], information: Floats, nuisances: Sequence[Parameter]) -> list[Confounding]:
    """From the information on the nuisances and then on every signature, whose mechanisms are `owners`."""
    count = len(nuisances)
    prior = np.diag([entry.prior.sd**-2 if isinstance(entry.prior, Normal) else 0.0 for entry in nuisances])
    own, shared, beside = information[count:, count:], information[count:, :count], information[:count, :count] + prior
    left = own - shared @ np.linalg.solve(beside, shared.T)
    chi2 = np.maximum(np.diag(left), 0.0)
    first = {name: owners.index(name) for name in owners}  # a mechanism's first signature is the typical one
    confounded = []
    for name, index in first.items():
        if own[index, index] < _LEAST_CHI2:
            confounded.append(Confounding(name, "noise", Likeness.NOISE))
        elif chi2[index] < _LEAST_CHI2:
            confounded.append(Confounding(name, "d33", Likeness.TAKEN_UP))
    visible = [name for name in first if chi2[first[name]] >= _LEAST_CHI2]
    for one, other in itertools.combinations(visible, 2):
        for typical, shaped, why in ((one, other, Likeness.IMITATED), (other, one, Likeness.IMITATES)):
            place = first[typical]
            rivals = [index for index, name in enumerate(owners) if name == shaped and chi2[index] >= _LEAST_CHI2]
            cosine = left[place, rivals] / np.sqrt(chi2[place] * chi2[rivals])
            apart = (1 - cosine**2) * np.minimum(chi2[place], chi2[rivals])
            if (np.abs(cosine) > _TWINS).any() or (apart < _LEAST_CHI2).any():
                confounded.append(Confounding(one, other, why))
                break
    return confounded


def left_open(confounded: Sequence[Confounding], answers: Sequence[Answer]) -> list[Confounding]:
    """What cannot be told in the end: of the design's confounding all but what the recordings told all the same, and
    the rivals that explain them as well as the leading answer does.

    A mechanism of the leading set shows, whatever it would do typically; and it is told from another where the set with
    that in its place is not probable.
    """
    leader = answers[0]
    named = set(_sets([leader])[0]) if _sets([leader]) else set()
    swapped = {}
    for rival in _sets([answer for answer in answers[1:] if answer.probability >= _OPEN * leader.probability]):
        gone, come = named - set(rival), set(rival) - named
        if len(gone) == len(come) == 1:
            swapped[frozenset(gone | come)] = (*gone, *come)
    open_ones = []
    for entry in confounded:
        both = {entry.mechanism, entry.confounded_with}
        if not both & named or frozenset(both) in swapped:
            open_ones.append(entry)
            swapped.pop(frozenset(both), None)
    for one, other in sorted(swapped.values()):
        open_ones.append(Confounding(one, other, Likeness.FITS_AS_WELL))
    return open_ones


def _sets(answers: Sequence[Answer]) -> list[tuple[str, ...]]:
    """The answers that are sets of mechanisms."""
    return [answer.names for answer in answers if answer.explanation is not None and answer.explanation.names]
