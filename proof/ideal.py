"""The ceiling: a diagnoser that owns the rig's equations, noise levels, parameter ranges and shares of what is hidden.

Its likelihood: each recording's amplitude has its gain scatter and, to second order in the mean and first in the
variance, its scatter of position; lines have the rig's own noise; d33 is uniform in its logarithm from 8 to 30 pC/N;
E, h and the sensors' gains are as declared. Its hypotheses are: nothing, every effect of the catalogue, every one
that is not in it, and where two effects were drawn every pair that shares one with them. Each hypothesis is evaluated
on a coarse grid, from the true values of the parameters that it shares with the truth; the six best, the three best
with a wrong answer, and the true one are maximised (Nelder–Mead) and integrated by the Laplace approximation. It knows
where the true answer lies and never overlooks it: it is an upper bound for any diagnosis.

The gain in χ² of the truth over every other answer, both at their maximum, says whether the truth can be identified.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import logsumexp
from scipy.stats import qmc

from proof.cases import DrawnCase
from proof.ideal_laws import Supposition, suppositions
from proof.judge import UNKNOWN as UNKNOWN_ANSWER
from proof.names import distinct_names
from rig.draw import CATALOGUED, SHARES, UNKNOWN, drawn, record
from rig.effects import Values, of
from rig.errors import RigError
from rig.recorded import RecordedLines
from rig.strengths import of_frf
from underskin.units import Floats

_D33 = np.log([8.0, 30.0])  # as the rig draws it
_SCALES = np.linspace(_D33[0], _D33[1], 1001)
_WIDE = np.linspace(_D33[0] - 1.0, _D33[1] + 1.0, 2501)  # of d33 times a sensor's gain
_REFINED, _RIVALS = 6, 3  # of all, and of those that do not give the true answer
_COARSE = {0: 1, 1: 12, 2: 32, 3: 64}
_ROOT_2PI = np.sqrt(2 * np.pi)
_NODE = np.sqrt(3.0)  # of a Gauss–Hermite rule of three points; its outer weights are 1/6
_PICKUP_WIDTH_HZ = 1.5


@dataclass(frozen=True)
class _Amplitudes:
    """The amplitude of each recording given the shape: estimate and variance (rows,), and the remaining part of ln
    p."""

    estimate: Floats
    variance: Floats
    rest: float


class Likelihood:
    """ln p(lines | effects, nothing else but d33 unknown), up to a constant."""

    def __init__(self, recorded: RecordedLines) -> None:
        self.recorded = recorded
        self.noise = recorded.response.experiment.noise

    def __call__(self, effects: dict[str, Values]) -> float:
        """The log-likelihood, −∞ if the rig cannot carry the effects out."""
        try:
            return self._log(effects)
        except (RigError, ValueError, FloatingPointError):
            return -np.inf

    def _log(self, effects: dict[str, Values]) -> float:
        response = self.recorded.response
        experiment = replace(
            response.experiment, effects=effects, skin=replace(response.experiment.skin, d33_pc_per_n=1.0)
        )
        nowhere = np.zeros_like(response.missed_mm)
        plain = replace(
            response, experiment=experiment, missed_mm=nowhere, sensor_gains=np.ones_like(response.sensor_gains)
        )
        mean, variance = plain.level, np.zeros(len(nowhere))
        shape = plain.lines(self.recorded.frequency_hz) / mean[:, None]
        if self.noise.position_mm:
            for step in _NODE * self.noise.position_mm * np.eye(2):
                up, down = (plain.elsewhere(nowhere + sign * step).level for sign in (1, -1))
                mean = mean + (up + down - 2 * plain.level) / 6
                variance = variance + ((up - down) / (2 * _NODE)) ** 2 + ((up + down - 2 * plain.level) ** 2) / 18
        scatter = variance + self.noise.gain**2 * (mean**2 + variance)
        amplitudes = self._amplitudes(shape, effects)
        spread = of(effects, "sensor_spread", "sd")
        if not spread:
            return amplitudes.rest + float(
                logsumexp(self._at(_SCALES, mean, scatter, amplitudes).sum(axis=0)) - np.log(len(_SCALES))
            )
        sensors, index = np.unique(response.plan.sensor, return_inverse=True)
        log_terms = np.zeros((len(sensors), len(_WIDE)))
        np.add.at(log_terms, index, self._at(_WIDE, mean, scatter, amplitudes))
        top = log_terms.max(axis=1, keepdims=True)
        coarse = _SCALES[::10]
        weight = np.exp(-0.5 * ((_WIDE - coarse[:, None]) / spread) ** 2) * (
            (_WIDE[1] - _WIDE[0]) / (spread * _ROOT_2PI)
        )
        log_sum = np.log(np.maximum(np.exp(log_terms - top) @ weight.T, 1e-300)) + top
        return amplitudes.rest + float(logsumexp(log_sum.sum(axis=0)) - np.log(len(coarse)))

    def _at(self, scales: Floats, mean: Floats, scatter: Floats, amplitudes: _Amplitudes) -> Floats:
        """ln p of each recording at each ln d33."""
        d33 = np.exp(scales)
        variance = scatter[:, None] * d33**2 + amplitudes.variance[:, None]
        return -0.5 * (np.log(variance) + (amplitudes.estimate[:, None] - mean[:, None] * d33) ** 2 / variance)

    def _amplitudes(self, shape: np.ndarray, effects: dict[str, Values]) -> _Amplitudes:
        y, weight = self.recorded.measured, 1 / self.recorded.line_variance
        pairs = [(shape, shape), (shape, y), (y, y)]
        ss, sy, yy = ((weight * a.conj() * b).sum(axis=1) for a, b in pairs)
        lost = 0.0
        if "mains_pickup" in effects:
            frequency, mains = self.recorded.frequency_hz, of(effects, "mains_pickup", "mains_hz")
            p = sum(k / (1 + ((frequency - n * mains) / _PICKUP_WIDTH_HZ) ** 2) for n, k in ((1, 1.0), (3, 1 / 3)))
            half = 0.5 * (of(effects, "mains_pickup", "charge_pc") / self.recorded.response.plan.dynamic_n) ** 2
            pp, ps, py = (weight * p * p).sum(axis=1), (weight * p * shape).sum(axis=1), (weight * p * y).sum(axis=1)
            inner = pp + 1 / half
            ss, sy, yy = ss - np.abs(ps) ** 2 / inner, sy - ps.conj() * py / inner, yy - np.abs(py) ** 2 / inner
            lost = float(np.log1p(half * pp).sum())
        rest = -0.5 * float((yy.real - sy.real**2 / ss.real + np.log(ss.real)).sum()) - lost
        return _Amplitudes(sy.real / ss.real, 1 / ss.real, rest)


@dataclass(frozen=True)
class Tried:
    """A hypothesis at its maximum: ln p there, and ln ∫ p over the unit cube."""

    supposed: Supposition
    log_likelihood: float
    log_evidence: float


def diagnosed(case: DrawnCase) -> dict[str, Any]:
    """The ideal diagnoser's answer on a drawn campaign, its probability, and `chi2_over_rivals`: by how much 2 ln p of
    the truth is more than that of any other answer; None where nothing is hidden."""
    description = drawn(case.seed, case.number, case.what)
    recorded = record(description)
    truth: dict[str, Values] = {name: dict(values) for name, values in recorded.response.on.items()}
    likelihood = Likelihood(recorded)
    sets = _sets(tuple(truth))
    ranges = of_frf(description)
    laws = {names: suppositions(names, ranges) for names in sets}
    supposed = [supposition for entries in laws.values() for supposition in entries if _starts_at(supposition, truth)]
    coarse = [(supposition, *_best_of(supposition, likelihood, truth)) for supposition in supposed]
    coarse.sort(key=lambda supposition: -supposition[2])
    hidden = _answer(tuple(sorted(truth)))
    rivals = [supposition for supposition in coarse if _answer(supposition[0].names) != hidden]
    chosen = {id(supposition): supposition for supposition in (*coarse[:_REFINED], *rivals[:_RIVALS])}
    starts = [(supposition, coordinates) for supposition, coordinates, _ in chosen.values()]
    starts += [
        (supposition, coordinates)
        for supposition, *_ in coarse
        if (coordinates := supposition.positions_of(truth)) is not None
    ]
    tried = [_integrated(supposition, likelihood, coordinates) for supposition, coordinates in starts]
    evidence: dict[tuple[str, ...], float] = {}
    for fit in tried:
        names = fit.supposed.names
        evidence[names] = max(evidence.get(names, -np.inf), fit.log_evidence)
    weight: dict[tuple[str, ...], list[float]] = {}
    for names, value in evidence.items():
        weight.setdefault(_answer(names), []).append(value - np.log(len(laws[names])) + sets[names])
    total = {answer: float(logsumexp(values)) for answer, values in weight.items()}
    leader = max(total, key=lambda answer: total[answer])
    return {
        "answer": list(leader),
        "probability": float(np.exp(total[leader] - logsumexp(list(total.values())))),
        "chi2_over_rivals": _over_rivals(tried, hidden) if truth else None,
    }


def _starts_at(supposed: Supposition, truth: Mapping[str, Values]) -> bool:
    """Whether a pair has the law and the sign of the true effect that it shares; a single may have any."""
    if len(supposed.names) < 2:
        return True
    shared_known = np.isfinite(supposed.positions_of_shared(truth))
    shared = [coordinate.effect in truth for coordinate in supposed.coordinates]
    return bool(shared_known[shared].all())


def _answer(names: tuple[str, ...]) -> tuple[str, ...]:
    return (UNKNOWN_ANSWER,) if set(names) & set(UNKNOWN) else distinct_names(names)


def _over_rivals(tried: list[Tried], truth: tuple[str, ...]) -> float:
    """2 ln p of the truth's best less that of the best of any other answer."""
    true = [fit.log_likelihood for fit in tried if _answer(fit.supposed.names) == truth]
    rivals = [fit.log_likelihood for fit in tried if _answer(fit.supposed.names) != truth]
    return round(2 * (max(true) - max(rivals)), 2)


