"""What may move the levels of recordings, how probable each is beforehand, and the evidence of levels over all of it.

Either nothing does, or one mechanism of the catalogue, or something smooth (`levels`): several mechanisms, or a law
that nobody listed. A mechanism's changes Δ of ln level, at K points drawn from the priors of its parameters, stand in
the model of levels as a normal change of the same second moments, Σ Δ Δᵀ/K. Beside nothing and beside each mechanism,
the declared modulus and thickness may be off as far as their priors allow.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import log

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logsumexp
from scipy.stats import qmc

from underskin.diagnosis.screening.levels import BENDS, SCATTER, SCATTER_PRIOR, Levels
from underskin.mechanisms.base import Unsupported
from underskin.mechanisms.models.composed import compose
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.parameter import Normal
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.conditions import Conditions
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Floats

_NOTHING, _ONE, _SMOOTH = 0.6, 0.25, 0.15  # prior probabilities
_DRAWS = 8
_LEAST_RESPONSE = 1e-3  # of the base model's


@dataclass(frozen=True, eq=False)
class Cause:
    """The logarithm of its prior, and what it adds to X: columns times their prior standard deviations
    (recordings, columns)."""

    log_prior: float
    columns: Floats


@dataclass(frozen=True, eq=False)
class Explained:
    """ln evidence of each alternative (alternatives,), and what is expected of its coefficients, over their prior
    standard deviations (alternatives, columns)."""

    evidence: Floats
    coefficient: Floats


def causes_of(campaign: Campaign, entries: Sequence[FrfRecording], levels: Levels, table: SigmaTable) -> list[Cause]:
    """All that may move the levels of a campaign's recordings, those that `levels` has."""
    contacts = tuple(entry.without_measurements(frequency_hz=np.ones(1)) for entry in entries)
    conditions = Conditions("contacts", campaign.skin, contacts)
    base = compose((), conditions, table, "frf")
    start = np.array([parameter.start for parameter in base.parameters])
    prediction = base.predict(start)
    value = prediction.value[levels.number]
    declared = np.stack(
        [
            (slope[levels.number] / value).real * parameter.prior.sd
            for parameter, slope in zip(base.parameters, prediction.slopes, strict=True)
            if isinstance(parameter.prior, Normal)
        ],
        axis=1,
    )
    laws = []
    for name, mechanism in CATALOGUE.items():
        if "frf" not in mechanism.kinds or mechanism.needs_lines:
            continue
        try:
            model = compose((name,), conditions, table, "frf")
        except Unsupported:
            continue
        assert isinstance(model, FrfModel)
        if not any(parameter.moves_covariance for parameter in model.parameters):
            relative = np.abs([changed[levels.number] / value for changed in model.values(_drawn(model, start))])
            change = np.log(np.maximum(relative, _LEAST_RESPONSE))
            laws.append(change.T / len(change) ** 0.5)
    bends = [bend for bend in BENDS if bend > 0]
    return [
        Cause(log(_NOTHING), declared),
        *(Cause(log(_ONE / len(laws)), np.hstack([declared, law])) for law in laws),
        *(Cause(log(_SMOOTH / len(bends)), bend * levels.smooth) for bend in bends),
    ]


def explained(levels: Levels, causes: Sequence[Cause], further: Floats) -> Explained:
    """The levels by each alternative, over all causes, at the best s, t, p (`levels`) of each.

    `further` (alternatives, recordings, columns) is what each alternative adds to X, times prior standard deviations.
    """
    each = [_by_cause(levels, cause.columns, further) for cause in causes]
    joint = np.array([cause.log_prior + one.evidence for cause, one in zip(causes, each, strict=True)])
    total = logsumexp(joint, axis=0)
    share = np.exp(joint - total)
    coefficient = (share[:, :, None] * np.array([one.coefficient for one in each])).sum(axis=0)
    return Explained(np.asarray(total), np.asarray(coefficient))


def _by_cause(levels: Levels, columns: Floats, further: Floats) -> Explained:
    """The same by one cause."""
    alternatives, recordings, width = further.shape
    right = np.column_stack([levels.value, further.transpose(1, 0, 2).reshape(recordings, -1)])
    evidence, coefficient = np.full(alternatives, -np.inf), np.zeros((alternatives, width))
    for spread, place in product(levels.spreads, levels.places):
        fixed = levels.expected(spread, columns) + np.diag((levels.slope * place) ** 2)
        for scatter in SCATTER:
            root = np.linalg.cholesky(fixed + scatter**2 * np.eye(recordings))
            white = solve_triangular(root, right, lower=True, check_finite=False)
            value, own = white[:, 0], white[:, 1:].reshape(recordings, alternatives, width).transpose(1, 0, 2)
            precision = np.eye(width) + own.transpose(0, 2, 1) @ own
            along = value @ own
            best = np.linalg.solve(precision, along[:, :, None])[:, :, 0]
            nothing = -0.5 * value @ value - np.log(np.diag(root)).sum() + SCATTER_PRIOR.log_density(log(scatter))
            density = nothing + 0.5 * (along * best).sum(axis=1) - 0.5 * np.linalg.slogdet(precision)[1]
            better = density > evidence
            evidence = np.where(better, density, evidence)
            coefficient = np.where(better[:, None], best, coefficient)
    return Explained(evidence, coefficient)


def _drawn(model: FrfModel, start: Floats) -> Array:
    """Points (points, parameters) from the priors of a mechanism's parameters, declared values as they are."""
    own = model.parameters[: len(model.parameters) - len(start)]
    if not own:
        return start[None, :]
    share = qmc.Halton(len(own), scramble=False).random(_DRAWS + 1)[1:]  # the first is 0
    points = [[parameter.quantile(float(one)) for parameter, one in zip(own, row, strict=True)] for row in share]
    return np.hstack([points, np.tile(start, (len(points), 1))])
