"""The mechanism `sample_averaging`."""

import numpy as np

from underskin.autodiff import Differentiated, exp
from underskin.mechanisms import Kind, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.frf_design import FrfDesign
from underskin.recordings.campaign import Conditions


class SampleAveraging(Mechanism):
    """The mean of two samples that a recorder stores of the charge."""

    name = "sample_averaging"
    plain = "The recorder stores the mean of each sample of the charge and the one before, so high frequencies cancel."
    law = "FRF · (1 + e^(−2πifT))/2."
    assumptions = "the same interval T for all recordings and sensors."
    source = "Oppenheim and Schafer, Discrete-Time Signal Processing (2010), section 2.6."
    stage = Stage.LINES
    axes = ("frequency_hz", "phase")

    def parameters(self, conditions: Conditions, kind: Kind = "frf") -> tuple[Parameter, ...]:
        """The interval between two samples."""
        return (
            Parameter(
                name="averaging_interval",
                unit="ms",
                low=1e-3,
                high=10.0,
                prior=Normal(float(np.log(0.2)), 1.5),
                scale="log",
                limit=0.0,
                reason="recorders take 1 to 20 samples a millisecond: 0.2 ms within a factor of 4.5",
            ),
        )

    def on_lines(self, design: FrfDesign, contacts: Contacts, values: Values) -> Differentiated:
        """The complex factor on each distinct line."""
        return (1.0 + exp(values["averaging_interval"] * (-2e-3j * np.pi * design.line_frequency))) * 0.5
