"""The mechanism `sensor_spread`."""

from underskin.mechanisms.base import Kind, Mechanism, Normal, Parameter, Stage
from underskin.mechanisms.models.composition import SENSOR_SPREAD
from underskin.recordings.campaign import Conditions, frf_of

_REASON = "poled films and printed electrodes vary by some to 30 percent; 8 % within a factor of 2.5"


class SensorSpread(Mechanism):
    """Sensors with different d33."""

    name = "sensor_spread"
    plain = """The sensors are not alike, so the same press gives each of them a charge that is off by a factor of its
    own, in all of its recordings."""
    law = "d33 of sensor j = d33 · e^(g_j), g_j normal with the standard deviation `spread`."
    assumptions = """the gains are the sensors' own, constant over the campaign; they are marginalised by whoever fits,
    as a random effect along the model's response that a sensor's recordings share. Without this mechanism the spread is
    1 %."""
    source = """Seminara 2018, section 3.2 (d33 over the sensors of an array); a gain is positive, so its logarithm is
    normal."""
    stage = Stage.SENSOR
    order = 20
    axes = ("sensor",)
    needs = "recordings of at least two sensors"
    parameters_stated = (
        Parameter(
            "spread",
            "-",
            0.02,
            0.8,
            Normal(-2.5, 0.9),
            "log",
            SENSOR_SPREAD,
            _REASON,
            acts_on="gain_spread",
            shown=0.12,
        ),
    )

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """Two sensors are needed."""
        if len({recording.sensor for recording in frf_of(conditions)}) < 2:
            return "all recordings are of one sensor"
        return None
