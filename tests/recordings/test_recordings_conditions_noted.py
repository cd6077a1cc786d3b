"""`conditions`: what else a lab notes, as numbers or words, in campaign/1 and in the CSV template."""

from io import BytesIO
from typing import Any

import pytest

from underskin.errors import InvalidInput
from underskin.recordings.campaign import parse, to_dict
from underskin.recordings.readers import csv_template

CSV = """\
schema,campaign/1
name,noted
skin.thickness_mm,2.5
skin.youngs_modulus_mpa,16
skin.poisson_ratio,0.5
skin.sensor_radius_mm,1.5
sensor,s01,0,0

id,sensor,indenter_radius_mm,preload_n,dynamic_force_n,conditions.temperature_c,conditions.operator,frequency_hz,frf_re_pc_per_n,frf_im_pc_per_n
r1,s01,4,1.0,0.09,23.5,mb,10,7.1,-0.5
,,,,,,,20,7.2,-0.6
r2,s01,4,2.0,0.09,,mb,10,7.3,-0.4
"""


def document(conditions: Any) -> dict[str, Any]:
    read = dict(csv_template.read(BytesIO(CSV.encode()), "noted.csv").campaign)
    read["recordings"][0]["conditions"] = conditions
    return read


def test_columns_of_the_template_are_conditions() -> None:
    read = dict(csv_template.read(BytesIO(CSV.encode()), "noted.csv").campaign)
    assert [entry["conditions"] for entry in read["recordings"]] == [
        {"temperature_c": 23.5, "operator": "mb"},
        {"operator": "mb"},
    ]
    campaign = parse(read)
    assert parse(to_dict(campaign)).recordings[0].conditions == {"temperature_c": 23.5, "operator": "mb"}


@pytest.mark.parametrize(
    ("conditions", "field"),
    [
        ({"preload_n": 1.0}, "conditions.preload_n"),
        ({"time_of_day": 1.0}, "conditions.time_of_day"),
        ({"a b": 1.0}, "conditions."),
        ({"t": [1.0]}, "conditions.t"),
        ({"t": float("nan")}, "conditions.t"),
        ({f"c{number}": 1.0 for number in range(101)}, "conditions"),
        ([1.0], "conditions"),
    ],
)
def test_other_conditions_are_refused(conditions: Any, field: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        parse(document(conditions))
    assert field in refused.value.place


def test_a_value_may_be_missing() -> None:
    assert parse(document({"temperature_c": None, "operator": "mb"})).recordings[0].conditions == {"operator": "mb"}
