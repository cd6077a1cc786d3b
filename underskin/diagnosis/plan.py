"""The next experiment: which recordings best separate the explanations that survive.

Candidates lie within the rig's limits: the preloads between and a little beyond those used, the spheres, places,
amplitudes and dwells of the campaign. Each surviving explanation predicts the logarithm of every candidate's response,
with the covariance s² I + J Σ Jᵀ: s the gain scatter and the positioning's share, Σ what is still unknown of its own
parameters (d33 among them, so that a common factor tells nothing). Recordings are added one by one, repeats allowed,
the one first that raises the expected probability of deciding most; of equal ones that whose sphere is mounted already.
That probability is simulated: truth drawn from the posterior, recordings from its prediction, and the posterior
updated: the chance that the true explanation then holds at least 0.8.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from underskin.diagnosis.explanation import Explanation, Workbench
from underskin.diagnosis.search import Answer, Search
from underskin.mechanisms.frf_design import frf_recordings
from underskin.mechanisms.mechanism import Unsupported
from underskin.mechanisms.model import compose
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.units import Floats

DECIDED = 0.8
SEED = 20180206
_SIMULATIONS = 2000
_MOST_RECORDINGS = 8
_ENOUGH = 0.95
_LEAST_GAIN = 0.01  # in the probability of deciding that a further recording must bring
_SURVIVES = 0.02
_RIVALS = 4
_FURTHER = 1.25  # beyond the highest preload used
_PRELOADS = 8


@dataclass(frozen=True)
class Limits:
    """What the rig can do, in lab units; what is left None is inferred from the campaign."""

    preload_n: tuple[float, float] | None = None
    indenter_radius_mm: Sequence[float] | None = None
    dynamic_force_n: Sequence[float] | None = None
    dwell_s: Sequence[float] | None = None
    offset_mm: Sequence[float] | None = None
    recordings: int = _MOST_RECORDINGS
    minutes_per_recording: float = 5.0
    minutes_per_indenter: float = 10.0


def plan(bench: Workbench, search: Search, limits: Limits) -> dict[str, Any]:
    """The recordings to make, in lab units, what they cost, and the chance that they decide; empty where all is."""
    if bench.lines.curves:
        return {}
    surviving = [answer for answer in search.answers if answer.explanation and answer.probability > _SURVIVES][:_RIVALS]
    if len(surviving) < 2:
        return {}
    candidates = _inside(bench, _candidates(bench.lines.campaign, limits))
    if not candidates:
        return {}
    rivals, responses, unknown = _responses(bench, surviving, candidates)
    if len(rivals) < 2:
        return {}
    levels = rivals[0][1].best.at.marginal.levels
    scatter = float(np.hypot(levels.gain, levels.position / _thickness(bench)))
    prior = np.array([answer.probability for answer, _ in rivals])
    outlook = _Outlook(responses, unknown, scatter, prior / prior.sum())
    chosen, chance = _choose(outlook, candidates, limits)
    if not chosen:
        return {}
    spheres = {candidates[index].indenter_radius_mm for index in chosen}
    return {
        "recordings": _described(candidates, chosen),
        "separates": [list(answer.names) for answer, _ in rivals],
        "probability_of_deciding": round(chance, 3),
        "without_it": round(outlook.deciding([]), 3),
        "minutes": round(len(chosen) * limits.minutes_per_recording + len(spheres) * limits.minutes_per_indenter, 1),
        "statement": _statement(candidates, chosen, chance, rivals),
    }


def _thickness(bench: Workbench) -> float:
    thickness = bench.lines.campaign.skin.thickness_mm
    assert thickness is not None
    return 1e-3 * thickness


def _candidates(campaign: Campaign, limits: Limits) -> list[FrfRecording]:
    """One recording at every combination of what the rig can do, at the sensor that was recorded most."""
    entries = frf_recordings(campaign)
    sensors = [entry.sensor for entry in entries]
    sensor = max(dict.fromkeys(sensors), key=sensors.count)
    place = next((known.x_mm, known.y_mm) for known in campaign.skin.sensors if known.id == sensor)
    used = [entry.preload_n for entry in entries]
    low, high = limits.preload_n or (min(used), _FURTHER * max(used))
    spheres = limits.indenter_radius_mm or sorted({entry.indenter_radius_mm for entry in entries})
    amplitudes = limits.dynamic_force_n or sorted({entry.dynamic_force_n for entry in entries})
    dwells = list(limits.dwell_s) if limits.dwell_s else _ends([entry.dwell_s for entry in entries])
    thickness = campaign.skin.thickness_mm
    assert thickness is not None
    offsets = limits.offset_mm if limits.offset_mm is not None else (0.0, 0.5 * thickness, thickness)
    cycles = [entry.load_cycles for entry in entries]
    last = None if None in cycles else max(cycle for cycle in cycles if cycle is not None)
    found = []
    for number, (force, sphere, amplitude, dwell, offset) in enumerate(
        itertools.product(np.geomspace(low, high, _PRELOADS), spheres, _two(amplitudes), dwells, offsets)
    ):
        if amplitude >= force:
            continue
        found.append(
            replace(
                entries[0],
                id=f"candidate {number}",
                sensor=sensor,
                indenter_radius_mm=sphere,
                preload_n=float(f"{force:.3g}"),
                dynamic_force_n=amplitude,
                dwell_s=dwell,
                load_cycles=last,
                position_mm=(place[0] + round(offset, 3), place[1]),
                frequency_hz=np.array([30.0]),
                frf_re_pc_per_n=np.array([1.0]),
                frf_im_pc_per_n=np.array([0.0]),
                coherence=None,
                sample_rate_hz=None,
                force_n=None,
                charge_pc=None,
            )
        )
    return found


def _inside(bench: Workbench, candidates: list[FrfRecording]) -> list[FrfRecording]:
    """Those within the tables as the skin is declared: beyond, no prediction is worth planning with."""
    model = compose([], replace(bench.lines.campaign, recordings=tuple(candidates)), bench.table, "frf")
    return [entry for entry, inside in zip(candidates, model.valid, strict=True) if inside]


def _two(values: Sequence[float]) -> list[float]:
    return sorted({min(values), max(values)})


def _ends(values: Sequence[float | None]) -> list[float | None]:
    known = [value for value in values if value is not None]
    return [*sorted({min(known), max(known)})] if len(known) == len(values) else [None]


def _responses(
    bench: Workbench, surviving: Sequence[Answer], candidates: Sequence[FrfRecording]
) -> tuple[list[tuple[Answer, Explanation]], Floats, list[Floats]]:
    """The rivals that can be predicted there, log |response| (rivals, candidates), and of each rival W (candidates,
    parameters) with W Wᵀ the covariance of that from its own parameters."""
    # The campaign's own recordings go along, so that each model has the parameters that it was fitted with.
    campaign = bench.collapsed.campaign
    together = replace(campaign, recordings=(*campaign.recordings, *candidates))
    own = len(campaign.recordings)
    rivals, responses, unknown = [], [], []
    for answer in surviving:
        explanation = answer.explanation
        assert explanation is not None
        try:
            model = compose(explanation.names, together, bench.table, "frf")
        except Unsupported:
            continue
        if len(model.parameters) != len(explanation.point.fit):
            continue
        prediction = model.predict(explanation.point.fit)
        value = prediction.value[own:]
        slopes = (prediction.slopes[explanation.best.fitter.places][:, own:] / value).real
        rivals.append((answer, explanation))
        responses.append(np.log(np.maximum(np.abs(value), 1e-30)))
        unknown.append(slopes.T @ np.linalg.cholesky(explanation.best.covariance))
    return rivals, np.array(responses), unknown


@dataclass(frozen=True)
class _Outlook:
    """What the rivals predict, and how sure each is."""

    responses: Floats
    unknown: list[Floats]
    scatter: float
    prior: Floats

    def deciding(self, chosen: Sequence[int]) -> float:
        """The simulated chance that the true explanation holds `DECIDED` after these recordings."""
        random = np.random.default_rng(SEED)
        truth = random.choice(len(self.prior), size=_SIMULATIONS, p=self.prior)
        noise = random.normal(size=(_SIMULATIONS, len(chosen)))
        means = self.responses[:, chosen]
        roots = []
        for unknown in self.unknown:
            rows = unknown[chosen]
            roots.append(np.linalg.cholesky(rows @ rows.T + self.scatter**2 * np.eye(len(chosen))))
        measured = means[truth] + np.einsum("nab,nb->na", np.array(roots)[truth], noise)
        log_posterior = np.empty((_SIMULATIONS, len(self.prior)))
        for rival, root in enumerate(roots):
            white = np.linalg.solve(root, (measured - means[rival]).T)
            log_posterior[:, rival] = -0.5 * (white**2).sum(axis=0) - np.log(np.diag(root)).sum()
        log_posterior += np.log(self.prior)
        log_posterior -= np.logaddexp.reduce(log_posterior, axis=1)[:, None]
        return float((np.exp(log_posterior[np.arange(_SIMULATIONS), truth]) >= DECIDED).mean())

    @property
    def promising(self) -> list[int]:
        """Candidates at the ends of what separates each pair of rivals: only these are worth a simulation."""
        found: list[int] = []
        for first, second in itertools.combinations(range(len(self.prior)), 2):
            order = np.argsort(self.responses[first] - self.responses[second], kind="stable").tolist()
            found += [*order[:2], *order[-2:]]
        return list(dict.fromkeys(found))


def _choose(outlook: _Outlook, candidates: Sequence[FrfRecording], limits: Limits) -> tuple[list[int], float]:
    """Recordings, two and then one at a time, until they decide or a further one brings too little."""
    promising = outlook.promising
    chosen: list[int] = []
    best = outlook.deciding([])
    steps: list[tuple[int, ...]] = list(itertools.combinations_with_replacement(promising, 2))
    while len(chosen) < limits.recordings and best < _ENOUGH:
        mounted = {candidates[index].indenter_radius_mm for index in chosen}
        rated = []
        for step in steps:
            new = {candidates[index].indenter_radius_mm for index in step} - mounted
            rated.append((round(outlook.deciding([*chosen, *step]), 3), -len(new), tuple(-index for index in step)))
        chance, _, picked = max(rated)
        if chance < best + _LEAST_GAIN:
            break
        chosen += [-index for index in picked]
        best = chance
        steps = [(index,) for index in promising]
    return chosen, best


def _described(candidates: Sequence[FrfRecording], chosen: Sequence[int]) -> list[dict[str, Any]]:
    found = []
    for index in sorted(set(chosen)):
        entry = candidates[index]
        described: Mapping[str, Any] = {
            "sensor": entry.sensor,
            "indenter_radius_mm": entry.indenter_radius_mm,
            "preload_n": entry.preload_n,
            "dynamic_force_n": entry.dynamic_force_n,
            "position_mm": list(entry.position_mm or ()),
            "dwell_s": entry.dwell_s,
            "repeats": list(chosen).count(index),
        }
        found.append({name: value for name, value in described.items() if value is not None})
    return found


def _statement(
    candidates: Sequence[FrfRecording],
    chosen: Sequence[int],
    chance: float,
    rivals: Sequence[tuple[Answer, Explanation]],
) -> str:
    entry = candidates[chosen[0]]
    names = " from ".join(" and ".join(answer.names) for answer, _ in rivals[:2])
    return (
        f"{len(chosen)} recording(s), first with the {entry.indenter_radius_mm:g} mm sphere at {entry.preload_n:g} N, "
        f"should tell {names} with a probability of {100 * chance:.0f} %."
    )
