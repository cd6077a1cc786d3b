"""Least-squares fits of the base model, of the true law and of its rivals, with known noise.

Recordings: y = linear columns + Phi(u(x)), fitted by Levenberg-Marquardt over many shapes at once. A law other than on
the gain may be referred to any state, so a constant c0 with the prior `REFERENCE` is added to its u.

Lines: G = A_i H(f), the real amplitude A_i of each recording free, H minimum phase.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from rig.unlisted.bench import SPECTRAL, Companion, Measurement, State, companion_response
from rig.unlisted.design import Design
from rig.unlisted.forms import Shape
from rig.unlisted.laws import multiplies
from rig.unlisted.observed import Observed, Table
from rig.unlisted.response import MinimumPhase, bounds, frequency_law, starts

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Index = npt.NDArray[np.intp]

REFERENCE = {"modulus": 0.2, "force": 0.2, "contact_radius": 0.07, "thickness": 0.06, "position": 0.3,
             "frequency_response": 0.05, "gain": 1e-6}  # fmt: skip
"""Standard deviation of c0: logarithms, mm for a position, radians for a loss angle."""
FIRST, LEADING, MORE = 4, 6, 14
"""Iterations for every shape, the number of leading starts of each form, and the iterations that these get on top."""


@dataclass(frozen=True)
class Fit:
    """One shape fitted."""

    shape: Shape
    coefficients: Array
    reference: float
    chi2: float


def whitener(observed: Observed, rows: Index) -> Array:
    """W with chi2 = |W r|^2, the free linear columns projected out."""
    key = rows.tobytes()
    if key not in observed.whiteners:
        factor = np.linalg.cholesky(observed.covariance[np.ix_(rows, rows)])
        white = np.asarray(np.linalg.solve(factor, np.eye(rows.size)))
        if observed.linear.shape[0]:
            q, _ = np.linalg.qr(white @ observed.linear[:, rows].T)
            white = np.asarray(white - q @ (q.T @ white))
        observed.whiteners[key] = white
    return observed.whiteners[key]


def base_chi2(observed: Observed, rows: Index | None = None) -> float:
    """chi2 of the base model at its best."""
    keep = np.arange(observed.design.count) if rows is None else rows
    return float(((whitener(observed, keep) @ observed.residual[keep]) ** 2).sum())


def _link(total: Array, direct: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
    inside = np.maximum(1.0 + total, 0.05)
    u = np.where(direct[:, None], total, np.log(inside))
    return np.asarray(u), np.asarray(np.where(direct[:, None], 1.0, (1.0 + total > 0.05) / inside))


def fit_shapes(
    observed: Observed,
    acts_on: str,
    along: str,
    shapes: list[Shape],
    start: Array | None = None,
    rows: Index | None = None,
) -> list[Fit]:
    """The leading fits of each form, from both signs (and from `start`, if given)."""
    keep = np.arange(observed.design.count) if rows is None else rows
    table, target = observed.phi(acts_on, along).rows(keep), observed.residual[keep]
    white, prior = whitener(observed, keep), REFERENCE[acts_on]
    width = max(s.basis.shape[0] for s in shapes)
    basis = np.zeros((len(shapes), width, keep.size))
    for i, s in enumerate(shapes):
        basis[i, : s.basis.shape[0]] = s.basis[:, keep]
    direct = np.array([s.direct or not multiplies(acts_on) for s in shapes])
    size = 0.15 * observed.design.thickness_mm if acts_on == "position" else 0.1
    first = np.zeros((len(shapes), width))
    first[:, 0] = size
    guesses = [first, -first]
    if start is not None:
        guesses.append(np.tile(np.pad(start, (0, width - start.size)), (len(shapes), 1)))
    which = np.tile(np.arange(len(shapes)), len(guesses))
    c = np.concatenate(guesses)
    c = np.concatenate([c, np.full((c.shape[0], 1), 0.05 * prior)], axis=1)
    c, chi2 = _minimise(c, basis[which], direct[which], table, target, white, prior, FIRST)
    forms = np.array([shapes[i].form for i in which])
    ranks = [np.flatnonzero(forms == f)[np.argsort(chi2[forms == f])] for f in sorted(set(forms))]
    leading = np.concatenate([rank[:LEADING] for rank in ranks])
    chosen = which[leading]
    c, chi2 = _minimise(c[leading], basis[chosen], direct[chosen], table, target, white, prior, MORE)
    fits = [(shapes[i], c[n], float(chi2[n])) for n, i in enumerate(chosen)]
    return [Fit(s, at[: s.basis.shape[0]], float(at[-1]), least) for s, at, least in fits]


def _minimise(
    c: Array,
    basis: Array,
    direct: npt.NDArray[np.bool_],
    table: Table,
    target: Array,
    white: Array,
    prior: float,
    iterations: int,
) -> tuple[Array, Array]:
    damping = np.full(c.shape[0], 1e-2)
    penalty = np.full(c.shape[1], 1e-8)
    penalty[-1] = 1.0 / prior**2

    def cost(at: Array) -> tuple[Array, Array, Array, Array]:
        u, du = _link(np.einsum("gk,gkn->gn", at[:, :-1], basis), direct)
        value, slope = table(u + at[:, -1:])
        r = (target - value) @ white.T
        return (r**2).sum(axis=1) + (at**2 * penalty).sum(axis=1), r, slope, du

    now, r, slope, du = cost(c)
    for _ in range(iterations):
        columns = np.concatenate([basis * (slope * du)[:, None, :], slope[:, None, :]], axis=1) @ white.T
        normal = columns @ columns.transpose(0, 2, 1) + np.diag(penalty)
        gradient = np.einsum("gkn,gn->gk", columns, r) - c * penalty
        diagonal = np.einsum("gkk->gk", normal)
        damped = normal + np.eye(c.shape[1]) * (damping[:, None] * diagonal + 1e-12)[:, None, :]
        trial = c + np.linalg.solve(damped, gradient[..., None])[..., 0]
        then, r2, slope2, du2 = cost(trial)
        better = then < now
        c, now = np.where(better[:, None], trial, c), np.where(better, then, now)
        r, slope, du = (np.where(better[:, None], new, old) for new, old in ((r2, r), (slope2, slope), (du2, du)))
        damping = np.where(better, damping * 0.2, damping * 8.0)
    return np.asarray(c), np.asarray(now)


def value(fit: Fit, observed: Observed, acts_on: str, along: str) -> Array:
    """Phi(u) of a fit at every recording."""
    direct = np.array([fit.shape.direct or not multiplies(acts_on)])
    u, _ = _link((fit.coefficients @ fit.shape.basis)[None], direct)
    return np.asarray(observed.phi(acts_on, along)(u + fit.reference)[0][0])


def predict(observed: Observed, change: Array, train: Index, test: Index) -> Array:
    """Best linear prediction of the residual at `test` from `train`, with Phi(u) = `change` given everywhere."""
    inner = observed.covariance[np.ix_(train, train)]
    remaining = observed.residual[train] - change[train]
    x = observed.linear[:, train].T
    solved = np.linalg.solve(inner, np.column_stack([remaining, x]))
    beta = np.linalg.solve(x.T @ solved[:, 1:], x.T @ solved[:, 0]) if x.shape[1] else np.zeros(0)
    cross = observed.covariance[np.ix_(test, train)]
    return np.asarray(change[test] + observed.linear[:, test].T @ beta + cross @ (solved[:, 0] - solved[:, 1:] @ beta))


class Lines:
    """The spectral half of a measurement: G = A_i H(f; p, companion)."""

    def __init__(
        self, design: Design, data: Measurement, companion: Companion | None, truth: State, rows: Index | None = None
    ) -> None:
        self.design, self.truth = design, truth
        self.keep = np.arange(design.count) if rows is None else rows
        self.frf = data.frf[self.keep]
        self.root = 1.0 / np.sqrt(data.line_variance[self.keep] * np.abs(data.exact[self.keep]) ** 2)
        self.phase = MinimumPhase(design.frequency_hz)
        self.companion = companion if companion is not None and companion.name in SPECTRAL else None
        self.extra = np.log(np.array(self.companion.parameters)) if self.companion else np.zeros(0)

    def response(self, form: str, p: Array) -> Complex:
        """H; p holds the law's parameters, then the logarithms of the companion's."""
        cut = p.size - self.extra.size
        h = frequency_law(form, p[:cut], self.phase)[None] if form else np.ones((1, self.design.frequency_hz.size))
        if self.companion is not None:
            h = h * companion_response(self.design, self.companion.name, np.exp(p[cut:]), self.truth)
        return np.asarray(np.broadcast_to(h, (self.design.count, h.shape[1])))

    def residual(self, form: str, p: Array) -> Array:
        """Whitened residuals of one form."""
        return self.misfit(self.response(form, p))

    def misfit(self, response: Complex, weight: Array | float = 1.0) -> Array:
        """Whitened residuals of any response (recordings, lines), weighted: real parts, then imaginary parts."""
        root = self.root * weight
        h, g = response[self.keep] * root, self.frf * root
        amplitude = (g * h.conj()).real.sum(axis=1) / (np.abs(h) ** 2).sum(axis=1)
        r = g - amplitude[:, None] * h
        return np.asarray(np.concatenate([r.real.ravel(), r.imag.ravel()]))

    def base(self) -> tuple[Array, float]:
        """The base model with its companion, if any: parameters and chi2."""
        if not self.extra.size:
            return self.extra, float((self.residual("", self.extra) ** 2).sum())
        solution = least_squares(partial(self.residual, ""), self.extra, max_nfev=25)
        return np.asarray(solution.x), 2.0 * float(solution.cost)

    def fit(self, form: str, start: Array | None = None) -> tuple[Array, float]:
        """The best fit of one form: the two best points of a grid (and `start`), refined."""
        low, high = bounds(form, self.design.frequency_hz)
        slack = np.full(self.extra.size, 3.0)
        low, high = np.concatenate([low, self.extra - slack]), np.concatenate([high, self.extra + slack])
        grid = [np.concatenate([s, self.extra]) for s in starts(form, self.design.frequency_hz)]
        ranked = sorted(grid, key=lambda p: float((self.residual(form, p) ** 2).sum()))[:2]
        if start is not None:
            ranked.append(np.concatenate([start, self.extra]))
        best: tuple[Array, float] | None = None
        for p in ranked:
            inside = np.clip(p, low + 1e-6, high - 1e-6)
            solution = least_squares(partial(self.residual, form), inside, bounds=(low, high), max_nfev=25)
            if best is None or 2.0 * solution.cost < best[1]:
                best = (np.asarray(solution.x), 2.0 * float(solution.cost))
        assert best is not None
        return best
