"""`underskin read`: what would be taken from a file, and a draft of its rig description."""

from pathlib import Path
from typing import Any

import openpyxl
import pytest
import yaml

from tests.cli.commands import run

pytestmark = pytest.mark.slow

LINES = [(10.0, 7.0, -2.0), (20.0, 7.25, -4.5), (40.0, 7.5, -9.0), (80.0, 7.6, -18.0)]
LONG = "Sensor;Sphere diameter [mm];Preload [N];Dynamic force [N];Frequency [Hz];|H| [pC/N];Phase [deg]"
WIDE = "f [Hz],s01 |H| [pC/N],s01 phase [deg],s02 |H| [pC/N],s02 phase [deg]"
HEADED = "# fs: 2 kHz\n# Preload: 1.5 N\n# Sensor: s07\nForce [N],Charge [pC]"
SERIES = "Time [s],Force [N],Charge [pC]"
CURVE = "Depth [mm]\tLoad [mN]"


def write_table(folder: Path, form: str) -> Path:
    file = folder / f"{form}.csv"
    if form == "long":
        rows = [f"{sensor};8,0;0,5;0,05;{hz};{size};{phase}" for sensor in ("s01", "s02") for hz, size, phase in LINES]
        file.write_text("\n".join([LONG, *(row.replace(".", ",") for row in rows)]))
    elif form == "wide":
        file.write_text("\n".join([WIDE, *(f"{hz},{size},{phase},{size},{phase}" for hz, size, phase in LINES)]))
    elif form == "series":
        file.write_text("\n".join([SERIES, *(f"{row / 1000},{1 + row % 2},{7 + 7 * (row % 2)}" for row in range(64))]))
    elif form == "headed":
        file.write_text("\n".join([HEADED, *(f"{1 + row % 2},{7 + 7 * (row % 2)}" for row in range(64))]))
    elif form == "merged":
        write_merged(file := file.with_suffix(".xlsx"))
    else:
        file.write_text("\n".join([CURVE, *(f"{row / 100}\t{row**1.5:.4f}" for row in range(30))]))
    return file


def write_merged(file: Path) -> None:
    """Two sensors by number and two preloads each, in cells that are merged over their lines; a merged title."""
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(["May", None, "all sensors"])
    sheet.append(["Sensor", "Preload [N]", "Frequency [Hz]", "|H| [pC/N]", "Phase [deg]"])
    sheet.merge_cells("A1:B1")
    for number in range(4):
        for line, (hz, size, phase) in enumerate(LINES):
            sheet.append([None, None, hz, size, phase])
            if line == 0:
                sheet.cell(sheet.max_row, 1, 1 + number // 2 if number % 2 == 0 else None)
                sheet.cell(sheet.max_row, 2, 0.5 + number % 2)
        sheet.merge_cells(f"B{3 + 4 * number}:B{6 + 4 * number}")
    for first in (3, 11):
        sheet.merge_cells(f"A{first}:A{first + 7}")
    book.save(file)


def completed(document: dict[str, Any]) -> dict[str, Any]:
    """The draft with what is missing filled in."""
    values = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16, "sensor_radius_mm": 1.5, "indenter_radius_mm": 4}
    values |= {"preload_n": 0.5, "dynamic_force_n": 0.05}
    for part in ("skin", "recording"):
        document[part] |= {name: values[name] for name, value in document[part].items() if value is None}
    for number, sensor in enumerate(document["skin"].get("sensors", [])):
        sensor |= {"x_mm": 8 * number, "y_mm": 0}
    return document


