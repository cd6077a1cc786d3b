"""The mechanism `amplifier_high_pass`."""

from underskin.mechanisms.base import HeavyTailed, Mechanism, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import FrfState

_REASON = "charge amplifiers have corners of 0.01 to some Hz, 0.5 Hz within a factor of 4.5; probes up to some hundred"


class AmplifierHighPass(Mechanism):
    """The charge amplifier's lower cut-off frequency."""

    name = "amplifier_high_pass"
    plain = """The charge amplifier cannot hold a charge for long, so at the lowest frequencies the response drops and
    runs ahead of the force, alike in all recordings."""
    law = "FRF · iωτ/(1 + iωτ), τ = 1/(2π corner)."
    assumptions = "one pole, the same for all recordings and sensors."
    source = """a charge amplifier's feedback capacitor with its resistor in parallel (Gautschi, Piezoelectric
    Sensorics, 2002, chapter 11)."""
    stage = Stage.LINES
    order = 30
    of = "chain"
    axes = ("frequency_hz", "phase")
    parameters_stated = (
        Parameter("corner", "Hz", 1e-3, 1e3, HeavyTailed(-0.7, 1.5), "log", limit=0.0, shown=1.0, reason=_REASON),
    )

    def act(self, state: FrfState, values: Values) -> None:
        """1/(1 − i corner/f)."""
        state.factor = 1.0 / (1.0 - values["corner"] * (1j / state.design.line_frequency))
