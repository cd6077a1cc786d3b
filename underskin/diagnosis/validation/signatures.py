"""What mechanisms would leave in the recordings: whether they would show, be told apart, or hide.

What each mechanism would change in the recordings of this design, and how much of that noise and nuisances leave.

Each mechanism's signature is what a typical strength of it (the quartile of its prior away from the limit) would change
in the base model's response. The information of all signatures and the nuisances is one matrix JᵀC⁻¹J. What is left of
a signature after the nuisances (with their priors) are taken out is the χ² by which the mechanism would show. A law has
a shape too (when an ageing sets in, at which stress a d33 saturates): after its typical one, a mechanism has signatures
with each further parameter at either end of its usual range.

Which mechanisms these recordings would have shown, and from which strength on.

A mechanism would have shown if, at the noise that was found, its expected gain in log likelihood ½χ² pays for what it
costs: the prior odds of nothing missing, those that an explanation must win by, and Occam's factor of its strength,
½ log(1 + χ²). χ² is what the nuisances leave of its typical signature, which grows as the strength
squared.

By how much d33 would be off if a mechanism were there that these recordings cannot show.

Where a mechanism's typical strength leaves too little beside d33, E and h to be named, these take up what it does: by
(H + P)⁻¹ Hₛ to first order, H the information on them, P that of their priors and Hₛ what they share with the
mechanism's signature.

Which mechanisms a campaign's design cannot tell from d33, E and h, or from each other; worked out before any fit.

By their signatures under the noise that is usual: the cosine between what the nuisances leave of two of them says
whether they are alike. What one mechanism typically does is held against all shapes of another.

Stiffening that only the beginning of compression curves tells: a platen that seats, tilted or on an uneven end.

While a wedge closes the force rises too slowly, and from full contact on linearly, shifted by half the wedge: as a
whole the curve looks stiffer at its end than at its beginning. Stiffening goes on, seating does not: what only the
first tenth of the displacement tells is seating. Samples that are pulled are gripped, and seat on nothing.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from underskin.diagnosis.data.dataset import Lines, curve_lines
from underskin.diagnosis.data.names import EXPLAINED
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.fit import Fitter
from underskin.diagnosis.inference.hypothesis import Likelihoods
from underskin.diagnosis.noise import TYPICAL, NoiseLevels, SeveralLevels
from underskin.diagnosis.selection.answers import Answer
from underskin.diagnosis.selection.priors import SHOWS, least_evidence, log_prior
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.base import Kind, Stage, Unsupported
from underskin.mechanisms.models.composition import SENSOR_SPREAD
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.parameter import Normal, Parameter
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Campaign, CompressionRecording, Recording, samples_of
from underskin.recordings.usual_scatter import USUAL_GAIN
from underskin.surrogate.sigma_table import SigmaTable
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
        self._fitter = Fitter([problem.hypothesis((), has_position_scatter=False)])
        point = self._fitter.initial([np.zeros((1, 0))]).points.fit[0]
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
                hypothesis = problem.hypothesis((name,), has_position_scatter=False)
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

    def project_out_parameters(self, levels: NoiseLevels) -> Floats:
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
        hypothesis = self._problem.hypothesis((), has_position_scatter=levels.position > 0)
        fitter = Fitter([hypothesis])
        base = fitter.initial([np.zeros((1, 0))])
        gain, level, position, spread, smooth = (
            np.full((1, 1, 1), value)
            for value in (levels.gain, levels.level, levels.position, levels.spread, levels.smooth)
        )
        several = SeveralLevels(gain, level, position, spread, None, smooth)
        likelihood = Likelihoods(
            fitter.lines, self._problem.curvature, base.products, several, base.points.sensor_log_gain
        )
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


_LARGEST = 100.0  # % of the response: what changes less than that nowhere is not told from the nuisances
_ROUNDS = 20


@dataclass(frozen=True)
class Power:
    """The least change of the response, as a root mean square over all rows [%], from which on a mechanism shows."""

    mechanism: str
    smallest_visible_percent: float


def power(signatures: Signatures, explanation: Explanation, supported: int) -> list[Power]:
    """Of each mechanism that could show here at all, the most visible first.

    Parameters
    ----------
    signatures
        Of the recordings' design.
    explanation
        Whose noise levels are taken: the answer's.
    supported
        How many mechanisms the campaign supports, among which the prior is shared.
    """
    if not signatures.owners:
        return []
    chi2 = np.diag(signatures.left(explanation.best.levels)[0])
    least = least_chi2(supported, least_evidence(explanation))
    visible = []
    for name in dict.fromkeys(signatures.owners):
        typical = signatures.owners.index(name)
        if chi2[typical] <= 0:
            continue
        percent = signatures.percent[typical] * float(np.sqrt(least / chi2[typical]))
        if percent < _LARGEST:
            visible.append(Power(name, percent))
    return sorted(visible, key=lambda entry: entry.smallest_visible_percent)


def least_chi2(supported: int, shows: float) -> float:
    """The χ² from which on one of so many mechanisms is expected to be named, which must bring `shows` nats."""
    odds = max(log_prior(0, supported) - log_prior(1, supported) + np.log(EXPLAINED / (1 - EXPLAINED)), shows)
    chi2 = 2 * odds
    for _ in range(_ROUNDS):
        chi2 = 2 * odds + np.log1p(chi2)
    return float(chi2)


@dataclass(frozen=True)
class HiddenShift:
    """A mechanism that would not be named at its typical strength, and the logarithm of the factor by which d33 would
    be off; `declared`: it is a wrong declared number."""

    mechanism: str
    log_factor: float
    declared: bool

    @property
    def percent(self) -> float:
        """Of d33."""
        return float(100 * np.expm1(self.log_factor))


def hidden_shifts(
    problem: FittingProblem,
    signatures: Signatures,
    explanation: Explanation,
    supported: int,
    other_kinds: frozenset[Kind] = frozenset(),
) -> list[HiddenShift]:
    """Of FRFs: the mechanisms that are not in the stated `explanation` and would not be named beside it.

    `supported` is how many the campaign supports, among which the prior is shared; recordings of `other_kinds` tell the
    mechanisms that act on them too, with which the signatures do not count.
    """
    if problem.lines.curves or not signatures.owners:
        return []
    levels = explanation.best.levels
    chi2 = np.diag(signatures.left(levels)[0])
    off = _of_d33(signatures, levels)
    least = least_chi2(supported, least_evidence(explanation))
    return [
        HiddenShift(name, float(off[place]), problem.lines.mechanisms[name].stage is Stage.DECLARED)
        for name, place in signatures.typical.items()
        if name not in explanation.names
        and chi2[place] < least
        and not other_kinds & {*problem.lines.mechanisms[name].kinds}
    ]


def _of_d33(signatures: Signatures, levels: NoiseLevels) -> Floats:
    """What ln d33 is off by for each signature (signatures,)."""
    return signatures.project_out_parameters(levels)[signatures.nuisances.index("d33")]


_LEAST_CHI2 = 9.0
_TWINS = 0.98
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


def confounding(signatures: Signatures) -> list[Confounding]:
    """What cannot be told apart here; mechanisms that the campaign does not support at all are not listed."""
    owners = signatures.owners
    if not owners:
        return []
    left, own = signatures.left(NoiseLevels(USUAL_GAIN, 1.0, 0.0, SENSOR_SPREAD, smooth=TYPICAL))
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


_BEGINNING = 0.1  # of each curve's displacement


def without_seating(
    campaign: Campaign, names: Sequence[str], table: SigmaTable
) -> tuple[FittingProblem, Finding] | None:
    """The rest of the curves and the finding, where the rest speaks no more for the stiffening among `names`.

    A law that needs a curve's whole history, such as relaxation, cannot be fitted to the rest: nothing is tried.
    """
    imitated = [name for name in names if name in CATALOGUE and CATALOGUE[name].imitated_by_seating]
    if not imitated or any(CATALOGUE[name].needs_history for name in names):
        return None
    if not all(_is_pressed(entry) for entry in campaign.recordings):
        return None
    rows = curve_lines(_without_beginning(campaign), "compression")
    if rows.recordings < len(campaign.recordings):
        return None
    problem = FittingProblem(rows, table)
    (stiffer,) = problem.explain([Request(tuple(names))])
    (plain,) = problem.explain([Request(tuple(name for name in names if name not in imitated))])
    assert stiffer is not None
    assert plain is not None
    if stiffer.log_evidence - plain.log_evidence > SHOWS:
        return None
    arguments = {"percent": 100 * _BEGINNING, "mechanisms": " and ".join(imitated)}
    return problem, Finding(Reason.SEATING, "", "displacement_mm", arguments)


def _is_pressed(entry: Recording) -> bool:
    """Whether it is pressed, and no farther pulled."""
    assert isinstance(entry, CompressionRecording)
    moved = entry.displacement_mm - entry.displacement_mm[0]
    return float(moved.max()) > -float(moved.min())


def _without_beginning(campaign: Campaign) -> Campaign:
    kept = []
    for entry in campaign.recordings:
        assert isinstance(entry, CompressionRecording)
        moved = np.abs(entry.displacement_mm - entry.displacement_mm[0])
        kept.append(samples_of(entry, moved > _BEGINNING * np.nanmax(moved)))
    return replace(campaign, recordings=tuple(kept))
