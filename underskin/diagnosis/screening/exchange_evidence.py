"""How probable the levels of recordings are with the labels of sensors exchanged from some recording on, and without.

A recording's level is
    y_i = d S_i(e) + N(0, (s d S_i)² + (p d |∂S_i/∂place|)² + (f d max S)²),
with S_i the response of the sensor that is taken to have answered, e the vector by which all contacts miss their
places, s what sensors, scatter and unnamed physics make of a level, p the scatter of places, and f what reaches a
sensor that is pressed nowhere near (its neighbours' charge). With probability ε a level is anything up to twice the
largest. The evidence is averaged over e, d, s, p and f, and over the recordings from which on the sensors may be
exchanged: one half for all of them, the other half evenly over the later ones.

ε bounds what a wrong label costs, so that the evidence of an exchange may be that of one sensor alone, while the other
one stays as wrong as it was. Each sensor's own gain, with the others exchanged, tells.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import log

import numpy as np
from scipy.special import logsumexp

from underskin.diagnosis.screening.displaced_response import DisplacedResponse, displaced_response
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.conditions import SkinDescription
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Indices

_ASTRAY = 1e-5  # ε
_DISTANCES_MM, _DIRECTIONS, _MISS_MM = (0.3, 0.7, 1.2, 1.8), 8, 0.7  # of e, and its prior standard deviation
_FREE = np.array(  # d over the usual one, s, p [mm], f
    [*product(np.exp(np.linspace(-0.6, 0.6, 9)), (0.05, 0.12, 0.3), (0.05, 0.3), (0.02, 0.1))]
)


@dataclass(frozen=True)
class Start:
    """From which of the sensors' recordings on, in time, they are exchanged, and by how much ln evidence gains: by all,
    and at least by each of them with the others exchanged."""

    first: int
    gain: float
    least: float


class ExchangeEvidence:
    """The evidence of exchanges among the sensors of a campaign."""

    def __init__(
        self, skin: SkinDescription, entries: Sequence[FrfRecording], level: Floats, largest: float, table: SigmaTable
    ) -> None:
        """Work out the evidence as given; `level` (recordings,) over the usual one at the `largest` S [C/N]."""
        self._skin, self._entries, self._table = skin, entries, table
        angles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        around = np.column_stack([np.cos(angles), np.sin(angles)])
        self._miss_mm = np.concatenate([np.zeros((1, 2)), *(distance * around for distance in _DISTANCES_MM)])
        own = self._response(entries, [entry.sensor for entry in entries])
        self._largest, self._level, self._own = largest, level, own
        self._total = np.stack([self._density(own, self._level, at).sum(axis=-1) for at in range(len(self._miss_mm))])
        self._total += self._prior[:, None]

    def exchange(self, own: Indices, others: Sequence[str]) -> Start:
        """The most probable start of an exchange; `own` are the sensors' recordings in time, `others` the sensor that
        each is of."""
        turned = self._response([self._entries[number] for number in own], others)
        given = DisplacedResponse(self._own.value[:, own], self._own.slope[:, own])
        level, places = self._level[own], range(len(self._miss_mm))
        change = np.stack([self._density(turned, level, at) - self._density(given, level, at) for at in places])
        since = np.cumsum(change[..., ::-1], axis=-1)[..., ::-1]
        evidence = logsumexp(self._total[..., None] + since, axis=(0, 1))
        prior = np.full(len(own), -log(2 * max(len(own) - 1, 1)))
        prior[0] = -log(2)
        weighed = evidence - logsumexp(self._total) + prior
        first = int(np.argmax(weighed))
        sensor = np.array([self._entries[number].sensor for number in own[first:]])
        without = [
            logsumexp(self._total + change[..., first:][..., sensor != name].sum(axis=-1)) for name in set(sensor)
        ]
        return Start(first, float(logsumexp(weighed)), float(evidence[first] - max(without)))

    @property
    def _prior(self) -> Floats:
        """Of e but for a constant (displacements,), which stand for areas."""
        distance = np.hypot(*self._miss_mm.T)
        area = np.maximum(distance, _DISTANCES_MM[0] / 2)
        return np.asarray(np.log(area) - distance**2 / (2 * _MISS_MM**2))

    def _response(self, entries: Sequence[FrfRecording], sensors: Sequence[str]) -> DisplacedResponse:
        return displaced_response(self._skin, entries, sensors, self._miss_mm, self._table)

    def _density(self, response: DisplacedResponse, level: Floats, at: int) -> Floats:
        """ln of that of each level under one displacement (d and noises, recordings)."""
        d, s, p, f = _FREE.T[:, :, None]
        value, slope = response.value[at] / self._largest, response.slope[at] / self._largest
        variance = d**2 * ((s * value) ** 2 + (p * slope) ** 2 + f**2)
        usual = np.exp(-0.5 * (level - d * value) ** 2 / variance) / np.sqrt(2 * np.pi * variance)
        return np.asarray(np.log((1 - _ASTRAY) * usual + 0.5 * _ASTRAY))
