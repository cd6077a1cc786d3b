"""Signatures of mechanisms: detection limits, confounding and hidden shifts of d33.

A signature is what a typical strength of a mechanism (the quartile of its prior away from the limit) changes in the
base model's response. A mechanism has further signatures with each shape parameter (the onset of ageing, the stress at
which d33 saturates) at either end of its usual range. The information on all signatures and on the nuisances d33, E and
h is one matrix JᵀC⁻¹J; projecting out the nuisances, with their priors, leaves the χ² by which a mechanism would show.

- Detection limit: a mechanism is expected to be named where its gain ½χ² exceeds the prior odds of nothing missing, the
  odds an explanation must win by, and Occam's factor ½ log(1 + χ²). χ² grows as the strength squared.
- Hidden shift: a mechanism too weak to be named shifts d33, E and h by (H + P)⁻¹ Hₛ to first order; H is the
  information on them, P the precision of their priors, Hₛ the information they share with the signature.
- Confounding: the cosine between two signatures after projection, under usual noise, before any fit. The typical
  signature of one mechanism is compared with all signatures of the other.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto
from functools import cached_property

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.data.names import EXPLAINED, RIVAL_SHARE
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.fit import Fitter
from underskin.diagnosis.inference.residuals import Linearised
from underskin.diagnosis.noise import TYPICAL, NoiseLevels, SeveralLevels
from underskin.diagnosis.selection.answers import Answer
from underskin.diagnosis.selection.priors import least_evidence, log_prior
from underskin.inversion.mixed_model import USUAL_GAIN
from underskin.mechanisms.base import Kind, Parameter, Stage, Unsupported
from underskin.mechanisms.models.composition import SENSOR_SPREAD
from underskin.mechanisms.models.frf import FrfModel
from underskin.units import Array, Floats

_SHAPE_QUANTILES = (0.1, 0.9)  # of the prior of a shape parameter
_ROWS_AT_ONCE = 1 << 14


class Signatures:
    """The signatures of all mechanisms that the campaign supports and that change the mean.

    Attributes: `mechanisms`, the name of the mechanism of each; `percent`, the root mean square of each over that of
    the base model's response [%].
    """

    def __init__(self, problem: FittingProblem) -> None:
        """Predicted around the base model with the declared values."""
        self._problem = problem
        fitter = Fitter(problem.hypothesis((), has_position_scatter=False))
        self._point = fitter.initial(np.zeros((1, 0))).points
        self._hypothesis, base = fitter.hypothesis, fitter.model.predict(self._point.fit[0])
        self.mechanisms: list[str] = []
        self.percent: list[float] = []
        self._columns: list[tuple[Array, Lines]] = [(slope, fitter.lines) for slope in base.slopes]
        for name, mechanism in problem.lines.mechanisms.named.items():
            try:
                hypothesis = problem.hypothesis((name,), has_position_scatter=False)
            except Unsupported:
                continue
            parameters = mechanism.parameters(problem.lines.campaign, problem.kind)
            if any(parameter.moves_covariance for parameter in parameters):
                continue
            shapes = np.array([[*shape, *self._point.fit[0]] for shape in _shapes(parameters)])
            model = hypothesis.model
            for value in model.values(shapes) if isinstance(model, FrfModel) else model.forces(shapes):
                before = base.value if len(value) == len(base.value) else base.value[hypothesis.lines.recording]
                size = (np.abs(value - before) ** 2).sum() / (np.abs(before) ** 2).sum()
                self.mechanisms.append(name)
                self.percent.append(100 * float(np.sqrt(size)))
                self._columns.append((value - before, hypothesis.lines))

    @property
    def typical(self) -> dict[str, int]:
        """Index of each mechanism's typical signature: its first."""
        return {name: self.mechanisms.index(name) for name in self.mechanisms}

    def linearised(self, levels: NoiseLevels) -> Linearised:
        """The signatures as changes of the base model's prediction under this noise, its parameters being the
        nuisances."""
        fitter = Fitter(self._problem.hypothesis((), has_position_scatter=levels.position > 0))
        products = fitter.products(self._point, slopes=False, place=fitter.has_position_scatter)
        gain, level, position, spread, smooth = (
            np.full((1, 1, 1), value)
            for value in (levels.gain, levels.level, levels.position, levels.spread, levels.smooth)
        )
        several = SeveralLevels(gain, level, position, spread, None, smooth)
        tangent = fitter.tangent(self._point, products, several)
        if self._problem.lines.curves:
            information = tangent.information_on_forces(np.array([column.real for column, _ in self._columns]))
        else:
            information = tangent.information(*self._line_products)[0]
        return Linearised(information, self._hypothesis.priors[0])

    def d33_shifts(self, linearised: Linearised) -> Floats:
        """The error of ln d33 by each (signatures,), of FRFs."""
        return linearised.absorbed()[self._hypothesis.index("d33")]

    @cached_property
    def _line_products(self) -> tuple[Floats, Floats]:
        """Re u*J (1, P, recordings) and Re JᵀJ (1, P, P) of the nuisances and the signatures of FRFs, with u = 1: of
        their means over recordings, and of what the lines of some differ from these."""
        lines = self._problem.lines
        weight = lines.deviation**-2
        total = np.add.reduceat(weight, lines.first)
        means = np.array(
            [
                np.add.reduceat(weight * column.real, lines.first) / total if rows is lines else column.real
                for column, rows in self._columns
            ]
        )
        square = (means * total) @ means.T
        on_lines = [index for index, (_, rows) in enumerate(self._columns) if rows is lines]
        for first in range(0, len(weight) if on_lines else 0, _ROWS_AT_ONCE):
            rows = slice(first, first + _ROWS_AT_ONCE)
            columns = np.array([self._columns[index][0][rows] for index in on_lines])
            about = (columns - means[on_lines][:, lines.recording[rows]]) * np.sqrt(weight[rows])
            square[np.ix_(on_lines, on_lines)] += (about @ about.conj().T).real
        return (means * total)[None], square[None]


