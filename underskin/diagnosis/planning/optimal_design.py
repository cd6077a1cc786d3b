"""The next experiment: the recordings that best separate the surviving explanations.

Candidates lie within the rig's limits, given or inferred from the campaign; where these separate nothing and the user
gave none, within what most rigs can do. Each surviving explanation predicts the logarithm of every candidate's
response, with the covariance S + J Σ Jᵀ: S from the scatter of gains, positions and lines, Σ the posterior covariance
of its own parameters (including d33, so that a common factor separates nothing). Recordings are added one by one,
repeats allowed, each time the one that raises the expected probability of deciding most; of equal ones, one whose
sphere is already mounted. That probability is simulated: truth drawn from the posterior, recordings from its
prediction, then the posterior updated; it is the chance that the true explanation reaches `EXPLAINED`.
"""

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.diagnosis.data.names import CERTAIN, EXPLAINED, NAMED
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.planning.rig_limits import RigLimits, candidates, inferred, wider
from underskin.diagnosis.selection.answers import Answer, Search
from underskin.mechanisms.base import Kind, Unsupported
from underskin.mechanisms.models.composed import compose
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Conditions, FrfConditions
from underskin.units import Floats, Mask

SEED = 20180206
_SIMULATIONS = 2000
_LEAST_GAIN = 0.01  # in the probability of deciding, by a further recording
_RIVALS = 4
_PROMISING = 0.3  # probability of deciding below which no recordings are proposed
WRONG_MODULUS = "modulus_error"
_OF_FRFS = (  # what can be varied
    *("preload_n", "indenter_radius_mm", "position_mm", "dwell_s", "sensor", "dynamic_force_n", "load_cycles"),
    "frequency_hz",
)
_OF_CURVES = ("displacement_mm", "force_n", "time_s")
_VARIED: Mapping[Kind, Collection[str]] = {
    "frf": _OF_FRFS,
    "indentation": ("indenter_radius_mm", *_OF_CURVES),
    "compression": ("sample_height_mm", "sample_diameter_mm", *_OF_CURVES),
}
_MODULUS = ("youngs_modulus", "modulus_factor")  # their logarithms add up to that of E
_OF_BLOCK = 0.03  # relative, of E by a block: 2 % from piece to piece, and its fit


@dataclass(frozen=True)
class NextRecordings:
    """The recordings to make next and their value; no recordings where none separates the rivals."""

    rivals: Sequence[Sequence[str]]  # the mechanisms of each
    recordings: Sequence[FrfConditions] = ()  # repeats are neighbours and the same object
    first: FrfConditions | None = None  # the most informative recording
    probability: float = 0.0  # of deciding
    without: float = 0.0  # the same without further recordings
    minutes: float = 0.0
    beyond: bool = False  # the recordings go beyond the range of the campaign
    differ_on: Collection[str] = ()  # axes on which the rivals differ, where there are no recordings
    outside: bool = False  # all recordings within the limits lie beyond the tables
    block: float | None = None  # probability that E from a block decides whether the modulus is wrong, if promising


def plan(problem: FittingProblem, search: Search, limits: RigLimits) -> NextRecordings | None:
    """The recordings to make, their cost, and the probability that they decide; None if all is decided."""
    surviving = [answer for answer in search.answers if answer.probability > NAMED][:_RIVALS]
    if len(surviving) < 2:
        return None
    outside = False
    if not problem.lines.curves:
        within = inferred(problem.lines.campaign, limits)
        for beyond, rig in enumerate([within] if limits.given else [within, wider(problem.lines.campaign, within)]):
            planned = _planned(problem, surviving, rig, bool(beyond))
            if planned and planned.probability >= _PROMISING:
                return replace(planned, block=_by_block(problem, surviving))
            outside = planned is not None and planned.outside
    if surviving[0].probability >= EXPLAINED:
        return None
    nothing = _nothing_to_plan(surviving, _VARIED[problem.kind])
    return replace(nothing, outside=outside, block=_by_block(problem, surviving))


