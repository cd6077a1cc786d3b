"""The mechanism `sample_averaging`."""

import numpy as np

from underskin.autodiff import exp
from underskin.mechanisms import FrfState, Mechanism, Normal, Parameter, Stage, Values


class SampleAveraging(Mechanism):
    """The mean of two samples that a recorder stores of the charge."""

    name = "sample_averaging"
    plain = "The recorder stores the mean of each sample of the charge and the one before, so high frequencies cancel."
    law = "FRF · (1 + e^(−2πifT))/2."
    assumptions = "the same interval T for all recordings and sensors."
    source = "Oppenheim and Schafer, Discrete-Time Signal Processing (2010), section 2.6."
    stage = Stage.LINES
    axes = ("frequency_hz", "phase")
    parameters_stated = (
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

    def act(self, state: FrfState, values: Values) -> None:
        """Set the complex factor on each distinct line."""
        turns = values["averaging_interval"] * (-2e-3j * np.pi * state.design.line_frequency)
        state.factor = (1.0 + exp(turns)) * 0.5