def _shapes(parameters: Sequence[Parameter]) -> list[Floats]:
    """The fit coordinates of a typical strength, then of the same with one other parameter at the ends of its range."""
    middle = np.array([parameter.typical for parameter in parameters])
    shapes = [middle]
    for index, parameter in enumerate(parameters):
        if parameter.limit is not None and (parameter.limit == 0 or parameter.fit_limit is not None):
            continue  # its strength
        for quantile in _SHAPE_QUANTILES:
            moved = middle.copy()
            moved[index] = parameter.quantile(quantile)
            shapes.append(moved)
    return shapes


_LARGEST = 100.0  # % of the response: with a higher detection limit a mechanism cannot be told from the nuisances
_ROUNDS = 20  # of a fixed-point iteration


@dataclass(frozen=True)
class Power:
    """Detection limit: the least root mean square change of the response over all rows that would show [%]."""

    mechanism: str
    smallest_visible_percent: float


def power(signatures: Signatures, explanation: Explanation, supported: int) -> list[Power]:
    """Detection limits of the mechanisms that can show in these recordings, the lowest first, at the noise levels of
    the answer's `explanation`; `supported` is the number of mechanisms among which the prior is shared."""
    if not signatures.mechanisms:
        return []
    chi2 = signatures.linearised(explanation.best.levels).chi2()
    least = least_chi2(supported, least_evidence(explanation))
    limits = [
        Power(name, signatures.percent[index] * float(np.sqrt(least / chi2[index])))
        for name, index in signatures.typical.items()
        if chi2[index] > 0
    ]
    visible = (limit for limit in limits if limit.smallest_visible_percent < _LARGEST)
    return sorted(visible, key=lambda limit: limit.smallest_visible_percent)


def least_chi2(supported: int, shows: float) -> float:
    """The least χ² at which one of `supported` mechanisms is expected to be named; it must bring `shows` nats."""
    odds = max(log_prior(0, supported) - log_prior(1, supported) + np.log(EXPLAINED / (1 - EXPLAINED)), shows)
    chi2 = 2 * odds
    for _ in range(_ROUNDS):
        chi2 = 2 * odds + np.log1p(chi2)
    return float(chi2)


@dataclass(frozen=True)
class HiddenShift:
    """A mechanism that would not be named at its typical strength, and the log of the factor of the error of d33.

    `declared`: the mechanism is a wrong declared value.
    """

    mechanism: str
    log_factor: float
    declared: bool

    @property
    def percent(self) -> float:
        """The error of d33 [%]."""
        return float(100 * np.expm1(self.log_factor))


