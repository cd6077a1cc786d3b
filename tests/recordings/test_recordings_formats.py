"""Every format on a small file written here, by the format's own writer where there is one."""

import re
from typing import Any

import numpy as np
import pytest

from tests.recordings.contents_of_files import contents, the_time_series
from tests.support.campaign_documents import EVERYTHING, FRF, document
from tests.support.cases import first
from tests.support.instrument_files import (
    CHARGE,
    COMMON,
    EXAMPLES,
    FORCE,
    hdf5,
    lvm,
    matlab_5,
    matlab_73,
    matlab_variables,
    rig,
    tdms,
)
from underskin.errors import FileError
from underskin.recordings import read_contents, read_file
from underskin.recordings.campaign import parse, to_dict
from underskin.recordings.readers import json_file

MAY, JUNE = np.datetime64("2024-05-03T10:00:00"), np.datetime64("2024-06-03T10:00:00.500000")
UNSET = np.datetime64("1904-01-01T00:00:00")

pytestmark = pytest.mark.usefixtures("understood_here")


def test_json_to_hdf5_and_back_loses_nothing() -> None:
    odd = {**FRF, "id": "Ω/1", "frequency_hz": [0.1, 1 / 3, 1e9], "load_cycles": 2**53 - 1, "dwell_s": 1e-12}
    given = document(*EVERYTHING["recordings"], {**odd, "id": "µ"}, odd, name="é", units_checked=True)
    assert to_dict(read_file(hdf5(given), "c.h5").campaign) == given
    assert to_dict(read_file(json_file.write(parse(given)), "c.json").campaign) == given


def test_a_campaign_in_csv() -> None:
    reading = read_file(EXAMPLES / "template.csv", "template.csv")
    expected = parse(json_file.document((EXAMPLES / "template.json").read_bytes(), "template.json"))
    assert not reading.problems
    assert to_dict(reading.campaign) == to_dict(expected)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_the_template_as_a_spreadsheet_of_another_country_saves_it(encoding: str) -> None:
    filled = (EXAMPLES / "template.csv").read_text()
    foreign = re.sub(r"(?<=\d)\.(?=\d)", ",", filled.replace(",", ";")).replace("\n", "\r\n")
    foreign = foreign.replace("indenter_radius_mm;preload_n", "Indenter radius (µm);Preload [mN]")
    foreign = foreign.replace("s01;4;1,0", "s01;4000;1000").replace("s02;4;1,0", "s02;4000;1000")
    assert "4000;1000" in foreign
    expected = to_dict(read_file(filled.encode(), "a.csv").campaign)
    assert to_dict(read_file(foreign.encode(encoding), "b.csv").campaign) == expected


@pytest.mark.parametrize(
    ("old", "new", "place", "reason"),
    [
        ("id,sensor", "number,sensor", "line", "no line begins with id"),
        ("preload_n", "preload [mm]", "line 12", "its unit is not of the field"),
        ("preload_n", "colour", "line 12", "'colour' is no field"),
        ("skin.thickness_mm", "thickness_mm", "line 4", "neither of the campaign nor of its skin"),
        ("\nr1,", "\n,", "line 13", "needs an id"),
        (",0.99\n", ",0.99,7\n", "line 13", "10 cells under 9 headings"),
    ],
)
def test_a_template_filled_in_wrongly_is_refused_by_line(old: str, new: str, place: str, reason: str) -> None:
    wrong = (EXAMPLES / "template.csv").read_text().replace(old, new, 1)
    with pytest.raises(FileError, match=reason) as refusal:
        read_file(wrong.encode(), "wrong.csv")
    assert refusal.value.file == "wrong.csv"
    assert refusal.value.place.startswith(place)


@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", "."), ("\t", "."), (";", ","), ("\t", ",")])
def test_an_instruments_table(separator: str, decimal: str) -> None:
    rows = [["Time (ms)", "force", "amplifier [V]"]]
    rows += [
        [str(i), f"{f * 1000:.1f}", f"{-q * 0.01:.4f}"] for i, (f, q) in enumerate(zip(FORCE, CHARGE, strict=True))
    ]
    table = [[cell.replace(".", decimal) for cell in row] for row in rows]
    lines = ["Operator: somebody", f"Sample{separator}palm 3", "", *(separator.join(row) for row in table), ""]
    channels = {**rig().document["channels"], "time_s": {"channel": "Time (ms)"}}
    channels["charge_pc"] = {**channels["charge_pc"], "channel": "amplifier [V]"}
    for text in ("\n".join(lines), "\ufeff" + "\r\n".join(lines)):
        the_time_series(text.encode(), "a.csv", rig(channels=channels))
        assert contents(text.encode(), "a.csv").properties == {"Operator": "somebody", "Sample": "palm 3"}


def test_tdms() -> None:
    assert the_time_series(tdms(2), "run.tdms", rig()) == []
    assert contents(tdms(1), "run.tdms").properties == {"operator": "me", "run.preload": 1.0}


