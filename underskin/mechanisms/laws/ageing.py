"""The mechanism `ageing`."""

import numpy as np

from underskin.autodiff import Differentiated, chain, log
from underskin.mechanisms.base import HeavyTailed, Kind, Mechanism, Normal, Parameter, Stage, Uniform, Values
from underskin.mechanisms.models.contact_state import FrfState
from underskin.recordings.campaign import Conditions, frf_of

_SMALL = 1e-3  # below it (1 − e^(−x))/x is taken from its series
_LEAST = 0.05  # of a response, below which its fall slows down
_LOSS = "poled polymers lose some to tens of percent, a decade or in the end"
_ONSET = "run-in takes tens to ten thousands of cycles; 1000 within a factor of 7"
_SATURATION = "from a loss that goes on by the decade to one that ends: nothing is known beforehand"


class Ageing(Mechanism):
    """A d33 that falls with the number of load cycles."""

    name = "ageing"
    plain = """The sensors lose strength as the skin is pressed again and again, so recordings after many load cycles
    are lower than those after few."""
    law = """FRF · f(1 − loss · g), g = [1 − (1 + N/(n (1 + p)))^(−p)]/(1 − 10^(−p)), p = s/(1 − s), n the onset, s the
    saturation. At s = 0 it is 1 − loss · log10(1 + N/n), a loss by the decade; for s → 1 it is 1 − loss · (1 −
    e^(−N/n)), a loss that ends. f(x) = x down to 0.05, below it 0.05 e^(20x − 1): a response dies out, it does not
    change its sign."""
    assumptions = "all sensors age alike, by the campaign's own count of cycles."
    source = """Jaffe, Cook & Jaffe, Piezoelectric Ceramics (1971), for a loss by the decade; one family holds it and
    the saturating law, so that a fit is well posed."""
    stage = Stage.RECORDING
    order = 10
    axes = ("load_cycles",)
    needs = "load_cycles of every recording, not all the same"
    reads = ("load_cycles",)
    parameters_stated = (
        Parameter("loss", "-", 0.0, 0.95, HeavyTailed(0.0, 0.3), "linear", limit=0.0, shown=0.15, reason=_LOSS),
        Parameter("onset", "cycles", 1.0, 1e6, Normal(6.9, 2.0), "log", limit=None, shown=1000.0, reason=_ONSET),
        Parameter("saturation", "-", 0.0, 0.95, Uniform(), "linear", None, _SATURATION, shown=0.0, closed=(0.0, 0.95)),
    )

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """Counts that differ are needed."""
        cycles = {recording.id: recording.load_cycles for recording in frf_of(conditions)}
        lacking = [name for name, value in cycles.items() if value is None]
        if lacking:
            return f"recording {lacking[0]!r} has no load_cycles"
        return "load_cycles is the same in all recordings" if len(set(cycles.values())) == 1 else None

    def act(self, state: FrfState, values: Values) -> None:
        """The factor on each recording."""
        remaining = 1.0 - values["saturation"]
        power = values["saturation"] / remaining
        age = log(1.0 + remaining * (state.design.load_cycles / values["onset"]))
        # (1 − e^(−p x))/p = x · mean_decay(p x)
        lost = age * _mean_decay(power * age) / (np.log(10.0) * _mean_decay(np.log(10.0) * power))
        state.factor = _positive(1.0 - values["loss"] * lost)


def _mean_decay(x: Differentiated) -> Differentiated:
    """(1 − e^(−x))/x, the mean of e^(−t) over 0 to x."""
    safe = np.where(x.value < _SMALL, 1.0, x.value)
    value = -np.expm1(-safe) / safe
    slope = (np.exp(-safe) - value) / safe
    near = 1 - x.value / 2 + x.value**2 / 6, -0.5 + x.value / 3 - x.value**2 / 8
    return chain(np.where(x.value < _SMALL, near[0], value), (np.where(x.value < _SMALL, near[1], slope), x))


def _positive(factor: Differentiated) -> Differentiated:
    """The factor, or below _LEAST an exponential that continues it with the same slope and tends to 0."""
    tail = _LEAST * np.exp(np.minimum(factor.value / _LEAST - 1, 0.0))
    unchanged = factor.value > _LEAST
    return chain(np.where(unchanged, factor.value, tail), (np.where(unchanged, 1.0, tail / _LEAST), factor))