def hidden_shifts(
    problem: FittingProblem,
    signatures: Signatures,
    explanation: Explanation,
    supported: int,
    other_kinds: frozenset[Kind] = frozenset(),
) -> list[HiddenShift]:
    """Of FRFs: the mechanisms that are not in the stated `explanation` and would not be named in addition.

    `supported` is the number of mechanisms that the campaign supports, among which the prior is shared. Mechanisms that
    also act on recordings of `other_kinds` are left out: those recordings show them, but are not in the signatures.
    """
    if problem.lines.curves or not signatures.mechanisms:
        return []
    linearised = signatures.linearised(explanation.best.levels)
    chi2, shifts = linearised.chi2(), signatures.d33_shifts(linearised)
    least = least_chi2(supported, least_evidence(explanation))
    mechanisms = problem.lines.mechanisms
    return [
        HiddenShift(name, float(shifts[index]), mechanisms[name].stage is Stage.DECLARED)
        for name, index in signatures.typical.items()
        if name not in explanation.names and chi2[index] < least and not other_kinds & {*mechanisms[name].kinds}
    ]


_LEAST_CHI2 = 9.0
_CONFOUNDED_COSINE = 0.98


class Likeness(Enum):
    """Why a mechanism is confounded."""

    NOISE = auto()
    TAKEN_UP = auto()  # by d33, E and h
    IMITATED = auto()  # what it typically does, the other can do
    IMITATES = auto()  # what the other typically does, it can do
    FITS_AS_WELL = auto()  # the other explains these recordings as well


@dataclass(frozen=True)
class Confounding:
    """`confounded_with` is another mechanism, "d33", or "noise" where the mechanism stays within the noise."""

    mechanism: str
    confounded_with: str
    why: Likeness


def confounding(signatures: Signatures) -> list[Confounding]:
    """Mechanisms that the design cannot tell apart; those that the campaign does not support are not listed."""
    mechanisms, first = signatures.mechanisms, signatures.typical
    if not mechanisms:
        return []
    linearised = signatures.linearised(NoiseLevels(USUAL_GAIN, 1.0, 0.0, SENSOR_SPREAD, smooth=TYPICAL))
    information, projected = np.diag(linearised.of_changes), linearised.beyond()
    chi2 = np.maximum(np.diag(projected), 0.0)
    confounded = []
    for name, index in first.items():
        if information[index] < _LEAST_CHI2:
            confounded.append(Confounding(name, "noise", Likeness.NOISE))
        elif chi2[index] < _LEAST_CHI2:
            confounded.append(Confounding(name, "d33", Likeness.TAKEN_UP))
    visible = [name for name in first if chi2[first[name]] >= _LEAST_CHI2]
    for first_name, second_name in itertools.combinations(visible, 2):
        for typical, imitator, why in (
            (first_name, second_name, Likeness.IMITATED),
            (second_name, first_name, Likeness.IMITATES),
        ):
            typical_index = first[typical]
            rivals = [index for index, name in enumerate(mechanisms) if name == imitator and chi2[index] >= _LEAST_CHI2]
            cosine = projected[typical_index, rivals] / np.sqrt(chi2[typical_index] * chi2[rivals])
            distance = (1 - cosine**2) * np.minimum(chi2[typical_index], chi2[rivals])
            if (np.abs(cosine) > _CONFOUNDED_COSINE).any() or (distance < _LEAST_CHI2).any():
                confounded.append(Confounding(first_name, second_name, why))
                break
    return confounded


def remaining_confounding(confounded: Sequence[Confounding], answers: Sequence[Answer]) -> list[Confounding]:
    """The confounding that remains with the answers: of the design's, and rivals that explain the recordings as well.

    A mechanism of the leading set shows, whatever its typical strength; and it is not confounded with another one if
    the set with that one in its place is not probable.
    """
    leader = answers[0]
    named = set(_sets([leader])[0]) if _sets([leader]) else set()
    swapped = {}
    for rival in _sets([answer for answer in answers[1:] if answer.probability >= RIVAL_SHARE * leader.probability]):
        removed, added = named - set(rival), set(rival) - named
        if len(removed) == len(added) == 1:
            swapped[frozenset(removed | added)] = (*removed, *added)
    remaining = []
    for pair in confounded:
        pair_names = {pair.mechanism, pair.confounded_with}
        if not pair_names & named or frozenset(pair_names) in swapped:
            remaining.append(pair)
            swapped.pop(frozenset(pair_names), None)
    for first_name, second_name in sorted(swapped.values()):
        remaining.append(Confounding(first_name, second_name, Likeness.FITS_AS_WELL))
    return remaining


def _sets(answers: Sequence[Answer]) -> list[tuple[str, ...]]:
    """The sets of mechanisms among the answers."""
    return [answer.names for answer in answers if answer.explanation is not None and answer.explanation.names]
