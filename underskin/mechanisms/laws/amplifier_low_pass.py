"""The mechanism `amplifier_low_pass`."""

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from underskin.mechanisms.base import HeavyTailed, Kind, Mechanism, Parameter, Stage, Uniform, Values
from underskin.mechanisms.models.contact_state import FrfState
from underskin.recordings.campaign import Conditions, FrfConditions
from underskin.weak_cache import cached_while_alive

_CORNER = "filters against noise and aliasing, leads and probes: 300 Hz within a factor of 4.5, as the bands of skins"
_ORDER = "1 is a single pole, 2 Butterworth's pair; between them lie two real poles, and Bessel's pair at 1.5"
_LOWEST_HZ = 1e-2
_BEYOND = 5.0  # times the highest line: from there the response falls by 2 % at most, and equals a delay
_DAMPING = math.sqrt(2.0) - 1.0  # of Butterworth's pair, 1 + √2 ix − x²


class AmplifierLowPass(Mechanism):
    """The upper cut-off frequency of the charge's chain."""

    name = "amplifier_low_pass"
    plain = """A filter between sensor and recorder, be it the amplifier's, the converter's or a lead's, cannot follow
    high frequencies, so the response falls there and lags behind the force, alike in all recordings."""
    law = """FRF/(1 + (1 + (√2 − 1) q) ix − q x²), x = f/corner, q = order − 1: one pole for order 1, Butterworth's two
    for order 2."""
    assumptions = """one filter of first or second order, the same for all recordings and sensors; a corner far beyond
    the band shows as a timing_delay of 1/(2π corner) and is left to that."""
    source = """Gautschi, Piezoelectric Sensorics, 2002, chapter 11 (amplifiers); Butterworth, Wireless Engineer 7
    (1930) 536."""
    stage = Stage.LINES
    order = 35
    of = "chain"
    axes = ("frequency_hz", "phase")
    parameters_stated = (
        Parameter(
            "low_pass_corner", "Hz", _LOWEST_HZ, 1e5, HeavyTailed(float(np.log(300.0)), 1.5), "log", limit=math.inf,
            shown=300.0, reason=_CORNER,
        ),
        Parameter(
            "order", "-", 1.0, 2.0, Uniform(), "linear", limit=None, shown=1.0, reason=_ORDER, closed=(1.0, 2.0),
            starts=(1.0, 2.0),
        ),
    )  # fmt: skip

    def parameters(
        self, conditions: Conditions, kind: Kind = "frf", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        """The corner, up to five times the highest line, and the order."""
        corner, order = self.parameters_stated
        highest = max(_BEYOND * _highest_hz(conditions), 2 * corner.low)
        return replace(corner, high=min(corner.high, highest)), order

    def act(self, state: FrfState, values: Values) -> None:
        """The filter's transfer function."""
        second = values["order"] - 1.0
        ratio = state.design.line_frequency / values["low_pass_corner"]
        state.factor = 1.0 / (1.0 + (1.0 + second * _DAMPING) * ratio * 1j - second * ratio * ratio)


@cached_while_alive  # a diagnosis composes dozens of models of one campaign
def _highest_hz(conditions: Conditions) -> float:
    """The highest line of all recordings [Hz]; ∞ without one."""
    columns = [recording.frequency_hz for recording in conditions.of(FrfConditions)]
    highest = [float(np.max(lines, initial=0.0, where=np.isfinite(lines))) for lines in columns if lines is not None]
    return max(highest, default=math.inf)
