"""The campaign model: every field checked by name, good recordings kept, documents written back as they came."""

import copy
import json
import os
from pathlib import Path
from typing import Any

import pytest

from tests.support.campaign_documents import COMPRESSION, EVERYTHING, FRF, INDENTATION, SKIN, TIME_SERIES, document
from underskin.errors import FileError, InvalidInput
from underskin.recordings.campaign import from_dict, parse, to_dict
from underskin.recordings.readers import json_file


def test_every_kind_comes_back_as_it_went_in() -> None:
    campaign, problems = from_dict(copy.deepcopy(EVERYTHING))
    assert not problems
    assert [recording.kind for recording in campaign.recordings] == ["frf", "frf", "indentation", "compression"]
    assert to_dict(campaign) == EVERYTHING
    assert json.loads(json_file.write(campaign)) == EVERYTHING


@pytest.mark.slow
@pytest.mark.parametrize("part", ["open", "sealed"])
def test_the_concealed_campaigns_come_back_as_they_went_in(part: str) -> None:
    folder = os.environ.get("UNDERSKIN_CAMPAIGNS")
    if folder is None:
        pytest.skip("UNDERSKIN_CAMPAIGNS names no folder of campaigns")
    files = sorted(Path(folder, part).glob("*.json"))
    assert files
    for file in files:
        given = json_file.document(file.read_bytes(), file.name)
        assert to_dict(parse(given)) == given


@pytest.mark.parametrize(
    ("recording", "field", "value", "place", "allowed"),
    [
        (FRF, "id", "", "id", "printable"),
        (FRF, "id", "\ud800", "id", "printable"),
        (FRF, "sensor", "s99", "sensor", "one of the skin's sensors"),
        (FRF, "sensor", None, "sensor", "required"),
        (FRF, "kind", "fft", "kind", "frf, indentation, compression"),
        (FRF, "preload_n", 0, "preload_n", "greater than 0"),
        (FRF, "preload_n", True, "preload_n", "a number"),
        (FRF, "preload_n", "1.0", "preload_n", "a number"),
        (FRF, "preload_n", 10**400, "preload_n", "finite"),
        (FRF, "indenter_radius_mm", 0.004, "indenter_radius_mm", "was it given in m"),
        (FRF, "dynamic_force_n", -0.1, "dynamic_force_n", "greater than 0"),
        (FRF, "load_cycles", 1.5, "load_cycles", "whole number"),
        (FRF, "load_cycles", 2**53 + 1, "load_cycles", "9007199254740992"),
        (FRF, "load_cycles", 1e30, "load_cycles", "9007199254740992"),
        (FRF, "dwell_s", -1, "dwell_s", "0 or greater"),
        (FRF, "recorded_at", "yesterday", "recorded_at", "date and time"),
        (FRF, "position_mm", [1.0], "position_mm", "two numbers"),
        (FRF, "frequency_hz", [0.0, 1.0, 2.0], "frequency_hz[0]", "greater than 0"),
        (FRF, "frequency_hz", [1e-300, 1.0, 2.0], "frequency_hz[0]", "1e-06 to 1e+09 Hz"),
        (FRF, "frequency_hz", [1.0, 2.0, 1e300], "frequency_hz[2]", "1e-06 to 1e+09 Hz"),
        (FRF, "frequency_hz", [1.0, 3.0, 2.0], "frequency_hz[2]", "entry before"),
        (FRF, "frf_re_pc_per_n", [7.0, float("nan"), 7.0], "frf_re_pc_per_n[1]", "finite"),
        (FRF, "frf_re_pc_per_n", [7.0, "7.0", 7.0], "frf_re_pc_per_n[1]", "a number"),
        (FRF, "frf_re_pc_per_n", [7.0, None, 7.0], "frf_re_pc_per_n[1]", "a number"),
        (FRF, "frf_re_pc_per_n", [7.0], "frf_re_pc_per_n", "3 entries"),
        (FRF, "frf_re_pc_per_n", [], "frf_re_pc_per_n", "at least one"),
        (FRF, "frf_im_pc_per_n", None, "frf_im_pc_per_n", "required"),
        (FRF, "coherence", [0.5, 1.1, 0.5], "coherence[1]", "0 to 1"),
        (FRF, "sample_rate_hz", 100.0, "sample_rate_hz", "absent where the FRF"),
        (FRF, "colour", "red", "colour", "unknown field"),
        (FRF, "", "red", '""', "unknown field"),
        (TIME_SERIES, "charge_pc", None, "charge_pc", "required"),
        (TIME_SERIES, "sample_rate_hz", float("inf"), "sample_rate_hz", "finite"),
        (INDENTATION, "force_n", [0.0], "force_n", "3 entries"),
        (INDENTATION, "sensor", "s99", "sensor", "one of the skin's sensors"),
        (INDENTATION, "time_s", [0.0, 1.0, 0.5], "time_s[2]", "before the entry above"),
        (INDENTATION, "preload_n", 1.0, "preload_n", "unknown field"),
        (COMPRESSION, "sample_height_mm", 10000.0, "sample_height_mm", "was it given in µm"),
        (COMPRESSION, "sample_diameter_mm", None, "sample_diameter_mm", "required"),
    ],
)
def test_a_bad_field_is_named_and_the_good_recordings_stay(
    recording: dict[str, Any], field: str, value: Any, place: str, allowed: str
) -> None:
    campaign, problems = from_dict(document({**FRF, "id": "good"}, {**recording, field: value}))
    assert [kept.id for kept in campaign.recordings] == ["good"]
    assert [problem.field for problem in problems] == [place]
    assert allowed in problems[0].allowed
    assert field == "id" or problems[0].recording == recording["id"]
    json.dumps(problems[0].value, allow_nan=False)