def _planned(
    problem: FittingProblem, surviving: Sequence[Answer], limits: RigLimits, beyond: bool
) -> NextRecordings | None:
    """The best recordings within these limits; None where none improves the decision, without recordings where the
    tables hold none of them."""
    allowed = candidates(problem.lines.campaign, limits)
    rivals, outlook, allowed = _outlook(problem, surviving, allowed)
    if len(rivals) < 2:
        return None
    if not allowed:
        return NextRecordings([answer.names for answer in rivals], outside=True)
    chosen, chance = _choose(outlook, allowed, limits)
    if not chosen:
        return None
    spheres = {allowed[index].indenter_radius_mm for index in chosen}
    return NextRecordings(
        rivals=[answer.names for answer in rivals],
        recordings=[allowed[index] for index in sorted(chosen)],
        first=allowed[chosen[0]],
        probability=chance,
        without=outlook.deciding([]),
        minutes=len(chosen) * limits.minutes_per_recording + len(spheres) * limits.minutes_per_indenter,
        beyond=beyond,
    )


def _by_block(problem: FittingProblem, surviving: Sequence[Answer]) -> float | None:
    """The probability that E from a compressed block or an indentation decides whether the declared modulus is wrong.

    Rivals with and without a wrong modulus count as equally probable. None where it is not promising, where the rivals
    agree on it, or where curves give E already.
    """
    rivals = [answer for answer in surviving if answer.explanation is not None]
    wrong = np.array([WRONG_MODULUS in answer.names for answer in rivals])
    if problem.lines.curves or problem.other_kinds is not None or not wrong.any() or wrong.all():
        return None
    moduli = [_log_modulus(answer.explanation) for answer in rivals if answer.explanation is not None]
    responses = np.array([[mean] for mean, _ in moduli])
    unknown = [np.array([[deviation]]) for _, deviation in moduli]
    probability = np.array([answer.probability for answer in rivals])
    prior = 0.5 * probability / np.where(wrong, probability[wrong].sum(), probability[~wrong].sum())
    outlook = _Outlook(responses, unknown, np.full_like(responses, _OF_BLOCK**2), prior)
    chance = outlook.deciding([0], wrong[:, None] == wrong)
    return chance if chance >= _PROMISING else None


def _log_modulus(explanation: Explanation) -> tuple[float, float]:
    """ln of E over the declared modulus under an explanation, and its standard deviation."""
    names = [parameter.name for parameter in explanation.model.parameters]
    indices = [names.index(name) for name in _MODULUS if name in names]
    variance = float(explanation.best.covariance_of(indices).sum())
    return float(explanation.point.fit[indices].sum()), float(np.sqrt(max(variance, 0.0)))


def _nothing_to_plan(surviving: Sequence[Answer], varied: Collection[str]) -> NextRecordings:
    """A plan without recordings, with the axes, of those that can be `varied`, on which the rivals would differ."""
    names = [answer.names for answer in surviving]
    listed = [mechanisms for mechanisms in names if set(mechanisms) <= set(CATALOGUE)]
    axes = [{axis for name in mechanisms for axis in CATALOGUE[name].axes if axis in varied} for mechanisms in listed]
    common = set.intersection(*axes) if axes else set()
    return NextRecordings(names, differ_on=set().union(*axes) - common)


def _outlook(
    problem: FittingProblem, surviving: Sequence[Answer], allowed: Sequence[FrfConditions]
) -> tuple[list[Answer], "_Outlook", list[FrfConditions]]:
    """The rivals that can predict the candidates, their predictions, and the candidates within all tables."""
    # The campaign's recordings are included, so that each model has the parameters that it was fitted with.
    campaign = problem.collapsed.campaign
    together = Conditions(campaign.name, campaign.skin, (*campaign.recordings, *allowed))
    count = len(campaign.recordings)
    inside = np.ones(len(allowed), dtype=bool)
    rivals = []
    for answer in surviving:
        explanation = answer.explanation
        if explanation is None:
            continue
        try:
            model = compose(explanation.names, together, problem.table, "frf")
        except Unsupported:
            continue
        if len(model.parameters) == len(explanation.point.fit):
            prediction = model.predict(explanation.point.fit)
            inside &= prediction.inside[count:] & (np.abs(prediction.value[count:]) > 0)
            rivals.append((answer, explanation, prediction))
    rows = count + np.flatnonzero(inside)
    line = float(np.median(np.add.reduceat(problem.lines.deviation**-2.0, problem.lines.first)) ** -0.5)
    responses, unknown, scatter = [], [], []
    for _, explanation, prediction in rivals:
        levels, value = explanation.best.levels, prediction.value[rows]
        slopes = (prediction.slopes[explanation.best.hypothesis.mean_indices][:, rows] / value).real
        responses.append(np.log(np.abs(value)))
        unknown.append(slopes.T @ np.linalg.cholesky(explanation.best.covariance))
        variance = levels.gain**2 + (levels.level * line / np.abs(value)) ** 2
        if prediction.position_slopes is not None:
            variance += levels.position**2 * (np.abs(prediction.position_slopes[:, rows] / value) ** 2).sum(axis=0)
        scatter.append(variance)
    prior = np.array([answer.probability for answer, *_ in rivals])
    outlook = _Outlook(np.array(responses), unknown, np.array(scatter), prior / prior.sum())
    return [answer for answer, *_ in rivals], outlook, [allowed[index] for index in np.flatnonzero(inside).tolist()]