@pytest.mark.parametrize(
    ("form", "missing", "recordings"),
    [
        ("long", "skin.thickness_mm, skin.youngs_modulus_mpa, skin.sensor_radius_mm, skin.sensors", 2),
        (
            "wide",
            "skin.sensor_radius_mm, recording.indenter_radius_mm, recording.preload_n, recording.dynamic_force_n",
            2,
        ),
        ("series", "skin.sensor_radius_mm, recording.indenter_radius_mm, recording.preload_n", 1),
        ("headed", "skin.sensor_radius_mm, recording.indenter_radius_mm", 1),
        ("merged", "recording.indenter_radius_mm, recording.dynamic_force_n, skin.sensors", 4),
        ("curve", "# To be completed: recording.indenter_radius_mm.", 1),
    ],
)
def test_a_completed_draft_reads_the_file(form: str, missing: str, recordings: int, tmp_path: Path) -> None:
    """What is read without a rig description says what is lacking; completed, the file is read."""
    file, rig = write_table(tmp_path, form), tmp_path / "rig.yaml"
    refused = run("d33", str(file))
    assert refused.returncode == 2
    assert "`underskin read FILE --draft rig.yaml` writes one to complete" in refused.stderr
    answer = run("read", str(file), "--draft", str(rig))
    assert (answer.returncode, answer.stderr) == (0, "")
    assert missing in rig.read_text()
    assert yaml.safe_load(run("read", str(file)).stdout.partition("\n\n")[2]) == yaml.safe_load(rig.read_text())
    incomplete = run("read", str(file), "--rig", str(rig))
    assert incomplete.returncode == 2
    assert "Traceback" not in incomplete.stderr
    rig.write_text(yaml.safe_dump(completed(yaml.safe_load(rig.read_text()))))
    read = run("read", str(file), "--rig", str(rig))
    assert read.returncode == 0
    assert f": {recordings} recordings" in read.stdout
    assert "left out" not in read.stdout


def test_a_draft_takes_what_the_file_states(tmp_path: Path) -> None:
    """Rate, preload and sensor stated above the columns are in the draft, and count once it is completed."""
    file, rig = write_table(tmp_path, "headed"), tmp_path / "rig.yaml"
    run("read", str(file), "--draft", str(rig))
    draft = yaml.safe_load(rig.read_text())
    assert sorted(name for name, value in draft["recording"].items() if value is not None) == [
        *("preload_n", "sample_rate_hz", "sensor"),
    ]
    assert [sensor["id"] for sensor in draft["skin"]["sensors"]] == ["s07"]
    rig.write_text(yaml.safe_dump(completed(draft)))
    assert "sensor s07, preload_n 1.5, indenter_radius_mm 4" in run("read", str(file), "--rig", str(rig)).stdout


def test_a_column_with_blank_cells_is_told(tmp_path: Path) -> None:
    """A number that stands once above the lines that it is for is no column, and is said to be left out."""
    file = tmp_path / "sparse.csv"
    rows = [f"{'' if line else number},{hz},{size}" for number in (1, 2) for line, (hz, size, _) in enumerate(LINES)]
    file.write_text("\n".join(["Sensor,Frequency [Hz],|H| [pC/N]", *rows]))
    told = "column 'Sensor' has a number in 2 of 8 rows, and is left out: fill its blank cells (those at its end may"
    assert told in " ".join(run("read", str(file)).stdout.split())


def test_the_table_says_what_each_column_is_taken_for(tmp_path: Path) -> None:
    answer = run("read", str(write_table(tmp_path, "long")))
    rows = {line.partition("  ")[0]: line.split()[-1] for line in answer.stdout.splitlines() if line}
    assert rows["Sensor"] == "sensor"
    assert rows["Sphere diameter [mm]"] == "indenter_radius_mm"
    assert rows["Preload [N]"] == "preload_n"
    assert rows["|H| [pC/N]"] == "frf_magnitude_pc_per_n"


def test_a_file_that_says_enough_lists_its_recordings(tmp_path: Path) -> None:
    """Beside the draft, by which it is read; `d33` reads it without."""
    file = write_table(tmp_path, "curve")
    file.write_text(f"Tip radius (mm): 4\n\n{file.read_text()}")
    answer = run("read", str(file))
    assert (answer.returncode, answer.stderr) == (0, "")
    assert "campaign curve: 1 recordings\n  curve: indentation, indenter_radius_mm 4.0\n" in answer.stdout
    assert "look at: read without a rig description" in answer.stdout
    answer = run("d33", str(file))
    assert answer.returncode == 0
    assert "'Tip radius (mm)' as indenter_radius_mm, poisson_ratio 0.5 assumed" in " ".join(answer.stdout.split())


def test_a_draft_is_never_overwritten(tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text("mine")
    answer = run("read", str(write_table(tmp_path, "curve")), "--draft", str(rig))
    assert answer.returncode == 2
    assert "is there already, and is not overwritten" in answer.stderr
    assert rig.read_text() == "mine"
