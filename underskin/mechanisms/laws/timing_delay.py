"""The mechanism `timing_delay`."""

from collections.abc import Sequence

import numpy as np

from underskin.autodiff import exp
from underskin.mechanisms.base import HeavyTailed, Kind, Mechanism, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import FrfState
from underskin.recordings.campaign import Conditions, FrfRecording
from underskin.recordings.frf.estimation import common_delay, lines_of
from underskin.recordings.frf.spectra import stacked
from underskin.weak_cache import cached_while_alive

_REASON = """multiplexed converters and their filters delay by a few samples at 1 to 50 kS/s; converters of high
resolution by some 40 samples, and two recorders start tenths of a second apart"""
_LARGEST_US = 1e6


class TimingDelay(Mechanism):
    """A constant delay between the channels of charge and force."""

    name = "timing_delay"
    plain = """Charge and force are not sampled at the same instant, so the phase goes off in proportion to frequency
    while the size of the response stays."""
    law = "FRF · exp(−iωt0), t0 the delay."
    assumptions = """one constant delay for all recordings; positive where the charge comes later than the force,
    negative where the force does."""
    source = """a shift in time is a phase linear in frequency (Bendat & Piersol, Random Data, 4th ed., 2010, section
    5.1)."""
    stage = Stage.LINES
    order = 40
    of = "chain"
    axes = ("phase", "frequency_hz")
    parameters_stated = (
        Parameter(
            "delay", "µs", -_LARGEST_US, _LARGEST_US, HeavyTailed(0.0, 300.0), "linear", limit=0.0, shown=300.0,
            reason=" ".join(_REASON.split()),
        ),
    )  # fmt: skip

    def guesses(self, conditions: Conditions, kind: Kind) -> Sequence[Sequence[float]]:
        """The delay of all recordings' phases: beyond one turn over the band no fit converges to it from afar."""
        return _delay_guess(conditions)

    def act(self, state: FrfState, values: Values) -> None:
        """exp(−iωt0)."""
        state.factor = exp(-2e-6j * np.pi * state.design.line_frequency * values["delay"])


@cached_while_alive  # a diagnosis composes dozens of models of one campaign
def _delay_guess(conditions: Conditions) -> list[tuple[float]]:
    """The delay [µs]."""
    measured = [lines_of(recording) for recording in conditions.of(FrfRecording)]
    delay = common_delay(stacked(measured)) if measured else 0.0
    return [(1e6 * delay,)] if delay else []
