"""The mechanism `timing_delay`."""

import numpy as np

from underskin.autodiff import Differentiated, exp
from underskin.mechanisms.base import Mechanism, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.frf_design import FrfDesign
from underskin.mechanisms.parameter import HeavyTailed, Parameter

_REASON = "multiplexed converters and their filters delay by a few samples at 1 to 50 kS/s"


class TimingDelay(Mechanism):
    """A constant delay between the channels of charge and force."""

    name = "timing_delay"
    plain = """Charge and force are not sampled at the same instant, so the phase goes off in proportion to frequency
    while the size of the response stays."""
    law = "FRF · exp(−iωt0), t0 the delay."
    assumptions = "one constant delay for all recordings; positive where the charge comes later than the force."
    source = """a shift in time is a phase linear in frequency (Bendat & Piersol, Random Data, 4th ed., 2010, section
    5.1)."""
    stage = Stage.LINES
    order = 40
    axes = ("phase", "frequency_hz")
    figure = ("phase",)
    parameters_stated = (
        Parameter(
            "delay", "µs", -5000.0, 5000.0, HeavyTailed(0.0, 300.0), "linear", limit=0.0, shown=300.0, reason=_REASON
        ),
    )

    def on_lines(self, design: FrfDesign, contacts: Contacts, values: Values) -> Differentiated:
        """exp(−iωt0)."""
        return exp(-2e-6j * np.pi * design.line_frequency * values["delay"])
