"""What a rig description derives, tares, trims and turns, on raw curves whose force and depth are known."""

from typing import Any

import numpy as np
import pytest

from tests.support.raw_curves import DEPTH_MM, FORCE_N, OFFSET_NM, rig_of_raw_curve, text_of_raw_curve
from underskin.errors import FileError, InvalidInput
from underskin.recordings import read_file, rig_description
from underskin.recordings.campaign import CompressionRecording, IndentationRecording
from underskin.recordings.reading import Reading


def read(text: str, **changes: Any) -> Reading:
    return read_file(text.encode(), "afm.txt", rig_description.from_dict(rig_of_raw_curve(**changes)))


def curve_of(reading: Reading) -> IndentationRecording:
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, IndentationRecording)
    return recording


def test_depth_and_force_are_derived_from_height_and_deflection() -> None:
    reading = read(text_of_raw_curve())
    curve = curve_of(reading)
    np.testing.assert_allclose(curve.force_n, FORCE_N, atol=1e-11)
    np.testing.assert_allclose(curve.displacement_mm, DEPTH_MM - 1e-6 * OFFSET_NM, atol=1e-9)
    assert reading.warnings == [
        "channel 'depth' is derived: -'Height (nm)' - 'Deflection (nm)'",
        "channel 'load' is derived: k * 'Deflection (nm)'",
        "the force is 0 on average over the first 10 % of all samples of each curve: it was tared so",
    ]
    assert "its mean over the first 10 %" in reading.taken["force_n"]


def test_a_constant_may_come_from_the_file() -> None:
    derived = {"depth": "-'Height (nm)' - 'Deflection (nm)'", "load": "'k (N/m)' * 'Deflection (nm)'"}
    curve = curve_of(read(text_of_raw_curve(above="k (N/m)\t3"), derived=derived))
    np.testing.assert_allclose(curve.force_n, FORCE_N, atol=1e-11)


@pytest.mark.parametrize(
    ("trim", "kept", "said"),
    [
        ({"first_sample": 11, "last_sample": 390}, slice(10, 390), "of each curve, samples 11 to 390 are used"),
        ({"first_sample": 3}, slice(2, None), "of each curve, samples from 3 on are used"),
        (
            {"last_sample": 1000},
            slice(None),
            "samples 1 to 400 are used: the curve ends there, before the last sample that was said, 1000",
        ),
    ],
)
def test_samples_outside_the_trim_are_left_out(trim: dict[str, int], kept: slice, said: str) -> None:
    reading = read(text_of_raw_curve(), trim=trim)
    curve = curve_of(reading)
    np.testing.assert_allclose(curve.displacement_mm, (DEPTH_MM - 1e-6 * OFFSET_NM)[kept], atol=1e-9)
    assert said in reading.warnings


def test_each_curve_of_a_file_is_trimmed() -> None:
    one = text_of_raw_curve()
    rows = one.partition("\n")[2]
    reading = read(one + "\n\n" + rows, curves="groups", trim={"first_sample": 101, "last_sample": 401})
    assert "2 of 2 curves end before that, the shortest at sample 400" in "".join(reading.warnings)
    forces = [curve.force_n for curve in reading.campaign.recordings if isinstance(curve, IndentationRecording)]
    assert [len(force) for force in forces] == [len(FORCE_N) - 100] * 2


def test_a_sign_is_told_from_how_the_curve_goes() -> None:
    channels = {
        "displacement_mm": {
            "channel": "Height (nm)",
            "sign": "auto",
            "deflection": {"channel": "Deflection (nm)", "sign": "auto"},
        },
        "force_n": {"channel": "Deflection (nm)", "sign": "auto", "spring_constant_n_per_m": 3, "tare_percent": 10},
    }
    for height in (-1, 1):
        for deflection in (-1, 1):
            text = text_of_raw_curve(height_sign=height, deflection_sign=deflection)
            reading = read(text, derived={}, channels=channels)
            curve = curve_of(reading)
            np.testing.assert_allclose(curve.force_n, FORCE_N, atol=1e-11)
            np.testing.assert_allclose(np.diff(curve.displacement_mm), np.diff(DEPTH_MM), atol=1e-9)
            turned = [warning for warning in reading.warnings if "falls as it is pressed" in warning]
            assert len(turned) == (height < 0) + (deflection < 0)


