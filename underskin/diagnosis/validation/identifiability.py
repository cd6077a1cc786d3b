"""Which mechanisms a campaign's design cannot tell from d33, E and h, or from each other; worked out before any fit.

By their signatures under the noise that is usual: the cosine between what the nuisances leave of two of them says
whether they are alike. What one mechanism typically does is held against all shapes of another.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np

from underskin.diagnosis.noise.correlated_error import TYPICAL
from underskin.diagnosis.noise.noise_levels import NoiseLevels
from underskin.diagnosis.selection.answers import Answer
from underskin.diagnosis.validation.signatures import Signatures
from underskin.mechanisms.models.composition import SENSOR_SPREAD
from underskin.recordings.usual_scatter import USUAL_GAIN

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