def _sets(truth: tuple[str, ...]) -> dict[tuple[str, ...], float]:
    """The hypotheses (sorted sets) with the logarithm of their priors: the shares that the rig draws."""
    singles, pairs = len(CATALOGUED), len(CATALOGUED) * (len(CATALOGUED) - 1) / 2
    sets: dict[tuple[str, ...], float] = {(): np.log(SHARES["none"])}
    sets |= {(name,): np.log(SHARES["single"] / singles) for name in CATALOGUED}
    sets |= {(name,): np.log(SHARES["unknown"] / len(UNKNOWN)) for name in UNKNOWN}
    if len(truth) == 2:
        for name in truth:
            for catalogued in CATALOGUED:
                if catalogued != name:
                    first, second = sorted((name, catalogued))
                    sets[first, second] = np.log(SHARES["pair"] / pairs)
    return sets


def _best_of(supposed: Supposition, likelihood: Likelihood, truth: Mapping[str, Values]) -> tuple[Floats, float]:
    """The best of evenly spread points (Halton), with true effects held at their true values, and ln p there."""
    shared_known = supposed.positions_of_shared(truth)
    free = np.isnan(shared_known)
    if not free.any():
        return shared_known, likelihood(supposed.effects(shared_known))
    places = np.tile(shared_known, (_COARSE.get(int(free.sum()), 64), 1))
    places[:, free] = qmc.Halton(int(free.sum()), scramble=False).random(len(places) + 1)[1:]
    values = [likelihood(supposed.effects(coordinates)) for coordinates in places]
    best = int(np.argmax(values))
    return places[best], values[best]


