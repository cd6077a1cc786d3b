"""Mechanisms that act alike on FRFs of the reference campaign, and so are confused with each other.

Each mechanism at its usual strength changes the relative response of every line. The part that d33, and the modulus
and the thickness within their priors, can absorb is projected out, at 1 % noise on each line; the cosine between the
remainders of two mechanisms measures their similarity: 1 where these recordings cannot distinguish them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.figures.law_effect import usual
from underskin.mechanisms import CATALOGUE, Mechanism, Normal, Stage, Unsupported, compose
from underskin.mechanisms.reference_campaigns import reference_campaign
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Floats

_NOISE = 0.01  # of each line, relative


@dataclass(frozen=True)
class Twin:
    """Another mechanism and its similarity (0 to 1); axes of a campaign, and kinds of recordings, on which only one
    of the two shows."""

    name: str
    alike: float
    axes: tuple[str, ...]
    kinds: tuple[str, ...]


def law_twins(table: SigmaTable) -> Mapping[str, tuple[Twin, ...]]:
    """For each mechanism of FRFs that changes their mean all the others, the most similar first."""
    campaign = reference_campaign("frf")
    base = compose([], campaign, table)
    start = [parameter.start for parameter in base.parameters]
    prediction = base.predict(np.array(start))
    nuisances = np.array([_relative(slope, prediction.value) for slope in prediction.slopes])
    priors = np.diag(
        [parameter.prior.sd**-2 if isinstance(parameter.prior, Normal) else 0.0 for parameter in base.parameters]
    )
    projection = np.linalg.inv(nuisances @ nuisances.T + priors) @ nuisances
    directions: dict[str, Floats] = {}
    for name, mechanism in CATALOGUE.items():
        if not mechanism.acts_on_frfs or not mechanism.moves_predictions:
            continue
        try:
            model = compose([name], campaign, table)
        except Unsupported:
            continue
        parameters = model.parameters[: len(model.parameters) - len(base.parameters)]
        if any(parameter.moves_covariance for parameter in parameters):
            continue
        fit = np.array([*(usual(parameter) for parameter in parameters), *start])
        change = _relative(model.predict(fit).value - prediction.value, prediction.value)
        change = change - nuisances.T @ (projection @ change)
        directions[name] = change / np.linalg.norm(change)
    return {name: _ranked_twins(name, directions) for name in directions}


def _relative(change: Array, response: Array) -> Floats:
    """Real and imaginary part over the response's magnitude, in standard deviations of the noise."""
    relative = change / np.abs(response) / _NOISE
    return np.concatenate([relative.real, relative.imag])


def _ranked_twins(name: str, directions: Mapping[str, Floats]) -> tuple[Twin, ...]:
    mechanism = CATALOGUE[name]
    twins = []
    for other in directions:
        if other != name:
            rival = CATALOGUE[other]
            distinguishing = _in_only_one(_axes(mechanism), _axes(rival)), _in_only_one(mechanism.kinds, rival.kinds)
            twins.append(Twin(other, float(abs(directions[name] @ directions[other])), *distinguishing))
    return tuple(sorted(twins, key=lambda twin: -twin.alike))


def _axes(mechanism: Mechanism) -> tuple[str, ...]:
    """Axes on which it shows; a lab's own law of lines names those that it reads, and changes the phase too."""
    return (*mechanism.axes, "phase") if mechanism.stage is Stage.LINES else mechanism.axes


def _in_only_one(first: Sequence[str], second: Sequence[str]) -> tuple[str, ...]:
    """Names in only one of two lists, in their order."""
    return tuple(name for name in dict.fromkeys((*first, *second)) if (name in first) != (name in second))