@pytest.mark.parametrize(("force", "travel"), [(1, 1), (-1, 1), (1, -1), (-1, -1)])
def test_the_signs_of_a_block_are_told_from_its_largest_force(force: int, travel: int) -> None:
    strain = np.concatenate([np.linspace(0, 0.2, 50), np.linspace(0.2, 0, 50)])
    rows = "".join(f"{travel * one:.6f};{force * 40 * one:.6f}\n" for one in strain)
    rig = rig_description.from_dict(
        {
            "schema": "rig/1",
            "kind": "compression",
            "skin": {"poisson_ratio": 0.5},
            "recording": {"sample_height_mm": 10, "sample_diameter_mm": 20},
            "channels": {
                "displacement_mm": {"channel": "Crosshead", "sign": "auto"},
                "force_n": {"channel": "Load", "sign": "auto"},
            },
        }
    )
    (block,) = read_file(f"Crosshead;Load\nmm;N\n{rows}".encode(), "block.csv", rig).campaign.recordings
    assert isinstance(block, CompressionRecording)
    np.testing.assert_allclose(block.displacement_mm, strain, atol=1e-6)
    np.testing.assert_allclose(block.force_n, 40 * strain, atol=1e-5)


@pytest.mark.parametrize(
    ("changes", "field", "said"),
    [
        ({"trim": {"first_sample": 0}}, "trim.first_sample", "counted from 1"),
        ({"trim": {"first_sample": 9, "last_sample": 9}}, "trim.last_sample", "above first_sample, 9"),
        ({"derived": {"depth": "a ** 2"}}, "derived.depth", "a ** 2: is not allowed"),
        ({"derived": {"depth": 3}}, "derived.depth", "printable text"),
        (
            {"channels": {"displacement_mm": {"channel": "depth", "sign": "auto"}, "force_n": {"channel": "load"}}},
            "channels.displacement_mm.sign",
            "whose terms have signs of their own",
        ),
        ({"channels": {"force_n": {"channel": "load", "sign": "auto"}}}, "channels.force_n.sign", "found from curves"),
        ({"channels": {"force_n": {"channel": "load", "sign": "up"}}}, "channels.force_n.sign", "1, -1 or auto"),
        (
            {"channels": {"force_n": {"channel": "a", "tare_percent": 101}}},
            "channels.force_n.tare_percent",
            "up to 100",
        ),
        (
            {"channels": {"time_s": {"channel": "t", "tare_percent": 5}}},
            "channels.time_s.tare_percent",
            "is for force_n",
        ),
    ],
)
def test_what_a_rig_description_cannot_mean_is_refused(changes: dict[str, Any], field: str, said: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        rig_description.from_dict(rig_of_raw_curve(**changes))
    assert refused.value.field == field
    assert said in refused.value.allowed


@pytest.mark.parametrize(
    ("changes", "place", "said"),
    [
        ({"derived": {"Height (nm)": "1 [nm]"}}, "derived.Height (nm)", "is a channel of the file already"),
        ({"trim": {"first_sample": 401}}, "trim.first_sample", "has 400 samples"),
        (
            {"derived": {"depth": "'Height (nm)' - 'Deflection (nm)'", "load": "3 [N/m] * 'Deflection (nm)'"}},
            "derived.depth",
            "turn the terms of 'Height (nm)' - 'Deflection (nm)'",
        ),
    ],
)
def test_what_a_file_contradicts_is_refused(changes: dict[str, Any], place: str, said: str) -> None:
    with pytest.raises(FileError) as refused:
        read(text_of_raw_curve(), **changes)
    assert refused.value.place == place
    assert said in refused.value.reason
