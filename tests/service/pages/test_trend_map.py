"""The map of trends colours what the trend's own test calls significant, and says as much as the page's text."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import orjson
import pytest
from scipy import stats

from service.pages.skin import drawn_map, map_rows
from service.schemas.skins import History, Point, SensorHistory, TrendAnswer
from service.store import AnyRow
from underskin.inversion.array_history import SIGNIFICANT, holm, trend


def points(values: list[float]) -> list[Point]:
    return [
        Point(
            campaign_id=f"c{year}", time=f"20{10 + year}-01-01T00:00:00Z", time_is="recorded", model="paper",
            model_id=None, d33_pc_per_n=value, d33_uncertainty_pc_per_n=0.001,
        )
        for year, value in enumerate(values)
    ]  # fmt: skip


def history(d33: list[list[float]], uncertainty: float) -> History:
    """Of sensors s0, s1, …, each with one d33 [pC/N] a year."""
    lines = [trend(range(len(values)), values, [uncertainty] * len(values)) for values in d33]
    known = [line for line in lines if line is not None]
    adjusted = holm([line.p_value for line in known])
    sensors = []
    for number, (line, p) in enumerate(zip(known, adjusted, strict=True)):
        answer = TrendAnswer(
            slope_pc_per_n_per_year=line.slope,
            slope_uncertainty_pc_per_n_per_year=line.slope_uncertainty,
            p_value=line.p_value,
            p_value_adjusted=p,
            significant=p < SIGNIFICANT,
        )
        sensors.append(SensorHistory(sensor=f"s{number}", points=points(d33[number]), trend=answer, no_trend=None))
    return History(
        skin_id="palm",
        joined=[],
        differences=[],
        sensors=sensors,
        left_out_campaigns=[],
        left_out_points=[],
        left_out_recordings=[],
    )


@pytest.mark.parametrize("values", [[20.0, 20.9, 22.4], [20.0, 21.0, 22.001], [20.0, 20.9, 22.4, 23.0]])
def test_pointer_tells_interval_holds_0_just(
    values: list[float],
) -> None:
    """The pointer tells an interval that holds 0 just where the trend is not significant."""
    places = [{"id": "s0", "x_mm": 0, "y_mm": 0}]
    row = cast("AnyRow", SimpleNamespace(name="latest", about={"skin": {"sensors": places}}))
    of_skin = history([values], 0.001)
    rows = map_rows(row, {"sensors": [{"sensor": "s0", "flags": []}]}, of_skin, places)
    figure = orjson.loads(str(drawn_map("palm", row, rows, "trend", "paper", None).json))
    ((told,),) = [trace["customdata"] for trace in figure["data"]]
    low, high = (float(end.replace("−", "-")) for end in told.partition("95 %: ")[2].split(" to "))
    line = of_skin.sensors[0].trend
    assert line is not None
    assert (low < 0 < high) is not line.significant
    times = np.arange(len(values), dtype=float)
    fit = stats.linregress(times, values)
    error = max(fit.stderr, 0.001 / np.sqrt(np.sum((times - times.mean()) ** 2)))  # scatter, or the uncertainty told
    half = stats.t.ppf(0.975, len(values) - 2) * error
    assert (low, high) == pytest.approx((fit.slope - half, fit.slope + half), rel=2e-3)