def _integrated(supposed: Supposition, likelihood: Likelihood, start: Floats) -> Tried:
    """The best near a start, and ln ∫ p over the unit cube by Laplace's method there; no wider than the cube."""
    size = len(supposed.coordinates)

    def loss(coordinates: Floats) -> float:
        return -likelihood(supposed.effects(coordinates)) if np.all((coordinates >= 0) & (coordinates <= 1)) else np.inf

    start = np.clip(start, 0.0, 1.0)
    if not size or not np.isfinite(loss(start)):
        return Tried(supposed, -loss(start), -loss(start))
    simplex = np.vstack(
        [start, *(start + np.where(start[k] > 0.5, -0.04, 0.04) * np.eye(size)[k] for k in range(size))]
    )
    minimum = minimize(
        loss, start, method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": 45 * size, "xatol": 1e-4, "fatol": 0.05},
    )  # fmt: skip
    best, least = np.asarray(minimum.x), float(minimum.fun)
    steps = np.array([_step(loss, best, least, axis) for axis in np.eye(size)])
    inward = np.where(best > 0.5, -1.0, 1.0) * steps
    hessian = np.empty((size, size))
    single = np.array([loss(best + inward[k] * np.eye(size)[k]) - least for k in range(size)])
    for i in range(size):
        hessian[i, i] = 2 * single[i] / inward[i] ** 2
        for j in range(i):
            both = loss(best + inward[i] * np.eye(size)[i] + inward[j] * np.eye(size)[j]) - least
            hessian[i, j] = hessian[j, i] = (both - single[i] - single[j]) / (inward[i] * inward[j])
    hessian = np.where(np.isfinite(hessian), hessian, np.diag(inward**-2.0))  # infinite outside the rig's range
    values = np.maximum(np.linalg.eigvalsh(hessian), 2 * np.pi)
    return Tried(supposed, -least, -least + 0.5 * float((np.log(2 * np.pi) - np.log(values)).sum()))


def _step(loss: Any, best: Floats, least: float, axis: Floats) -> float:
    """The distance into the cube over which the loss grows by one half."""
    sign = -1.0 if float(best @ axis) > 0.5 else 1.0
    step = 1e-4
    while step < 0.4 and loss(best + sign * step * axis) - least < 0.5:
        step *= 1.6
    return step
