"""The mechanism `amplifier_high_pass`."""

import math

from underskin.mechanisms.base import HeavyTailed, Mechanism, Parameter, Stage, Uniform, Values
from underskin.mechanisms.models.contact_state import FrfState

_ORDER = "1 is a single pole, as of one amplifier; 2 Butterworth's pair, as of a filter against drift"
_DAMPING = math.sqrt(2.0) - 1.0  # of Butterworth's pair, 1 − √2 ix − x²
_REASON = "charge amplifiers have corners of 0.01 to some Hz, 0.5 Hz within a factor of 4.5; probes up to some hundred"


class AmplifierHighPass(Mechanism):
    """The charge amplifier's lower cut-off frequency."""

    name = "amplifier_high_pass"
    plain = """The charge amplifier cannot hold a charge for long, so at the lowest frequencies the response drops and
    runs ahead of the force, alike in all recordings."""
    law = """FRF/(1 − (1 + (√2 − 1) q) ix − q x²), x = corner/f, q = order − 1: one pole for order 1, iωτ/(1 + iωτ) with
    τ = 1/(2π corner), Butterworth's two for order 2."""
    assumptions = "one filter of first or second order, the same for all recordings and sensors."
    source = """a charge amplifier's feedback capacitor with its resistor in parallel (Gautschi, Piezoelectric
    Sensorics, 2002, chapter 11); Butterworth, Wireless Engineer 7 (1930) 536."""
    stage = Stage.LINES
    order = 30
    of = "chain"
    axes = ("frequency_hz", "phase")
    parameters_stated = (
        Parameter("corner", "Hz", 1e-3, 1e3, HeavyTailed(-0.7, 1.5), "log", limit=0.0, shown=1.0, reason=_REASON),
        Parameter(
            "high_pass_order", "-", 1.0, 2.0, Uniform(), "linear", limit=None, shown=1.0, reason=_ORDER,
            closed=(1.0, 2.0), starts=(1.0, 2.0),
        ),
    )  # fmt: skip

    def act(self, state: FrfState, values: Values) -> None:
        """The filter's transfer function."""
        second = values["high_pass_order"] - 1.0
        ratio = values["corner"] / state.design.line_frequency
        state.factor = 1.0 / (1.0 - (1.0 + second * _DAMPING) * ratio * 1j - second * ratio * ratio)
