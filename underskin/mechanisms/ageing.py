"""The sensors lose strength as the skin is pressed again and again, so recordings after many load cycles are lower than
those after few.

Law: 1 − r [1 − (1 + N/n0)^(−p)]/(p ln 10): for p → 0 it is 1 − r log10(1 + N/n0), for large p the saturating
1 − D (1 − e^(−N/n)), with D = r/(p ln 10) and n = n0/p.

Assumptions: all sensors age alike, by the campaign's own count of cycles.

Source: Jaffe, Cook & Jaffe, Piezoelectric Ceramics (1971), for a loss by the decade; one family holds it and the
saturating law, so that a fit is well posed.
"""

import numpy as np

from underskin.mechanisms.differentiated import Array, Differentiated, chain, log
from underskin.mechanisms.frf_design import FrfDesign, frf_recordings
from underskin.mechanisms.mechanism import Kind, Mechanism, Normal, Parameter, Values
from underskin.recordings.campaign import Campaign

_SMALL = 1e-3


class Ageing(Mechanism):
    """See the module."""

    name = "ageing"
    axes = ("load_cycles",)
    needs = "load_cycles of every recording, not all the same"

    def parameters(self, campaign: Campaign, kind: Kind = "frf") -> tuple[Parameter, ...]:
        """Loss a decade, the cycles at which it sets in, and the shape."""
        return (
            Parameter(
                name="loss_per_decade",
                unit="-",
                low=0.0,
                high=1.5,
                prior=Normal(0.0, 0.3),
                scale="linear",
                limit=0.0,
                reason="poled polymers lose some to tens of percent a decade",
            ),
            Parameter(
                name="onset",
                unit="cycles",
                low=1.0,
                high=1e6,
                prior=Normal(6.9, 2.0),
                scale="log",
                limit=None,
                reason="run-in takes tens to ten thousands of cycles; 1000 within a factor of 7",
            ),
            Parameter(
                name="saturation",
                unit="-",
                low=0.0,
                high=5.0,
                prior=Normal(0.0, 1.0),
                scale="linear",
                limit=None,
                reason="0: a loss that goes on logarithmically; above 1: a loss that ends",
            ),
        )

    def unsupported(self, campaign: Campaign, kind: Kind) -> str | None:
        """Counts that differ are needed."""
        cycles = {entry.id: entry.load_cycles for entry in frf_recordings(campaign)}
        lacking = [name for name, value in cycles.items() if value is None]
        if lacking:
            return f"recording {lacking[0]!r} has no load_cycles"
        return "load_cycles is the same in all recordings" if len(set(cycles.values())) == 1 else None

    def on_recordings(self, design: FrfDesign, values: Values) -> Differentiated:
        """The factor on each recording."""
        decades = log(1.0 + design.load_cycles / values["onset"])
        saturation = values["saturation"]
        fall, slope = _saturating(saturation.value * decades.value)
        # (1 − e^(−p x))/p = x · fall(p x)
        lost = chain(
            decades.value * fall,
            (fall + decades.value * slope * saturation.value, decades),
            (decades.value**2 * slope, saturation),
        )
        return 1.0 - values["loss_per_decade"] * lost / np.log(10.0)


def _saturating(x: Array) -> tuple[Array, Array]:
    """(1 − e^(−x))/x and its derivative."""
    safe = np.where(x < _SMALL, 1.0, x)
    value = -np.expm1(-safe) / safe
    slope = (np.exp(-safe) - value) / safe
    return np.where(x < _SMALL, 1 - x / 2 + x**2 / 6, value), np.where(x < _SMALL, -0.5 + x / 3 - x**2 / 8, slope)
