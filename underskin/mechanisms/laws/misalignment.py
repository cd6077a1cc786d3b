"""The sphere does not come down where the stage says but always a little to the same side, so each sensor shows what a
press at that other place gives.

Law: true position = commanded + a constant offset, for all recordings.

Assumptions: stage and array are shifted against each other, not turned or stretched. Where every press is commanded at
a sensor's centre and no charge of its neighbours shows (crosstalk), the direction cannot be told, and the offset's
length alone is a parameter.

Source: Sneddon, Fourier Transforms (1951), chapter 10: in the layer's Hankel integral the offset enters as J0(k e/h).
"""

from collections.abc import Collection

import numpy as np

from underskin.mechanisms.autodiff import Differentiated
from underskin.mechanisms.base import Kind, Mechanism, Normal, Parameter, Values
from underskin.recordings.conditions import Conditions, offsets

_LARGEST_MM = 2.0


class Misalignment(Mechanism):
    """See the module."""

    name = "misalignment"
    axes = ("position_mm", "sensor", "preload_n", "indenter_radius_mm")
    needs = "nothing; where every press is centred and nothing tells its direction, its length alone is a parameter"
    largest_offset = 1e-3 * _LARGEST_MM * np.sqrt(2)

    def parameters(self, conditions: Conditions, kind: Kind = "frf") -> tuple[Parameter, ...]:
        """The offset's two components, or its length where its direction cannot be told."""
        return self.parameters_beside((), conditions, kind)

    def parameters_beside(self, others: Collection[str], conditions: Conditions, kind: Kind) -> tuple[Parameter, ...]:
        """The same; the charge of neighbours, which lie in known directions, tells the direction too."""
        told = offsets(conditions).any() or "crosstalk" in others
        names, low = (("offset_x", "offset_y"), -_LARGEST_MM) if told else (("offset",), 0.0)
        return tuple(
            Parameter(
                name=name,
                unit="mm",
                low=low,
                high=_LARGEST_MM,
                prior=Normal(0.0, 0.7),
                scale="linear",
                limit=0.0,
                reason="a tip centred by eye is off by some tenths of a millimetre to a millimetre",
            )
            for name in names
        )

    def offset(self, values: Values) -> tuple[Differentiated, Differentiated]:
        """The offset [m]."""
        if "offset" in values:
            return 1e-3 * values["offset"], 0.0 * values["offset"]
        return 1e-3 * values["offset_x"], 1e-3 * values["offset_y"]
