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

import numpy as np
from numpy.typing import NDArray

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

Split = tuple[Floats, NDArray[np.float32] | None]
_SHAPE_QUANTILES = (0.1, 0.9)  # of the prior of a shape parameter
_BLOCK_NUMBERS = 1 << 16  # numbers of a signature per block


class Signatures:
    """The signatures of all mechanisms that the campaign supports and that change the mean.

    Attributes: `mechanisms`, the name of the mechanism of each; `percent`, the root mean square of each over that of
    the base model's response [%].
    """

    def __init__(self, problem: FittingProblem) -> None:
        """Predicted around the base model with the declared values."""
        self._problem = problem
        self._fitter = Fitter(problem.hypothesis((), has_position_scatter=False))
        point = self._fitter.initial(np.zeros((1, 0))).points.fit[0]
        self._base = self._fitter.model.predict(point)
        self.mechanisms: list[str] = []
        self.percent: list[float] = []
        self._values: list[tuple[Array, Lines]] = []
        self._products_by_smooth: dict[float, tuple[Floats, Floats]] = {}
        for name, mechanism in problem.lines.mechanisms.named.items():
            if problem.kind not in mechanism.kinds:
                continue
            parameters = mechanism.parameters(problem.lines.campaign, problem.kind)
            if any(parameter.moves_covariance for parameter in parameters):
                continue
            try:
                hypothesis = problem.hypothesis((name,), has_position_scatter=False)
            except Unsupported:
                continue
            shapes = np.array([[*shape, *point] for shape in _shapes(parameters)])
            model = hypothesis.model
            for value in model.values(shapes) if isinstance(model, FrfModel) else model.forces(shapes):
                self.mechanisms.append(name)
                self.percent.append(self._size(value, hypothesis.lines))
                self._values.append((value, hypothesis.lines))

    def _size(self, value: Array, lines: Lines) -> float:
        """The relative change on the rows of these lines: 100 · √(Σ|change|² / Σ|base|²)."""
        base = self._base.value if len(value) == len(self._base.value) else self._base.value[lines.recording]
        return 100 * float(np.sqrt((np.abs(value - base) ** 2).sum() / (np.abs(base) ** 2).sum()))

    @property
    def typical(self) -> dict[str, int]:
        """Index of each mechanism's typical signature: its first."""
        return {name: self.mechanisms.index(name) for name in self.mechanisms}

    def linearised(self, levels: NoiseLevels) -> Linearised:
        """The signatures as changes of the base model's prediction under this noise, its parameters being the
        nuisances."""
        return Linearised(self._information(levels), self._fitter.hypothesis.priors[0])

    def d33_shifts(self, linearised: Linearised) -> Floats:
        """The error of ln d33 by each (signatures,), of FRFs."""
        return linearised.absorbed()[self._fitter.hypothesis.index("d33")]

    def _products(self, smooth: float) -> tuple[Floats, Floats]:
        """Re u*J and Re JᵀJ of the nuisances and the signatures; of curves with a smooth error of that share."""
        if smooth not in self._products_by_smooth:
            rows = _Rows(self._problem, self._base.value, smooth)
            slopes = [rows.split(slope, self._fitter.lines) for slope in self._base.slopes]
            changes = [rows.split_change(*signature) for signature in self._values]
            self._products_by_smooth[smooth] = rows.products([*slopes, *changes])
        return self._products_by_smooth[smooth]

    def _information(self, levels: NoiseLevels) -> Floats:
        """On the nuisances and then on all signatures."""
        hypothesis = self._problem.hypothesis((), has_position_scatter=levels.position > 0)
        fitter = Fitter(hypothesis)
        base = fitter.initial(np.zeros((1, 0)))
        gain, level, position, spread, smooth = (
            np.full((1, 1, 1), value)
            for value in (levels.gain, levels.level, levels.position, levels.spread, levels.smooth)
        )
        several = SeveralLevels(gain, level, position, spread, None, smooth)
        along, square = self._products(levels.smooth if fitter.lines.curves else 0.0)
        return fitter.tangent(base.points, base.products, several).information(along, square)[0]


class _Rows:
    """Rows split into the component along the base model's response in each recording and the rest, across it."""

    def __init__(self, problem: FittingProblem, base: Array, smooth: float) -> None:
        """From the base model's prediction of the collapsed lines, or of curves with a smooth error `smooth`."""
        self._lines = problem.lines
        whitening = problem.lines.whitening
        self._root = 1.0 if whitening is None else np.sqrt(whitening.weight(np.array([smooth])))
        self._direction = self._whitened(base.real if problem.lines.curves else np.ones(len(problem.lines.value)))
        self._size = np.sqrt(self._sums(self._direction**2))
        self.base, _ = self.split(base, problem.collapsed)

    def split(self, value: Array, lines: Lines) -> Split:
        """A prediction of these lines along the response (recordings,) and across it (numbers,), None where that is 0.

        The part across is in single precision, since each signature has one on all lines.
        """
        if lines is not self._lines:
            return value.real * self._size, None
        whitened = self._whitened(value.real)
        along = self._sums(self._direction * whitened) / self._size
        across = whitened - self._direction * (along / self._size)[lines.recording]
        stacked = across if lines.curves else np.concatenate([across, self._whitened(value.imag)])
        return along, stacked.astype(np.float32)

    def split_change(self, value: Array, lines: Lines) -> Split:
        """The same of the difference of a prediction from the base model's."""
        along, across = self.split(value, lines)
        return along - self.base, across

    def products(self, parts: Sequence[Split]) -> tuple[Floats, Floats]:
        """Re u*J (1, P, recordings) and Re JᵀJ (1, P, P) of split columns J."""
        along = np.array([part for part, _ in parts])
        square = along @ along.T
        with_across = [index for index, (_, component) in enumerate(parts) if component is not None]
        if with_across:
            across = [component for _, component in parts if component is not None]
            for first in range(0, len(across[0]), _BLOCK_NUMBERS):
                block = np.array([component[first : first + _BLOCK_NUMBERS] for component in across], dtype=float)
                square[np.ix_(with_across, with_across)] += block @ block.T
        return (along * self._size)[None], square[None]

    def _whitened(self, rows: Floats) -> Floats:
        """Real rows scaled so that their errors are independent with variance 1."""
        whitening = self._lines.whitening
        return rows / self._lines.deviation if whitening is None else whitening.turned(rows) * self._root

    def _sums(self, rows: Floats) -> Floats:
        return np.add.reduceat(rows, self._lines.first)


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
