"""The mains put charge on the sensors' leads, so lines at the mains' frequency and its multiples are off, the more the
weaker the dynamic force.

Law: a charge q at the mains' frequency and q/n at its n-th harmonic, each a line of width 1.5 Hz (the analysis
window's), whatever the dynamic force: an FRF error of q/Fd, complex, its phase independent in each recording. It enters
the covariance as pickup · pickupᵀ within a recording.

Assumptions: q is the standard deviation of each component over recordings; 50 or 60 Hz, whichever stands out in the
campaign's lines; harmonics up to the fifth.

Source: Ott, Electromagnetic Compatibility Engineering (2009), section 2.1 (capacitive coupling to leads).
"""

import numpy as np

from underskin.mechanisms.differentiated import Differentiated
from underskin.mechanisms.frf_design import FrfDesign, frf_recordings
from underskin.mechanisms.mechanism import Kind, Mechanism, Normal, Parameter, Values
from underskin.recordings.campaign import Campaign
from underskin.recordings.frf_estimation import Frf, lines_of
from underskin.units import Floats

_MAINS_HZ = (50.0, 60.0)
_HARMONICS = np.arange(1, 6)
_WIDTH_HZ = 1.5
_REACH_HZ = 3.0
_NEAR, _FAR = 0.3, 0.05  # of the shape
_LEAST_LINES = 3
_LEAST_STRAY = 1e-6  # relative; of recordings without noise


class MainsPickup(Mechanism):
    """See the module."""

    name = "mains_pickup"
    axes = ("frequency_hz", "dynamic_force_n")
    needs = "a line within 3 Hz of 50 or 60 Hz"

    def parameters(self, campaign: Campaign, kind: Kind = "frf") -> tuple[Parameter, ...]:
        """The charge."""
        return (
            Parameter(
                name="pickup_charge",
                unit="pC",
                low=1e-4,
                high=1e3,
                prior=Normal(-3.0, 1.5),
                scale="log",
                limit=0.0,
                reason="unshielded leads of some pF to mains at 230 V collect hundredths to tenths of a pC",
            ),
        )

    def unsupported(self, campaign: Campaign, kind: Kind) -> str | None:
        """Lines near the mains are needed."""
        for entry in frf_recordings(campaign):
            frequency = lines_of(entry).frequency
            if any(np.abs(frequency - mains).min() < _REACH_HZ for mains in _MAINS_HZ):
                return None
        return "no line lies within 3 Hz of 50 or 60 Hz (frequency_hz)"

    def pickup_shape(self, campaign: Campaign, design: FrfDesign) -> Floats:
        """The lines' shape over Fd [1/N]."""
        lines = [lines_of(entry) for entry in frf_recordings(campaign)]
        mains = max(_MAINS_HZ, key=lambda mains: sum(_excess(entry, mains) for entry in lines))
        return _shape(design.row_frequency, mains) / design.row_dynamic_force

    def pickup_charge(self, values: Values) -> Differentiated:
        """q [C]."""
        return 1e-12 * values["pickup_charge"]


def _excess(lines: Frf, mains: float) -> float:
    """How much further the lines near the mains stray from a straight line between the nearest that no mains reach than
    those do from each other: Σ shape² (|stray|² over theirs − 1), the score of a variance of that shape."""
    shape = _shape(lines.frequency, mains)
    near, far = shape > _NEAR, np.flatnonzero(shape < _FAR)
    if not near.any() or len(far) < _LEAST_LINES:
        return 0.0
    size = np.maximum(np.abs(lines.values), max(float(np.median(np.abs(lines.values))), 1e-300))
    between = np.interp(lines.frequency[near], lines.frequency[far], lines.values[far])
    stray = np.abs(lines.values[near] - between) / size[near]
    odd, even = far[1::2], far[::2]
    others = np.abs(lines.values[odd] - np.interp(lines.frequency[odd], lines.frequency[even], lines.values[even]))
    usual = float(np.median((others / size[odd]) ** 2)) / np.log(2.0)  # |·|² of normal parts: median = mean · ln 2
    return float((shape[near] ** 2 * (stray**2 - usual)).sum() / max(usual, _LEAST_STRAY**2))


def _shape(frequency: Floats, mains: float) -> Floats:
    distance = (frequency[:, None] - mains * _HARMONICS) / _WIDTH_HZ
    return np.asarray((np.exp(-0.5 * distance**2) / _HARMONICS).sum(axis=1))
