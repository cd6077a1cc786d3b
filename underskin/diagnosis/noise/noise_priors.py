"""Priors of the noise that every hypothesis shares.

- gain scatter of a recording (standard deviation of its logarithm): log-uniform from 1 to 5 %, falling off outside to
  a tenth at 0.3 and at 11 %: a careful rig is better than 1 %, a poor one worse than 5 %;
- positioning scatter, in x and y: zero with probability 0.7, else log-uniform from 0.05 to 0.3 mm, falling off outside
  to a tenth at 0.02 and at 0.6 mm;
- line noise: its level as estimated from the lines' roughness, times a factor near 1.
"""

from dataclasses import dataclass

import numpy as np

from underskin.recordings.usual_scatter import GAIN_RANGE, POSITION_RANGE
from underskin.units import Floats

GAIN_FALL = (0.6, 0.35)  # sd of the logarithm below and above
POSITION_FALL = (0.4, 0.3)  # the same of positions


@dataclass(frozen=True)
class Plateau:
    """A density of a logarithm: constant between two values, falling off as half Gaussians outside.

    Normal where the two are one; uniform where `area`, the integral of what is 1 at the plateau, counts only the range.
    """

    low: float
    high: float
    fall_low: float
    fall_high: float
    area: float

    @classmethod
    def of(cls, limits: tuple[float, float], falls: tuple[float, float]) -> "Plateau":
        """From the values, not their logarithms."""
        low, high = np.log(limits).tolist()
        return cls(low, high, *falls, high - low + float(np.sqrt(np.pi / 2)) * sum(falls))

    @classmethod
    def normal(cls, mean: float, sd: float) -> "Plateau":
        """A normal density."""
        return cls(mean, mean, sd, sd, sd * float(np.sqrt(2 * np.pi)))

    @property
    def middle(self) -> float:
        """The middle of the constant part."""
        return (self.low + self.high) / 2

    @property
    def row(self) -> tuple[float, float, float, float, float]:
        """Its numbers, with the logarithm of the area, as compiled functions take them."""
        return self.low, self.high, self.fall_low, self.fall_high, float(np.log(self.area))

    def log_density(self, x: Floats | float) -> Floats:
        """The logarithm of the density."""
        outside = np.maximum((self.low - x) / self.fall_low, 0.0) + np.maximum((x - self.high) / self.fall_high, 0.0)
        return np.asarray(-0.5 * outside**2 - np.log(self.area))


START_GAIN = 0.03  # scatter of gains while nothing was fitted yet
GAIN_PRIOR = Plateau.of(GAIN_RANGE, GAIN_FALL)
POSITION_PRIOR = Plateau.of(POSITION_RANGE, POSITION_FALL)
# No rig's: something that nobody named moves the recordings
UNUSUAL_GAIN = Plateau.of((0.12, 0.5), (0.12, 0.12))
UNUSUAL_POSITION = Plateau.of((0.6e-3, 2e-3), (0.15, 0.15))


def level_prior(log_level_sd: float) -> Plateau:
    """Of the factor on the lines' deviations; wider than the estimate's own error: noise is not quite normal."""
    return Plateau.normal(0.0, float(np.hypot(log_level_sd, 0.05)))