def test_all_that_is_wrong_with_a_recording_is_said_at_once() -> None:
    _, problems = from_dict(document(FRF, {**FRF, "id": "r2", "preload_n": -1, "sensor": None, "x": 1}))
    assert {problem.field for problem in problems} == {"preload_n", "sensor", "x"}
    assert {problem.recording for problem in problems} == {"r2"}
    wrong = {"preload_n": -1, "sensor": "s99", "frf_im_pc_per_n": [1.0], "coherence": None}
    _, problems = from_dict(document(FRF, {**FRF, "id": "r2", **wrong}))
    assert [problem.field for problem in problems] == ["preload_n", "sensor", "frf_im_pc_per_n"]


def test_of_thousands_of_unknown_fields_some_are_said() -> None:
    _, problems = from_dict(document(FRF, {**FRF, "id": "r2", **{f"x{number}": 1 for number in range(5000)}}))
    assert 1 <= len(problems) < 100
    assert {problem.recording for problem in problems} == {"r2"}
    wrong = {"preload_n": -1, "sensor": "s99", "frf_im_pc_per_n": [1.0], "coherence": None}
    _, problems = from_dict(document(FRF, {**FRF, "id": "r2", **wrong}))
    assert [problem.field for problem in problems] == ["preload_n", "sensor", "frf_im_pc_per_n"]


@pytest.mark.parametrize(("in_skin", "used"), [((1, 2, 3), (0, 1, 2)), ((0, 1, 2), (1, 2, 3)), ((1, 2, 3), (0, 1))])
def test_sensors_counted_from_0_and_from_1(in_skin: tuple[int, ...], used: tuple[int, ...]) -> None:
    """Where the recordings count the sensors from 0 and the skin from 1, or the other way round, no recording is taken
    for a neighbour's; one name too many, or fewer sensors than the skin has, is no such count."""

    def counted(numbers: tuple[int, ...]) -> dict[str, Any]:
        sensors = [{"id": f"s{number:02d}", "x_mm": 8.0 * number, "y_mm": 0.0} for number in in_skin]
        recordings = [{**FRF, "id": f"r{number}", "sensor": f"s{number:02d}"} for number in numbers]
        return {**document(*recordings), "skin": {**SKIN, "sensors": sensors}}

    with pytest.raises(InvalidInput, match=r"recordings\[\d\]\.sensor = .*counted from 0"):
        from_dict(counted(used))
    assert from_dict(counted(in_skin))[1] == from_dict(counted(in_skin[1:]))[1] == []
    assert [problem.field for problem in from_dict(counted((*in_skin, 9)))[1]] == ["sensor"]


def test_an_id_given_twice_is_refused_the_second_time() -> None:
    campaign, problems = from_dict(document(FRF, FRF))
    assert len(campaign.recordings) == 1
    assert [(problem.recording, problem.field) for problem in problems] == [("r1", "id")]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"schema": "campaign/2"}, "schema"),
        ({"name": 3}, "name"),
        ({"name": None}, "name"),
        ({"recordings": []}, "recordings"),
        ({"skin": {"thickness_mm": 2500.0}}, "skin.thickness_mm"),
        ({"skin": {"thickness_mm": None}}, "skin.thickness_mm"),
        ({"skin": {"youngs_modulus_mpa": None}}, "skin.youngs_modulus_mpa"),
        ({"skin": {"poisson_ratio": 0.6}}, "skin.poisson_ratio"),
        ({"skin": {"colour": "red"}}, "skin.colour"),
        ({"skin": {"sensors": [{"id": "s01", "x_mm": 0.0}]}}, "skin.sensors[0].y_mm"),
        ({"skin": {"sensors": [SKIN["sensors"][0], SKIN["sensors"][0]]}}, "skin.sensors[1].id"),
        ({"operator": "me"}, "operator"),
        ({"units_checked": 1}, "units_checked"),
    ],
)
def test_a_campaign_that_cannot_be_used_is_refused_by_field(change: dict[str, Any], field: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        from_dict(document(FRF, **change))
    assert refusal.value.field == field


def test_an_unknown_modulus_is_allowed_where_only_the_elastomer_is_measured() -> None:
    bare = {
        "schema": "campaign/1",
        "name": "c",
        "skin": {"poisson_ratio": 0.5},
        "recordings": [INDENTATION, COMPRESSION],
    }
    assert to_dict(parse(bare))["skin"] == {"poisson_ratio": 0.5, "youngs_modulus_mpa": None, "d33_pc_per_n": None}


def test_unlikely_magnitudes_pass_when_the_units_were_checked() -> None:
    small = {**FRF, "indenter_radius_mm": 0.007}
    assert from_dict(document(FRF, small, units_checked=False))[1]
    assert not from_dict(document(small, units_checked=True))[1]


def test_the_strict_reading_stops_at_the_first_bad_recording() -> None:
    with pytest.raises(InvalidInput, match=r"recordings\[r1\].preload_n = -1"):
        parse(document({**FRF, "preload_n": -1}))


@pytest.mark.parametrize(
    ("data", "place"),
    [
        (b"", "line 1"),
        (b'{"a": 1,\n  "b": NaN}', "line 2, column 8"),
        (b"\xff\xfe", "line 1"),
        (b"[" * 100_000, "line 1"),
    ],
)
def test_what_is_not_json_is_refused_with_its_place(data: bytes, place: str) -> None:
    with pytest.raises(FileError, match=r"lab\.json: " + place):
        json_file.document(data, "lab.json")


def test_a_byte_order_mark_is_no_obstacle() -> None:
    assert json_file.document(b"\xef\xbb\xbf{}", "lab.json") == {}
