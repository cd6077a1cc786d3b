"""Force and charge of one recording in two files, which the rig description joins by their names."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.campaign_documents import FRF, document
from tests.support.instrument_files import COMMON
from underskin.errors import FileError, InvalidInput
from underskin.recordings import Reading, read_file, rig_description
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.channels import Block, Channel, Contents
from underskin.recordings.joined_files import joined

RATE = 500.0
SAMPLES = np.arange(200)
FORCE, CHARGE = 1 + np.sin(0.3 * SAMPLES), 7 * np.sin(0.3 * SAMPLES)


def rig(**more: Any) -> rig_description.RigDescription:
    channels = {"force_n": {"channel": "Force"}, "charge_pc": {"channel": "Charge"}}
    given = {"schema": "rig/1", "skin": document(FRF)["skin"], "recording": COMMON, "channels": channels}
    return rig_description.from_dict({**given, "join": {"_force": "_charge"}, **more})


def write(folder: Path, name: str, heading: str, values: np.ndarray, first: float, separator: str = ";") -> None:
    """A file with a clock, whose first row is that of a sample."""
    rows = [f"{(first + row) / RATE:.4f}{separator}{value:.6f}" for row, value in enumerate(values.tolist())]
    (folder / name).write_text("\n".join([f"Time [s]{separator}{heading}", *rows]))


def recorded(reading: Reading) -> FrfRecording:
    assert reading.problems == []
    (recording,) = reading.campaign.of(FrfRecording)
    return recording


def read(folder: Path, **more: Any) -> Reading:
    time = {"time_s": {"channel": "Time"}}
    return read_file(folder / "a_force.csv", "a_force.csv", rig(**{"channels": {**CHANNELS, **time}, **more}))


CHANNELS = {"force_n": {"channel": "Force"}, "charge_pc": {"channel": "Charge"}}


@pytest.mark.parametrize("late", [0, 7, -5])
@pytest.mark.parametrize("missing", [0, 3])
def test_clocks_align_files(late: int, missing: int, tmp_path: Path) -> None:
    """The samples in common are those of equal times, whichever file begins first."""
    end = len(SAMPLES) - missing
    write(tmp_path, "a_force.csv", "Force [N]", FORCE[max(0, -late) :], max(0, -late))
    write(tmp_path, "a_charge.csv", "Charge [pC]", CHARGE[max(0, late) : end], max(0, late), ",")
    recording = recorded(read(tmp_path))
    assert recording.sample_rate_hz == pytest.approx(RATE)
    assert recording.force_n == pytest.approx(FORCE[abs(late) : end], abs=1e-6)
    assert recording.charge_pc == pytest.approx(CHARGE[abs(late) : end], abs=1e-6)


def test_files_without_a_clock_have_the_same_rows(tmp_path: Path) -> None:
    (tmp_path / "a_force.csv").write_text("n;Force [N]\n" + "".join(f"{n};{f:.6f}\n" for n, f in enumerate(FORCE)))
    (tmp_path / "a_charge.csv").write_text("n;Charge [pC]\n" + "".join(f"{n};{q:.6f}\n" for n, q in enumerate(CHARGE)))
    given = rig(recording={**COMMON, "sample_rate_hz": RATE})
    reading = read_file(tmp_path / "a_force.csv", "a_force.csv", given)
    assert recorded(reading).charge_pc == pytest.approx(CHARGE, abs=1e-6)
    assert any("state no clock" in warning for warning in reading.warnings)
    (tmp_path / "a_charge.csv").write_text("n;Charge [pC]\n" + "".join(f"{n};{n}\n" for n in range(30)))
    with pytest.raises(FileError, match=r"a_force.csv and a_charge.csv: no rate and no even clock"):
        read_file(tmp_path / "a_force.csv", "a_force.csv", given)


def lvm(folder: Path, name: str, values: np.ndarray, label: str, began: str) -> None:
    head = "LabVIEW Measurement\nSeparator\tTab\nX_Columns\tNo\n***End_of_Header***\n\nChannels\t1\n"
    head += f"Date\t2026/05/04\nTime\t{began}\nY_Unit_Label\t{label}\n"
    head += f"Delta_X\t{1 / RATE}\n***End_of_Header***\nX_Value\t{name.title()}\n"
    (folder / f"a_{name}.lvm").write_text(head + "".join(f"\t{value:.6f}\n" for value in values))


def test_starts_that_the_files_state_align_them(tmp_path: Path) -> None:
    """Of LVM files the header says when each began."""
    lvm(tmp_path, "force", FORCE, "N", "09:00:00.000000")
    lvm(tmp_path, "charge", CHARGE[5:], "pC", f"09:00:00.{round(1e6 * 5 / RATE):06d}")
    recording = recorded(read_file(tmp_path / "a_force.lvm", "a_force.lvm", rig()))
    assert recording.force_n == pytest.approx(FORCE[5:], abs=1e-6)
    assert recording.charge_pc == pytest.approx(CHARGE[5:], abs=1e-6)


def test_starts_in_whole_seconds_align_nothing(tmp_path: Path) -> None:
    """Starts a second apart, stated in whole seconds, are refused: the files began up to two seconds apart."""
    lvm(tmp_path, "force", FORCE, "N", "09:00:00")
    lvm(tmp_path, "charge", CHARGE, "pC", "09:00:01")
    with pytest.raises(FileError, match=r"differ, in whole seconds, .* a_charge.lvm at 2026-05-04T09:00:01"):
        read_file(tmp_path / "a_force.lvm", "a_force.lvm", rig())


def part(name: str, first_s: float, began: str) -> Contents:
    """A file with a column of times and the start that it states."""
    channels = (Channel("Time", "s", first_s + SAMPLES / RATE), Channel(name, "N", FORCE))
    return Contents((Block("", channels, None, began),), {}, (), "")


@pytest.mark.parametrize(("first_s", "aligned"), [(1.204, True), (0.02, False)])
def test_columns_of_times_that_start_as_far_apart_align_files(first_s: float, aligned: bool) -> None:
    """Of one clock, whose first times differ as the starts in whole seconds do, the first times count; else none."""
    files = part("Force", 0.0, "2026-05-04T09:00:00Z"), part("Charge", first_s, "2026-05-04T09:00:01Z")
    if not aligned:
        with pytest.raises(FileError, match="differ, in whole seconds"):
            joined(files[0], {"a_charge.csv": files[1]}, "a_force.csv")
        return
    contents = joined(files[0], {"a_charge.csv": files[1]}, "a_force.csv")
    assert [channel.starts_s for channel in contents.blocks[0].channels] == [0.0, 0.0, first_s]
    assert "aligned by their columns of times" in contents.warnings[0]


def test_rates_without_starts_are_told() -> None:
    """Files that state a rate, and no start, lack the start alone; a step of 0 is no rate."""
    series = [Contents((Block("", (Channel(name, "N", FORCE),), RATE, None),), {}, (), "") for name in ("F", "Q")]
    assert joined(series[0], {"b": series[1]}, "a").warnings == (
        "a and b state no start: their rows are taken to be of one time",
    )
    still = Block("", (Channel("Q", "pC", CHARGE[5:]),), 0.0, None)
    with pytest.raises(FileError, match="b: no rate and no even clock"):
        joined(series[0], {"b": Contents((still,), {}, (), "")}, "a")


def test_a_campaign_document_is_not_joined(tmp_path: Path) -> None:
    """A file that holds no channels is refused by its name, not left out."""
    write(tmp_path, "a_force.json", "Force [N]", FORCE, 0)
    (tmp_path / "a_charge.json").write_text(json.dumps(document(FRF)))
    with pytest.raises(FileError, match=r"a_charge.json: is a campaign document"):
        read_file(tmp_path / "a_force.json", "a_force.json", rig())


@pytest.mark.parametrize(
    ("name", "first", "message"),
    [
        ("a_charge.csv", 0.5, "they can be aligned by whole samples alone"),
        ("a_charge.csv", 1000, "they have no samples in common"),
        ("b_charge.csv", 0, "a_charge.csv: cannot be opened: No such file"),
    ],
)
def test_files_that_do_not_fit_are_refused(name: str, first: float, message: str, tmp_path: Path) -> None:
    write(tmp_path, "a_force.csv", "Force [N]", FORCE, 0)
    write(tmp_path, name, "Charge [pC]", CHARGE, first)
    with pytest.raises(FileError, match=message):
        read(tmp_path)


def test_a_name_without_the_part_and_bytes_are_refused(tmp_path: Path) -> None:
    write(tmp_path, "a.csv", "Force [N]", FORCE, 0)
    with pytest.raises(FileError, match="has no '_force' in its name"):
        read_file(tmp_path / "a.csv", "a.csv", rig())
    with pytest.raises(FileError, match="is no file with others in its folder"):
        read_file((tmp_path / "a.csv").read_bytes(), "a_force.csv", rig())


@pytest.mark.parametrize("join", ["_charge", {}, {"a": "b", "c": "d"}, {"_force": "../secret"}, {"a": 5}, {"a": "a"}])
def test_no_other_names_are_refused(join: Any) -> None:
    with pytest.raises(InvalidInput, match="join"):
        rig(join=join)
