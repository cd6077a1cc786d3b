"""What models of curves share: samples as rectangular arrays, forces at many points, derivatives by differences.

Arrays are (points, curves, samples): points of the fit coordinates; curves shorter than the longest stay where they
end. Derivatives are central differences, exact to about 1e-8: all points aside are worked out together with the one in
the middle, whose samples decide which are in contact. Contact points move one curve each, all of them at once.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from underskin.mechanisms.base import Kind, Mechanism, Values
from underskin.mechanisms.models.composition import Composition, Prediction
from underskin.mechanisms.models.curve_state import Curve
from underskin.mechanisms.models.pickup import Pickup
from underskin.mechanisms.parameter import Parameter
from underskin.recordings.conditions import Conditions, CurveConditions
from underskin.units import Floats, Indices, Mask, to_si

_STEP = 1e-5  # of a logarithm or of a prior's width
_AT_ONCE = 1_000_000  # samples of all points


class CurveModel(ABC):
    """The force of curves under a set of mechanisms; rows are all samples, one recording after another."""

    sensor: Indices | None = None
    pickup: Pickup | None = None

    def __init__(
        self,
        mechanisms: Sequence[Mechanism],
        conditions: Conditions,
        kind: Kind,
        recordings: Sequence[CurveConditions],
        nuisances: Sequence[Parameter],
    ) -> None:
        """Arrange the samples; `nuisances` end with the recordings' contact points."""
        self._composition = Composition(mechanisms, conditions, kind, nuisances)
        self.names = tuple(mechanism.name for mechanism in mechanisms)
        self.parameters = self._composition.parameters
        self._mechanisms = self._composition.mechanisms
        self._skin = conditions.skin
        lengths = np.array([len(entry.displacement_mm) for entry in recordings], dtype=np.intp)
        self.recording = np.repeat(np.arange(len(recordings)), lengths)
        self.valid = np.ones(len(self.recording), dtype=bool)
        self._sample = np.arange(len(self.recording)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        self.displacement = self._arranged([to_si("displacement_mm", one.displacement_mm) for one in recordings])
        self.time = self._arranged([times_of(entry) for entry in recordings])
        count = len(self.parameters) - len(recordings)
        self.contact_points = np.arange(count, len(self.parameters))
        # What moves together in the differences: each shared parameter, then all contact points.
        self._moved = [np.array([place]) for place in range(count)] + [self.contact_points]
        bounds = np.array([entry.bounds for entry in self.parameters]).reshape(-1, 2)
        logarithmic = np.array([entry.scale == "log" for entry in self.parameters])
        self._low, self._high = bounds.T
        self._step = np.where(logarithmic, _STEP, _STEP * np.minimum(1.0, self._high - self._low))

    @abstractmethod
    def _curve(self, own: dict[str, Values], nuisances: Values) -> Curve:
        """What governs the curves, its numbers (points, 1), as the mechanisms make it."""

    @abstractmethod
    def _force(self, curve: Curve, contact: Floats, held: Mask | None) -> tuple[Floats, Mask, Mask]:
        """F (points, curves, samples) [N], which samples are in contact, and which of these the tables reach.

        `contact` (points, curves, 1) [m]; the contacts are as `held`, where that is given.
        """

    def forces(self, fit: Floats, held: Mask | None = None) -> Floats:
        """F (points, rows) [N] at points (points, parameters); `held` (rows,) are in contact, where that is known."""
        at_once = max(_AT_ONCE // self.displacement.size, 1)
        known = self._arranged_mask(held)
        parts = []
        for first in range(0, len(fit), at_once):
            part = fit[first : first + at_once]
            held_there = None if known is None else np.broadcast_to(known, (len(part), *known.shape))
            parts.append(self._forces(part, held_there)[0])
        return np.concatenate(parts)[:, self.recording, self._sample]

    def forces_and_slopes(self, fit: Floats, held: Mask | None = None) -> tuple[Floats, Floats]:
        """F (points, rows) [N], and its derivatives by the fit coordinates (points, parameters, rows)."""
        known = self._arranged_mask(held)
        values, slopes, _ = zip(*(self._differentiated(point, known) for point in fit), strict=True)
        return np.stack(values), np.stack(slopes)

    def _arranged_mask(self, held: Mask | None) -> Mask | None:
        """Of rows (rows,) as curves (curves, samples)."""
        if held is None:
            return None
        arranged = np.zeros(self.displacement.shape, dtype=bool)
        arranged[self.recording, self._sample] = held
        return arranged

    def predict(self, fit: Floats) -> Prediction:
        """All samples at one point of the fit coordinates (parameters,); raises InvalidInput for another length."""
        value, slopes, inside = self._differentiated(np.asarray(fit, dtype=float))
        return Prediction(value, slopes, None, None, None, inside)

    def _forces(self, fit: Floats, held: Mask | None = None) -> tuple[Floats, Mask, Mask]:
        own, nuisances, _ = self._composition.values(fit, slopes=False)
        contact = 1e-3 * fit[:, self.contact_points, None]
        return self._force(self._curve(own, nuisances), contact, held)

    def _differentiated(self, fit: Floats, known: Mask | None = None) -> tuple[Floats, Floats, Mask]:
        """F (rows,) at one point, its derivatives (parameters, rows), and which rows are inside; `known` (curves,
        samples) are in contact, where that is given."""
        middle, held, inside = self._forces(fit[None], None if known is None else known[None])
        points = np.tile(fit, (2 * len(self._moved), 1))
        for number, places in enumerate(self._moved):
            points[2 * number, places] += self._step[places]
            points[2 * number + 1, places] -= self._step[places]
        # On one side alone where the other is out of bounds
        points = np.clip(points, np.minimum(self._low, fit), np.maximum(self._high, fit))
        aside, _, _ = self._forces(points, np.broadcast_to(held, (len(points), *held.shape[1:])))
        rows = self.recording, self._sample
        slopes = np.zeros((len(self.parameters), len(self.recording)))
        for number, places in enumerate(self._moved):
            change = (aside[2 * number] - aside[2 * number + 1])[rows]
            way = points[2 * number, places] - points[2 * number + 1, places]
            if places is self.contact_points:
                slopes[places[self.recording], np.arange(len(self.recording))] = change / way[self.recording]
            else:
                slopes[places[0]] = change / way[0]
        return middle[0][rows], slopes, inside[0][rows]

    def _arranged(self, columns: Sequence[Floats]) -> Floats:
        """Columns of the curves as one array (curves, samples), each staying at its last value."""
        longest = max(map(len, columns))
        return np.stack([np.pad(column, (0, longest - len(column)), mode="edge") for column in columns])


def times_of(recording: CurveConditions) -> Floats:
    """time_s of the samples; their numbers where a recording has none, and no mechanism asks."""
    if recording.time_s is None:
        return np.arange(float(len(recording.displacement_mm)))
    return recording.time_s


def declared_modulus(youngs_modulus_mpa: float | None) -> float:
    """What the parameter youngs_modulus multiplies [Pa]: the declared modulus, or 1 MPa."""
    return float(to_si("youngs_modulus_mpa", 1.0 if youngs_modulus_mpa is None else youngs_modulus_mpa))
