"""The mechanism `amplifier_low_pass`."""

import numpy as np

from underskin.autodiff import Differentiated
from underskin.mechanisms import Kind, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.frf_design import FrfDesign
from underskin.recordings.conditions import Conditions


class AmplifierLowPass(Mechanism):
    """The charge amplifier's upper cut-off frequency."""

    name = "amplifier_low_pass"
    plain = "The charge amplifier is too slow for the highest frequencies, so the response falls and lags there."
    law = "FRF / (1 + i f/corner)."
    assumptions = "one pole, the same for all recordings and sensors."
    source = "Gautschi, Piezoelectric Sensorics (2002), chapter 11."
    stage = Stage.LINES
    axes = ("frequency_hz", "phase")

    def parameters(self, conditions: Conditions, kind: Kind = "frf") -> tuple[Parameter, ...]:
        """The corner frequency."""
        return (
            Parameter(
                name="upper_corner",
                unit="Hz",
                low=10.0,
                high=1e5,
                prior=Normal(float(np.log(1000.0)), 1.5),
                scale="log",
                limit=float("inf"),
                reason="a lead's resistance with the sensor's capacitance: 1 kHz within a factor of 4.5",
            ),
        )

    def on_lines(self, design: FrfDesign, contacts: Contacts, values: Values) -> Differentiated:
        """The complex factor on each distinct line."""
        return 1.0 / (1.0 + 1j * design.line_frequency / values["upper_corner"])
