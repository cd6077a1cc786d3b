"""The figure of a skin's sensors over time."""

from typing import Literal
from urllib.parse import quote

from service.pages.shared.figures import Drawn, drawn
from service.schemas.skins import History, SensorDeparture, SensorHistory
from underskin.diagnosis.reporting.page_styles import with_minus

By = Literal["paper", "adopted"]
RESTS = {"adopted": "by the adopted model", "paper": "by the paper's model"}


def drawn_history(root: str, history: History, sensor: str | None, by: By) -> Drawn:
    """d33 over time: of one sensor, of all, or of many the median and the range."""
    from underskin.figures.history import SensorPoints, d33_history, is_summarised

    numbers = f"/skins/{quote(root, safe='')}/history.csv?model={by}"
    points = [
        SensorPoints(
            sensor_history.sensor,
            [point.time for point in sensor_history.points],
            [point.d33_pc_per_n for point in sensor_history.points],
            [point.d33_uncertainty_pc_per_n for point in sensor_history.points],
            _trend_in_words(sensor_history),
        )
        for sensor_history in history.sensors
    ]
    whose = "each sensor" if sensor is None else sensor
    about = f"d33 of {whose} in every campaign, {RESTS[by]}, with its 95 % interval."
    if is_summarised(len(points), sum(len(sensor_history.times) for sensor_history in points)):
        about = (
            f"Median d33 over the sensors in each campaign, {RESTS[by]}, the range of 90 % of them, and by name those "
            f"that stand apart{'' if sensor is None else f'; the line is {sensor}'}. Point at a sensor for its line."
        )
    return drawn("history", d33_history(points, sensor), about, numbers)


def _trend_in_words(sensor: SensorHistory) -> str:
    """The trend of the sensor's d33, relative to the array's if there are enough sensors."""
    if sensor.departure is not None:
        return with_minus(_besides(sensor.departure))
    line = sensor.trend
    if line is None:
        return f"no trend: {sensor.no_trend}"
    slope = f"{line.slope_pc_per_n_per_year:+.2g} ± {line.slope_uncertainty_pc_per_n_per_year:.1g} pC/N a year"
    slope = with_minus(slope)
    return slope if line.significant else f"no significant trend ({slope})"


def _besides(departure: SensorDeparture) -> str:
    low, high = departure.change_low_percent, departure.change_high_percent
    size = f"{departure.change_percent:+z.1f} % ({low:+z.1f} to {high:+z.1f})"
    return f"besides the array {size}" if departure.significant else f"as the array does, within chance: {size}"