@dataclass(frozen=True)
class _Outlook:
    """Predictions of the rivals with their uncertainty and prior."""

    responses: Floats  # log |response| (rivals, candidates)
    unknown: list[Floats]  # of each rival W (candidates, parameters), W Wᵀ being the covariance from its parameters
    scatter: Floats  # variance of the logarithm of a new recording (rivals, candidates)
    prior: Floats  # (rivals,)

    def deciding(self, chosen: Sequence[int], alike: Mask | None = None) -> float:
        """The simulated probability that the true explanation, with those that are `alike` (rivals, rivals), reaches
        `EXPLAINED` after these recordings."""
        random = np.random.default_rng(SEED)
        truth = random.choice(len(self.prior), size=_SIMULATIONS, p=self.prior)
        noise = random.normal(size=(_SIMULATIONS, len(chosen)))
        means = self.responses[:, chosen]
        roots = []
        for unknown, scatter in zip(self.unknown, self.scatter, strict=True):
            rows = unknown[chosen]
            roots.append(np.linalg.cholesky(rows @ rows.T + np.diag(scatter[chosen])))
        measured = means[truth] + np.einsum("nab,nb->na", np.array(roots)[truth], noise)
        log_posterior = np.empty((_SIMULATIONS, len(self.prior)))
        for rival, root in enumerate(roots):
            white = np.linalg.solve(root, (measured - means[rival]).T)
            log_posterior[:, rival] = -0.5 * (white**2).sum(axis=0) - np.log(np.diag(root)).sum()
        log_posterior += np.log(self.prior)
        log_posterior -= np.logaddexp.reduce(log_posterior, axis=1)[:, None]
        counted = np.eye(len(self.prior), dtype=bool) if alike is None else alike
        return float(((np.exp(log_posterior) * counted[truth]).sum(axis=1) >= EXPLAINED).mean())

    @property
    def promising(self) -> list[int]:
        """Candidates where the predictions of a pair of rivals differ most in either direction; only these are
        simulated."""
        ends: list[int] = []
        for first, second in itertools.combinations(range(len(self.prior)), 2):
            order = np.argsort(self.responses[first] - self.responses[second], kind="stable").tolist()
            ends += [*order[:2], *order[-2:]]
        return list(dict.fromkeys(ends))


def _choose(outlook: _Outlook, candidates: Sequence[FrfConditions], limits: RigLimits) -> tuple[list[int], float]:
    """Indices of the recordings, chosen two and then one at a time until they decide or a further one gains too little,
    and the probability of deciding."""
    promising = outlook.promising
    chosen: list[int] = []
    best = outlook.deciding([])
    steps: list[tuple[int, ...]] = list(itertools.combinations_with_replacement(promising, 2))
    while len(chosen) < limits.recordings and best < CERTAIN:
        mounted = {candidates[index].indenter_radius_mm for index in chosen}
        rated = []
        for step in steps:
            new = {candidates[index].indenter_radius_mm for index in step} - mounted
            rated.append((round(outlook.deciding([*chosen, *step]), 3), -len(new), tuple(-index for index in step)))
        chance, _, step = max(rated)
        if chance < best + _LEAST_GAIN:
            break
        chosen += [-index for index in step]
        best = chance
        steps = [(index,) for index in promising]
    return chosen, best
