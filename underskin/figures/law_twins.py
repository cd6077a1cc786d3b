"""Which mechanisms act alike on FRFs of the reference campaign, so that they are mistaken for each other.

Each mechanism at its usual strength changes the relative response of every line. What d33, and the modulus and the
thickness within their priors, can take up of it is taken out, at 1 % noise on each line; the cosine between what is
left of two mechanisms says how alike they are: 1 where these recordings cannot tell them apart.
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
    """Another mechanism and how alike it acts (0 to 1); axes of a campaign, and kinds of recordings, on which one of
    the two shows alone."""

    name: str
    alike: float
    axes: tuple[str, ...]
    kinds: tuple[str, ...]


def law_twins(table: SigmaTable) -> Mapping[str, tuple[Twin, ...]]:
    """Of each mechanism of FRFs that changes their mean all the others, the most alike first."""
    campaign = reference_campaign("frf")
    base = compose([], campaign, table)
    start = [entry.start for entry in base.parameters]
    prediction = base.predict(np.array(start))
    nuisances = np.array([_relative(slope, prediction.value) for slope in prediction.slopes])
    priors = np.diag([entry.prior.sd**-2 if isinstance(entry.prior, Normal) else 0.0 for entry in base.parameters])
    taken_up = np.linalg.inv(nuisances @ nuisances.T + priors) @ nuisances
    left: dict[str, Floats] = {}
    for name, mechanism in CATALOGUE.items():
        if "frf" not in mechanism.kinds or not mechanism.moves_predictions:
            continue
        try:
            model = compose([name], campaign, table)
        except Unsupported:
            continue
        own = model.parameters[: len(model.parameters) - len(base.parameters)]
        if any(entry.moves_covariance for entry in own):
            continue
        fit = np.array([*(usual(entry) for entry in own), *start])
        change = _relative(model.predict(fit).value - prediction.value, prediction.value)
        change = change - nuisances.T @ (taken_up @ change)
        left[name] = change / np.linalg.norm(change)
    return {name: _alike(name, left) for name in left}


def _relative(change: Array, response: Array) -> Floats:
    """Real and imaginary part over the response's magnitude, in standard deviations of the noise."""
    relative = change / np.abs(response) / _NOISE
    return np.concatenate([relative.real, relative.imag])


def _alike(name: str, left: Mapping[str, Floats]) -> tuple[Twin, ...]:
    own = CATALOGUE[name]
    twins = []
    for other in left:
        if other != name:
            rival = CATALOGUE[other]
            alone = _in_one(_axes(own), _axes(rival)), _in_one(own.kinds, rival.kinds)
            twins.append(Twin(other, float(abs(left[name] @ left[other])), *alone))
    return tuple(sorted(twins, key=lambda twin: -twin.alike))


def _axes(mechanism: Mechanism) -> tuple[str, ...]:
    """Axes on which it shows; a lab's own law of lines names those that it reads, and turns the phase too."""
    return (*mechanism.axes, "phase") if mechanism.stage is Stage.LINES else mechanism.axes


def _in_one(own: Sequence[str], others: Sequence[str]) -> tuple[str, ...]:
    """What stands in one of two lists alone, in their order."""
    return tuple(entry for entry in dict.fromkeys((*own, *others)) if (entry in own) != (entry in others))
