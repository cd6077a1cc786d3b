"""What each mechanism would change in the recordings of this design, and how much of that noise and nuisances leave.

Each mechanism's signature is what a typical strength of it (the quartile of its prior away from the limit) would change
in the base model's response. The information of all signatures and the nuisances is one matrix JᵀC⁻¹J. What is left of
a signature after the nuisances (with their priors) are taken out is the χ² by which the mechanism would show. A law has
a shape too (when an ageing sets in, at which stress a d33 saturates): after its typical one, a mechanism has signatures
with each further parameter at either end of its usual range.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.explanation import FittingProblem
from underskin.diagnosis.inference.likelihood import Likelihoods
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.diagnosis.noise.noise_levels import NoiseLevels, SeveralLevels
from underskin.mechanisms.base import Unsupported
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.parameter import Normal, Parameter
from underskin.units import Array, Floats

Split = tuple[Floats, NDArray[np.float32] | None]
_ENDS = (0.1, 0.9)  # of a shape's usual range
_AT_ONCE = 1 << 16  # numbers


class Signatures:
    """The signatures of all mechanisms that the campaign supports and that change the mean.

    Attributes: `owners`, the mechanism of each; `percent`, the root mean square of each over that of the base model's
    response.
    """

    def __init__(self, problem: FittingProblem) -> None:
        """Predict them around the base model as declared."""
        self._problem = problem
        self._fitter = Fitter([problem.hypothesis((), placed=False)])
        point = self._fitter.begin([np.zeros((1, 0))]).points.fit[0]
        self._base = self._fitter.hypotheses[0].model.predict(point)
        self.owners: list[str] = []
        self.percent: list[float] = []
        self._values: list[tuple[Array, Lines]] = []  # of curves, whose smooth error is yet to be found
        self._known_products: dict[float, tuple[Floats, Floats]] = {}
        rows = None if problem.lines.curves else _Rows(problem, self._base.value, 0.0)
        parts = [] if rows is None else self._of_nuisances(rows)
        for name, mechanism in problem.lines.mechanisms.named.items():
            if problem.kind not in mechanism.kinds:
                continue
            parameters = mechanism.parameters(problem.lines.campaign, problem.kind)
            if any(entry.moves_covariance for entry in parameters):
                continue
            try:
                hypothesis = problem.hypothesis((name,), placed=False)
            except Unsupported:
                continue
            shapes = np.array([[*own, *point] for own in _shapes(parameters)])
            model = hypothesis.model
            for value in model.values(shapes) if isinstance(model, FrfModel) else model.forces(shapes):
                self.owners.append(name)
                self.percent.append(self._size(value, hypothesis.lines))
                if rows is None:
                    self._values.append((value, hypothesis.lines))
                else:
                    parts.append(rows.split_change(value, hypothesis.lines))
        if rows is not None:
            self._known_products[0.0] = rows.products(parts)

    def _size(self, value: Array, lines: Lines) -> float:
        """The change on the rows of these lines: 100 · √(Σ|change|² / Σ|base|²)."""
        base = self._base.value if len(value) == len(self._base.value) else self._base.value[lines.recording]
        return 100 * float(np.sqrt((np.abs(value - base) ** 2).sum() / (np.abs(base) ** 2).sum()))

    def _of_nuisances(self, rows: "_Rows") -> list[Split]:
        return [rows.split(slope, self._fitter.lines) for slope in self._base.slopes]

    @property
    def nuisances(self) -> list[str]:
        """The parameters of the base model, by name."""
        return [entry.name for entry in self._fitter.hypotheses[0].model.parameters]

    @property
    def typical(self) -> dict[str, int]:
        """Where each mechanism's typical signature is: its first."""
        return {name: self.owners.index(name) for name in self.owners}

    def left(self, levels: NoiseLevels) -> tuple[Floats, Floats]:
        """The information on the signatures (signatures, signatures) under this noise: what the nuisances leave of it,
        and before they are taken out."""
        own, shared, beside = self._parts(levels)
        return own - shared @ np.linalg.solve(beside, shared.T), own

    def taken_up(self, levels: NoiseLevels) -> Floats:
        """By how much the nuisances move, in fit coordinates, to take up each signature (nuisances, signatures)."""
        _, shared, beside = self._parts(levels)
        return np.asarray(np.linalg.solve(beside, shared.T))

    def _parts(self, levels: NoiseLevels) -> tuple[Floats, Floats, Floats]:
        """The information on the signatures, what they share with the nuisances, and that on the nuisances with their
        priors."""
        nuisances = self._fitter.hypotheses[0].model.parameters
        information = self._information(levels)
        count = len(nuisances)
        prior = np.diag([entry.prior.sd**-2 if isinstance(entry.prior, Normal) else 0.0 for entry in nuisances])
        return information[count:, count:], information[count:, :count], information[:count, :count] + prior

    def _products(self, smooth: float) -> tuple[Floats, Floats]:
        """Re u*J and Re JᵀJ of the nuisances and the signatures; of curves with a smooth error of that share."""
        if smooth not in self._known_products:
            rows = _Rows(self._problem, self._base.value, smooth)
            parts = self._of_nuisances(rows) + [rows.split_change(*entry) for entry in self._values]
            self._known_products[smooth] = rows.products(parts)
        return self._known_products[smooth]

    def _information(self, levels: NoiseLevels) -> Floats:
        """On the nuisances and then on every signature."""
        hypothesis = self._problem.hypothesis((), placed=levels.position > 0)
        fitter = Fitter([hypothesis])
        base = fitter.begin([np.zeros((1, 0))])
        gain, level, position, spread, smooth = (
            np.full((1, 1, 1), value)
            for value in (levels.gain, levels.level, levels.position, levels.spread, levels.smooth)
        )
        several = SeveralLevels(gain, level, position, spread, None, smooth)
        likelihood = Likelihoods(fitter.lines, self._problem.curvature, base.products, several, base.points.bend)
        along, square = self._products(levels.smooth if fitter.lines.curves else 0.0)
        return likelihood.information(along / levels.level**2, square / levels.level**2)[0]