@pytest.mark.parametrize("lost", ["bytes", "length"])
def test_an_interrupted_tdms_acquisition_is_read_up_to_the_last_whole_segment(lost: str) -> None:
    whole = tdms(4)
    last = whole.rindex(b"TDSm")
    cut = whole[:-5] if lost == "bytes" else whole[: last + 12] + b"\xff" * 8 + whole[last + 20 :]
    found = contents(cut, "run.tdms")
    assert [len(channel.values) for channel in found.blocks[0].channels] == [3, 3]
    assert "interrupted" in found.warnings[0]
    assert str(len(cut) - last) in found.warnings[0]
    with pytest.raises(FileError, match="before its first segment was whole"):
        read_contents(tdms(1)[:-1], "run.tdms")


@pytest.mark.parametrize(
    ("stamps", "says"),
    first(
        4,
        [
            ({"channel": {"wf_start_time": JUNE}, "root": {"DateTime": MAY}}, "2024-06-03T10:00:00.500000Z"),
            ({"channel": {"wf_start_time": UNSET}, "group": {"DateTime": MAY}}, "2024-05-03T10:00:00Z"),
            ({"group": {"DateTime": UNSET}, "root": {"DateTime": MAY}}, "2024-05-03T10:00:00Z"),
            ({"root": {"DateTime": "in May"}}, None),
            ({"group": {"DateTime": JUNE}, "root": {"DateTime": MAY}}, "2024-06-03T10:00:00.500000Z"),
            ({"root": {"DateTime": UNSET}}, None),
        ],
    ),
)
def test_a_tdms_file_says_when_it_was_recorded(stamps: dict[str, Any], says: str | None) -> None:
    (recording,) = read_file(tdms(1, **stamps), "run.tdms", rig()).campaign.recordings
    assert recording.recorded_at == says


@pytest.mark.parametrize(
    ("of_file", "of_segment", "says"),
    [
        ("Date|2024/05/03\nTime|10:00:00.3725000620117\n", "", "2024-05-03T10:00:00.372500"),
        (
            "Date|2024/05/03\nTime|10:00:00\n",
            "Date|2024/06/03|2024/06/03\nTime|09:00:00,5|09:00:00,5\n",
            "2024-06-03T09:00:00.500000",
        ),
        ("Date|1903/12/31\nTime|18:00:00\n", "", None),
        ("Date|in May\nTime|10:00:00\n", "", None),
        ("Time|10 o'clock\n", "", None),
    ],
)
def test_an_lvm_file_says_when_it_was_recorded(of_file: str, of_segment: str, says: str | None) -> None:
    text = lvm().replace("X_Columns", f"{of_file}X_Columns".replace("|", "\t"))
    text = text.replace("Channels", f"{of_segment}Channels".replace("|", "\t"))
    first, second = read_file(text.encode(), "run.lvm", rig()).campaign.recordings
    assert (first.recorded_at, second.recorded_at) == (says, says)


def test_lvm() -> None:
    assert the_time_series(lvm().encode(), "run.lvm", rig()) == []
    assert the_time_series(lvm(decimal=",").replace("0.001", "0,001").encode(), "run.lvm", rig()) == []
    assert the_time_series(lvm(separator=",").encode(), "run.lvm", rig()) == []
    assert len(contents(lvm().encode(), "run.lvm").blocks) == 2


def test_an_interrupted_lvm_acquisition_is_said() -> None:
    cut = "\n".join(lvm().splitlines()[:-1])
    assert "interrupted after 3 of 4 samples" in contents(cut.encode(), "run.lvm").warnings[0]
    with pytest.raises(FileError, match=r"run\.lvm: line 16, column 2: 'x' is no number"):
        read_contents(lvm().replace("\t1100.0000", "\tx", 1).encode(), "run.lvm")


@pytest.mark.parametrize("write", [matlab_5, matlab_73])
def test_matlab(write: Any) -> None:
    recording = {**COMMON, "sample_rate_hz": {"property": "fs"}}
    assert the_time_series(write(matlab_variables()), "run.mat", rig(recording=recording)) == []
    assert contents(write(matlab_variables()), "run.mat").properties == {"fs": 1000.0, "operator": "me"}


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "is empty"),
        (b"PK\x03\x04" + bytes(40), "ZIP archive"),
        (b"TDSh" + bytes(40), "TDMS index"),
        (b"\x7fELF\x00\x01", "no format that is read here"),
        (b"hello", "no line holds any; line 1 is .hello."),
        (b"TDSm" + bytes(4), "first segment"),
        (b"MATLAB 5.0 MAT-file" + bytes(300), "no MATLAB file"),
        (b"MATLAB 7.3 MAT-file" + bytes(600), "no MATLAB file"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "HDF5 file is damaged"),
        (b"    -1\n    58\nx\n    -1\n", "dataset 1"),
    ],
)
def test_what_is_no_recording_is_refused_by_its_content(data: bytes, reason: str) -> None:
    with pytest.raises(FileError, match=reason) as refusal:
        read_file(data, "run.csv")
    assert refusal.value.file == "run.csv"
