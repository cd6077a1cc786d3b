"""The map of trends colours what the trend's own test calls significant, and says as much as the page's text."""

from types import SimpleNamespace
from typing import Any, cast

import orjson
import pytest

from service.pages.skin.figures import drawn_map, map_rows
from service.schemas.skins import History, SensorHistory, TrendAnswer
from service.store import AnyRow
from underskin.inversion.trend import SIGNIFICANT, holm, trend

GREY = "#cfd4d9"


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
        sensors.append(SensorHistory(sensor=f"s{number}", points=[], trend=answer, no_trend=None))
    return History(
        skin_id="palm", joined=[], sensors=sensors, left_out_campaigns=[], left_out_points=[], left_out_recordings=[]
    )


@pytest.mark.parametrize(
    ("d33", "coloured"),
    [
        ([[20.0, 20.9, 22.4], [20.0, 20.1, 19.9]], [False, False]),  # 6.9 uncertainties, of 1 degree of freedom: p 0.09
        ([[20.0, 21.0, 22.001], [20.0, 20.1, 19.9]], [True, False]),
    ],
)
def test_a_slope_is_coloured_where_its_trend_is_significant(d33: list[list[float]], coloured: list[bool]) -> None:
    places = [{"id": f"s{number}", "x_mm": 4.0 * number, "y_mm": 0.0} for number in range(3)]
    row = cast("AnyRow", SimpleNamespace(name="latest", about={"skin": {"sensors": places}}))
    answer = {"sensors": [{"sensor": place["id"], "flags": []} for place in places]}
    of_skin = history(d33, 0.001)
    drawn = drawn_map("palm", row, map_rows(row, answer, of_skin), "trend", "paper", None)
    shapes: list[dict[str, Any]] = orjson.loads(str(drawn.json))["layout"]["shapes"]
    assert [shape["fillcolor"] not in (GREY, "#ffffff") for shape in shapes] == [*coloured, False]
    assert ("no sensor's differs from 0" in drawn.about) is not any(coloured)
