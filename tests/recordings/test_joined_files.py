"""Force and charge of one recording in two files, which the rig description joins by their names."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.campaign_documents import FRF, document
from tests.support.instrument_files import COMMON
from underskin.errors import FileError, InvalidInput
from underskin.recordings import Reading, read_file, rig_description
from underskin.recordings.campaign import FrfRecording

RATE = 500.0
SAMPLES = np.arange(200)
FORCE, CHARGE = 1 + np.sin(0.3 * SAMPLES), 7 * np.sin(0.3 * SAMPLES)


def rig(**more: Any) -> rig_description.RigDescription:
    channels = {"force_n": {"channel": "Force"}, "charge_pc": {"channel": "Charge"}}
    given = {"schema": "rig/1", "skin": document(FRF)["skin"], "recording": COMMON, "channels": channels}
    return rig_description.from_dict({**given, "join": {"_force": "_charge"}, **more})


def write(folder: Path, name: str, heading: str, values: np.ndarray, first: int, separator: str = ";") -> None:
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


def test_starts_that_the_files_state_align_them(tmp_path: Path) -> None:
    """Of LVM files the header says when each began."""
    for name, values, label, start in (("force", FORCE, "N", 0), ("charge", CHARGE[5:], "pC", 5)):
        head = "LabVIEW Measurement\nSeparator\tTab\nX_Columns\tNo\n***End_of_Header***\n\nChannels\t1\n"
        head += f"Date\t2026/05/04\nTime\t09:00:00.{1000 * start / RATE:06.0f}\nY_Unit_Label\t{label}\n".replace(
            f".{1000 * start / RATE:06.0f}", f".{round(1e6 * start / RATE):06d}"
        )
        head += f"Delta_X\t{1 / RATE}\n***End_of_Header***\nX_Value\t{name.title()}\n"
        (tmp_path / f"a_{name}.lvm").write_text(head + "".join(f"\t{value:.6f}\n" for value in values))
    recording = recorded(read_file(tmp_path / "a_force.lvm", "a_force.lvm", rig()))
    assert recording.force_n == pytest.approx(FORCE[5:], abs=1e-6)
    assert recording.charge_pc == pytest.approx(CHARGE[5:], abs=1e-6)


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
    write(tmp_path, name, "Charge [pC]", CHARGE, first)  # type: ignore[arg-type]
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
