"""Files of one rig as one campaign."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.recordings.real_files import read, real
from tests.support.cases import first
from underskin.errors import InvalidInput
from underskin.recordings import Reading, join
from underskin.recordings.campaign import (
    Campaign,
    CompressionRecording,
    FrfRecording,
    RecordingProblem,
    Sensor,
    SkinDescription,
    parse,
    to_dict,
)
from underskin.recordings.validation import LONGEST_NAME

SKIN = SkinDescription(poisson_ratio=0.5, thickness_mm=2.5, youngs_modulus_mpa=16.0, sensor_radius_mm=1.5)


def press(name: str, sensor: str = "s1", level: float = 7.0) -> FrfRecording:
    lines = np.array([10.0, 20.0, 40.0])
    return FrfRecording(
        id=name, sensor=sensor, indenter_radius_mm=4.0, preload_n=1.0, dynamic_force_n=0.1,
        frequency_hz=lines, frf_re_pc_per_n=np.full(3, level), frf_im_pc_per_n=np.zeros(3),
    )  # fmt: skip


def reading(*recordings: FrfRecording, warnings: tuple[str, ...] = (), **skin: Any) -> Reading:
    places = tuple(Sensor(name, 8.0 * int(name[1:]), 0.0) for name in sorted({one.sensor for one in recordings}))
    description = replace(SKIN, **{"sensors": places, **skin})
    return Reading(Campaign("a press", description, recordings), [], list(warnings))


def ids(found: Reading) -> list[str]:
    return [recording.id for recording in found.campaign.recordings]


def test_recordings_and_sensors_of_all_files_are_one_campaign() -> None:
    files = [
        ("1.tdms", reading(press("a", "s1", 7.0))),
        ("2.tdms", reading(press("b", "s2", 7.1), press("c", "s1", 7.2))),
    ]
    found = join("Monday", files)
    assert (found.campaign.name, ids(found), found.problems, found.warnings) == ("Monday", ["a", "b", "c"], [], [])
    assert [(sensor.id, sensor.x_mm) for sensor in found.campaign.skin.sensors] == [("s1", 8.0), ("s2", 16.0)]
    assert to_dict(parse(to_dict(found.campaign))) == to_dict(found.campaign)


def test_a_file_may_leave_out_what_another_says() -> None:
    block = CompressionRecording(
        id="block", sample_height_mm=10.0, sample_diameter_mm=10.0,
        displacement_mm=np.array([0.0, 0.1]), force_n=np.array([0.0, 9.0]),
    )  # fmt: skip
    alone = Reading(Campaign("block", SkinDescription(poisson_ratio=0.5), (block,), units_checked=True), [], [])
    found = join("both", [("block.csv", alone), ("1.tdms", reading(press("a"), id="palm"))])
    assert (found.campaign.skin.thickness_mm, found.campaign.skin.id) == (2.5, "palm")
    assert found.campaign.units_checked
    assert parse(to_dict(found.campaign)).skin == found.campaign.skin


@pytest.mark.parametrize(
    ("skin", "says"),
    [
        ({"thickness_mm": 3.0}, "skin.thickness_mm = 3.0: in b.csv; must be 2.5, as in a.csv"),
        ({"poisson_ratio": 0.49}, "skin.poisson_ratio = 0.49: in b.csv; must be 0.5, as in a.csv"),
        ({"id": "palm-4"}, "skin.id = 'palm-4': in b.csv; must be 'palm-3', as in a.csv"),
        ({"sensors": (Sensor("s1", 8.0, 1.0),)}, r"skin.sensors\[s1\].y_mm = 1.0: in b.csv; must be 0.0, as in a.csv"),
    ],
)
def test_files_of_different_skins_are_not_joined(skin: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidInput, match=says):
        join("both", [("a.csv", reading(press("a"), id="palm-3")), ("b.csv", reading(press("b"), **skin))])


def test_ids_that_several_files_use_are_led_by_the_files_name() -> None:
    refused = RecordingProblem("r1", "preload_n", -1.0, "must be greater than 0")
    nameless = RecordingProblem("recordings[3]", "id", None, "required")
    tuesday = replace(reading(press("own", level=7.3)), problems=[refused, nameless])
    files = [("lab/monday.csv", reading(press("r1", level=7.1), press("r2", level=7.2))), ("lab/tuesday.csv", tuesday)]
    found = join("both", files)
    assert ids(found) == ["monday r1", "r2", "own"]
    assert [problem.recording for problem in found.problems] == ["tuesday r1", "tuesday recordings[3]"]
    (warning,) = found.warnings
    assert warning == (
        "2 recordings have ids that several files use, and are called after their file: 'r1' of lab/monday.csv is "
        "'monday r1'"
    )


def test_files_of_one_name_are_told_apart() -> None:
    files = [(f"{folder}/press.csv", reading(press("press", level=7 + folder))) for folder in range(3)]
    assert ids(join("all", files)) == ["press", "press (2)", "press (3)"]
    long = "x" * LONGEST_NAME
    many = [
        (f"{folder}/{long}.csv", reading(press("r", level=7 + folder), press(long, level=folder)))
        for folder in range(3)
    ]
    names = ids(join("all", many))
    assert len(set(names)) == 6
    assert max(map(len, names)) <= LONGEST_NAME
    taken = [
        ("a.csv", reading(press("r", level=7.1), press("x", level=7.2))),
        ("b.csv", reading(press("r", level=7.3), press("a r", level=7.4))),
    ]
    assert sorted(ids(join("all", taken))) == ["a r", "a r (2)", "b r", "x"]


def test_copies_of_a_recording_count_once() -> None:
    time = "2017-05-03T09:00:00Z"
    found = join("all", [(f"{name}.csv", reading(replace(press(name), recorded_at=time))) for name in "abcdefgh"])
    assert ids(found) == ["a"]
    (warning,) = found.warnings
    assert warning == (
        "recordings with the very numbers of others count once: 'b' is 'a', 'c' is 'a', 'd' is 'a', 'e' is 'a', "
        "'f' is 'a', and 2 more"
    )


def test_a_recording_is_a_copy_by_its_numbers_its_sensor_and_its_contact() -> None:
    noisy = np.random.default_rng(2).normal(7, 0.1, 20)
    first = replace(
        press("a"), frequency_hz=np.arange(1.0, 21), frf_re_pc_per_n=noisy, frf_im_pc_per_n=0.01 * noisy,
        recorded_at="2017-05-03T09:00:00Z",
    )  # fmt: skip
    apart: list[dict[str, Any]] = [
        {"sensor": "s2"}, {"preload_n": 2.0}, {"indenter_radius_mm": 5.0}, {"frf_re_pc_per_n": noisy + 1e-9},
        {"coherence": np.full(20, 0.9)}, {"dynamic_force_n": 0.2}, {"position_mm": (1.0, 0.0)},
    ]  # fmt: skip
    copies: list[dict[str, Any]] = [{"recorded_at": None}, {"dwell_s": 3.0}, {"load_cycles": 9}]
    for changes, kept in [*((one, ["a", "b"]) for one in apart), *((one, ["a"]) for one in copies)]:
        other = replace(first, id="b", **changes)
        assert ids(join("both", [("a.csv", reading(first)), ("b.csv", reading(other))])) == kept, changes


def test_few_numbers_may_agree_by_chance_at_another_time() -> None:
    first, again, later = (
        reading(replace(press(name), recorded_at=f"2017-05-{day}T09:00:00Z"))
        for name, day in (("a", "03"), ("b", "03"), ("c", "04"))
    )
    assert ids(join("all", [("a.csv", first), ("b.csv", again), ("c.csv", later)])) == ["a", "c"]


def test_few_numbers_without_a_time_are_no_copies() -> None:
    found = join("all", [(f"{name}.csv", reading(press(name))) for name in "abc"])
    assert (ids(found), found.warnings) == (["a", "b", "c"], [])


def test_a_campaign_needs_a_name_and_a_file() -> None:
    for name, files in (("", [("a", reading(press("a")))]), ("x", [])):
        with pytest.raises(InvalidInput):
            join(name, files)


def test_wells_of_two_runs_of_a_real_instrument() -> None:
    runs = [real(f"sphere-in-well/run_{number}*/well_*.csv") for number in ("044", "045")]
    files = [file for run in runs for file in first(2, run)]
    found = join("two runs", [(file.name, read(file, "sphere-in-well")) for file in files])
    wells = [file.name.split("_")[1] for file in files]
    assert ids(found) == [f"{file.stem} {well}" for file, well in zip(files, wells, strict=True)]
    assert len(set(wells)) == len(files) / 2
    assert not found.problems
    assert not any("very numbers" in warning for warning in found.warnings)


def test_single_sensors_without_places() -> None:
    """A campaign of one sensor needs no place of it; such files together are of sensors far from each other, each
    pressed where its own file says."""
    files = []
    for sensor, offset in (("s1", None), ("s2", 0.5)):
        one = to_dict(reading(press("r", sensor)).campaign)
        del one["skin"]["sensors"]
        one["recordings"][0] |= {} if offset is None else {"position_mm": [offset, 0.0]}
        files.append((f"{sensor}.json", Reading(parse(one), [], [])))
    found = join("palm", files)
    places = {sensor.id: sensor.x_mm for sensor in found.campaign.skin.sensors}
    assert places["s2"] - places["s1"] > 10 * 2.5
    assert [one.position_mm for one in found.campaign.of(FrfRecording)] == [None, (places["s2"] + 0.5, 0.0)]
    assert "s1 and s2 lies at x 0 mm, y 0 mm in its file" in found.warnings[0]


def test_places_of_several_sensors_are_needed() -> None:
    document = to_dict(reading(press("a", "s1"), press("b", "s2")).campaign)
    document["skin"]["sensors"] = [{"id": "s1", "x_mm": 0.0, "y_mm": 0.0}, {"id": "s2"}]
    with pytest.raises(InvalidInput, match=r"skin.sensors\[1\].x_mm.*required, but of a skin's only sensor"):
        parse(document)