class _Rows:
    """Rows as what they are along the base model's own direction in each recording, and the rest across it."""

    def __init__(self, problem: FittingProblem, base: Array, smooth: float) -> None:
        """From the base model's prediction of the collapsed lines, or of curves with a smooth error of that share."""
        self._lines = problem.lines
        whitening = problem.lines.whitening
        self._root = 1.0 if whitening is None else np.sqrt(whitening.weight(np.array([smooth])))
        self._direction = self._whitened(base.real if problem.lines.curves else np.ones(len(problem.lines.value)))
        self._size = np.sqrt(self._sums(self._direction**2))
        self.base, _ = self.split(base, problem.collapsed)

    def split(self, value: Array, lines: Lines) -> Split:
        """Along it (recordings,), and across it (numbers,), None where that is 0, of a prediction of these lines.

        What is across is kept in single precision, since there is one of each signature on all lines.
        """
        if lines is not self._lines:
            return value.real * self._size, None
        whitened = self._whitened(value.real)
        along = self._sums(self._direction * whitened) / self._size
        across = whitened - self._direction * (along / self._size)[lines.recording]
        whole = across if lines.curves else np.concatenate([across, self._whitened(value.imag)])
        return along, whole.astype(np.float32)

    def split_change(self, value: Array, lines: Lines) -> Split:
        """The same of what a prediction changes of the base model's."""
        along, across = self.split(value, lines)
        return along - self.base, across

    def products(self, parts: Sequence[Split]) -> tuple[Floats, Floats]:
        """Re u*J (1, recordings, P) and Re JᵀJ (1, P, P) of columns J split like that."""
        along = np.array([own for own, _ in parts])
        square = along @ along.T
        beside = [number for number, (_, rest) in enumerate(parts) if rest is not None]
        if beside:
            across = [rest for _, rest in parts if rest is not None]
            for first in range(0, len(across[0]), _AT_ONCE):
                some = np.array([rest[first : first + _AT_ONCE] for rest in across], dtype=float)
                square[np.ix_(beside, beside)] += some @ some.T
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
        if entry.limit is not None and (entry.limit == 0 or entry.fit_limit is not None):
            continue  # its strength
        for quantile in _ENDS:
            moved = middle.copy()
            moved[place] = entry.quantile(quantile)
            shapes.append(moved)
    return shapes
