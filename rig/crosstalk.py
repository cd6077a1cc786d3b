"""Which sensors contribute to the charge of a recording, and with which weight."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.layer import Floats, base_stress

_NEIGHBOUR = 1.2  # pitches


@dataclass(frozen=True)
class SensorWeights:
    """The sensors that contribute to each recording: weights in its charge, distances from the sphere [mm].

    Both arrays are (rows, sensors); without crosstalk there is one column, the recording's own sensor.
    """

    distance: Floats
    weight: Floats

    @classmethod
    def of(
        cls, centres: Floats, sensor: NDArray[np.intp], position: Floats, gains: Floats, fraction: float
    ) -> "SensorWeights":
        """The recording's own sensor and, with crosstalk, those within 1.2 pitch of it.

        Parameters
        ----------
        centres : (sensors, 2), mm
        sensor : (rows,), index of the sensor of each recording
        position : (rows, 2), mm, of the sphere
        gains : (sensors,), true d33 of each sensor over that of the skin
        fraction : share of a neighbour's charge that is added
        """
        apart = np.hypot(*(centres[:, None] - centres).transpose(2, 0, 1))
        pitch = apart[apart > 0].min(initial=np.inf)
        weights = np.where((apart > 0) & (apart < _NEIGHBOUR * pitch), fraction, 0.0) * gains
        weights = weights / gains[:, None] + np.eye(len(centres))
        used = np.flatnonzero((weights[sensor] != 0).any(axis=0)) if fraction else None
        if used is None:
            return cls(np.hypot(*(position - centres[sensor]).T)[:, None], np.ones((len(sensor), 1)))
        distance = np.hypot(*(position[:, None] - centres[used]).transpose(2, 0, 1))
        return cls(distance, weights[np.ix_(sensor, used)])

    def sigma(self, spectrum: Floats, contact: NDArray[np.intp], rt: float, thickness: float) -> Floats:
        """σ of each contributing sensor (rows, sensors); 0 where its weight is 0.

        `spectrum` (contacts, wavenumbers) is that of the distinct contacts, `contact` (rows,) the contact of each
        recording; sensor radius `rt` and `thickness` in mm.
        """
        result = np.zeros(self.distance.shape)
        for column in range(self.distance.shape[1]):
            rows = np.flatnonzero(self.weight[:, column])
            offset = self.distance[rows, column] / thickness
            result[rows, column] = base_stress(spectrum[contact[rows]], rt / thickness, offset)
        return result
