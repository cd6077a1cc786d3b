"""The command line as a user runs it: what it prints, computes, and says when something is wrong."""

import csv
import io
import subprocess
from pathlib import Path

import numpy as np
import openpyxl
import pytest

import underskin
from tests.cli.commands import COMMAND, FRF, PRESSED, SKIN, refused, run
from underskin import Client


def columns(*arguments: str, given: str = "") -> dict[str, list[str]]:
    """The columns that a command writes with --csv."""
    answer = run(*arguments, "--csv", given=given)
    assert answer.returncode == 0
    other = "underskin: d33 in contact with the layer itself (solved)"
    assert all(line.startswith(other) for line in answer.stderr.splitlines())
    header, *rows = csv.reader(io.StringIO(answer.stdout))
    return {name: list(cells) for name, cells in zip(header, zip(*rows, strict=True), strict=True)}


def numbers(cells: list[str]) -> list[float]:
    return [float(cell) for cell in cells]


def test_frf_agrees_with_the_service(server_url: str) -> None:
    preload = [0.5, 1.0, 3.0, 300.0]
    written = columns(*FRF, "--preload-n", "0.5,1", "--preload-n", "3,300")
    with Client(server_url) as client:
        answer = client.frf(**PRESSED, preload_n=preload, d33_pc_per_n=14.0)
    assert numbers(written["preload_n"]) == preload
    for name in ("contact_radius_mm", "a_over_h", "load_parameter", "sigma", "rel_error", "mean_stress_mpa"):
        assert numbers(written[name]) == pytest.approx(getattr(answer, name), rel=1e-12, nan_ok=True)
    assert numbers(written["frf_pc_per_n"]) == pytest.approx(answer.frf_pc_per_n, rel=1e-12, nan_ok=True)
    assert written["status"] == answer.status.tolist() == ["ok", "ok", "ok", "out_of_domain"]


@pytest.mark.slow
def test_a_d33_that_no_sensor_has_is_answered_and_named() -> None:
    for frf, said in (("7400", "more than sensors have"), ("0.0074", "less than sensors have"), ("-7.4", "negative")):
        found = run("d33", *SKIN, "--preload-n", "1", "--frf-pc-per-n", frf)
        assert found.returncode == 0
        assert f"look at d33_pc_per_n: d33 is {float(frf) * 1.8932:.3g} pC/N, {said}" in found.stderr


@pytest.mark.slow
def test_d33_takes_back_what_frf_gave_through_csv() -> None:
    frf = columns(*FRF, "--preload-n", "1,3")["frf_pc_per_n"]
    table = f"preload_n,frf_pc_per_n\n1,{frf[0]}\n\n3,{frf[1]}\n"
    back = columns("d33", *SKIN, "--input", "-", "--frf-uncertainty-pc-per-n", "0.074", given=table)
    assert numbers(back["d33_pc_per_n"]) == pytest.approx([14, 14], rel=1e-12)
    expected = 0.074 * 14 / np.array(numbers(frf))
    assert numbers(back["d33_uncertainty_pc_per_n"]) == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
def test_sigma_of_both_models() -> None:
    layer = columns("sigma", "--a-over-h", "0.3,4", "--rt-over-h", "0.6", "--load-parameter", "0.01")
    expected = underskin.load_table().sigma(0.3, 0.6, 0.01)
    assert float(layer["sigma"][0]) == pytest.approx(float(expected.sigma), rel=1e-15)
    assert (layer["sigma"][1], layer["status"][1]) == ("NaN", "out_of_domain")
    half_space = columns("sigma", "--a-over-h", "2,20", "--rt-over-h", "0", "--model", "half_space")
    assert float(half_space["sigma"][0]) == pytest.approx(0.2, rel=1e-9)
    assert half_space["status"] == ["ok", "out_of_domain"]


@pytest.mark.slow
def test_table_shows_units_and_what_a_status_means() -> None:
    shown = run(*FRF, "--preload-n", "1,300").stdout
    for text in (
        "thickness h",
        "2.5",
        "mm",
        "16",
        "MPa",
        "7.3958",
        "pC/N",
        "out_of_domain: L = 1.17 exceeds 0.1: at most 25.6 N",
    ):
        assert text in shown
    assert "The domain is a/h 0 to 3" in shown
    assert run(*FRF, "--preload-n", "1").stdout.split()[-2:] == ["status", "ok"]


@pytest.mark.slow
def test_csv_file_written_by_a_spreadsheet(tmp_path: Path) -> None:
    sheet = tmp_path / "measured.csv"
    sheet.write_bytes("\ufeffpreload_n , frf_pc_per_n\r\n1,7.4\r\n3,11.5\r\n".encode())
    written = columns("d33", *SKIN, "--input", str(sheet))["d33_pc_per_n"]
    assert len(written) == 2
    sheet.write_bytes(b"sep=;\r\nPress;preload_n;frf_pc_per_n\r\nerste;1,0;7,4\r\n# Pause\r\nzweite;3;11,5\r\n")
    german = columns("d33", *SKIN, "--input", str(sheet))
    assert (german["Press"], german["d33_pc_per_n"]) == (["erste", "zweite"], written)
    sheet.write_bytes(",ID,Preload [mN],FRF_pC_per_N,\n0,17,1000,7.4,\n1,18,3000,11.5,\n".encode("utf-16"))
    capitals = columns("d33", *SKIN, "--input", str(sheet))
    assert (capitals["ID"], capitals["d33_pc_per_n"]) == (["17", "18"], written)
    sheet.write_text("A_over_h,RT_over_h\n0.3,0.6\n")
    assert columns("sigma", "--input", str(sheet))["a_over_h"] == ["0.3"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([*FRF, "--preload-n", "1,-1"], "preload_n[1] = -1.0: must be finite and greater than 0 (N)"),
        ([*FRF, "--preload-n", "1,x"], "preload_n[1] = 'x': must be a number"),
        ([*FRF, "--preload-n", ""], "preload_n = '': must be a number"),
        (FRF, "preload_n is missing: give --preload-n, or a column preload_n in the CSV file of --input"),
        ([*FRF, "--preload-n", "1", "--poisson-ratio", "0.6"], "poisson_ratio = 0.6: must be 0 to 0.5"),
        (
            ["frf", "--thickness-mm", "2500", *SKIN[2:], "--d33-pc-per-n", "14", "--preload-n", "1"],
            "was it given in µm?",
        ),
        (
            ["sigma", "--a-over-h", "1,2", "--rt-over-h", "1,2,3"],
            "rt_over_h = '3 rows': must have as many rows as a_over_h",
        ),
        (["sigma", "--a-over-h", "-1", "--rt-over-h", "1"], "a_over_h = -1.0: must be finite and at least 0"),
        (["d33", *SKIN, "--preload-n", "1", "--frf-pc-per-n", "nan"], "frf_pc_per_n = nan: must be finite"),
        (
            ["sigma", "--input", "nowhere.csv"],
            "input = 'nowhere.csv': must be a readable CSV or .xlsx file (No such file",
        ),
        (["sigma", "--model", "jelly", "--a-over-h", "1"], "'jelly' is not one of"),
        (["sigma", "--a-over-h", "1", "--b-over-h", "1"], "No such option: --b-over-h"),
        (["guess"], "No such command 'guess'"),
    ],
)
def test_bad_input_is_one_line_and_status_2(arguments: list[str], says: str) -> None:
    line = refused(*arguments)
    assert line.startswith("underskin: ")
    assert says in line


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "must have a header of field names and at least one row"),
        ("preload_n,frf_pc_per_n\n", "at least one row"),
        ("preload_n;frf_pc_per_n\n1;7\n3;1.00,5\n", "frf_pc_per_n[1] = '1.00,5': must be a number"),
        ("preload_n,frf_pc_per_n,humidity\n1,7,40\n", "has the column 'humidity'; allowed, once each"),
        ("prelod_n,frf_pc_per_n\n1,7\n", "has the column 'prelod_n'; did you mean preload_n? Allowed, once each"),
        ("preload_n,frf_magnitude_pc_per_n\n1,7\n", "needs frf_phase_deg or frf_phase_rad with it"),
        ("preload_n,preload_n\n1,7\n", "must name each field once; its header has 'preload_n' twice"),
        (
            "preload_n,frf_pc_per_n\n1,7\n1\n",
            "must have as many cells in each row as in the header: 1 on line 3, 2 in the header",
        ),
        ("preload_n,frf_pc_per_n\n1,7\n3,-\n", "frf_pc_per_n[1] = '-': must be a number (line 3)"),
        ("# mb\npreload_n,frf_pc_per_n\n\n1,x\n", "frf_pc_per_n[0] = 'x': must be a number (line 4)"),
        ('preload_n,frf_pc_per_n\n"1,000",7\n', "(line 2); 1,000 can be 1000 or 1.000: write it without a comma"),
        ("preload_n,Preload [mN],frf_pc_per_n\n1,1000,7\n", "'preload_n' twice: 'preload_n' and 'Preload [mN]'"),
        ("preload_n,thickness_mm,frf_pc_per_n\n1,1,7\n", "thickness_mm = '2.5': is also a column of -; give it once"),
        ('preload_n,frf_pc_per_n\n"1,7\n', "must be readable as CSV"),
    ],
)
def test_bad_csv_is_one_line_and_status_2(text: str, says: str) -> None:
    assert says in refused("d33", *SKIN, "--input", "-", given=text)


@pytest.mark.slow
def test_what_is_read_otherwise_than_headed_or_left_out_is_told() -> None:
    table = "preload_n,indenter_diameter_mm,frf_pc_per_n\n1,8,7\n\nmeasured by mb, in the cold room\n"
    found = run("d33", *SKIN[:6], "--input", "-", "--csv", given=table)
    assert found.stderr.splitlines() == [
        "underskin: line 4 under the table, 'measured by mb, in the cold room', is left out",
        "underskin: 'indenter_diameter_mm' is halved",
    ]
    (radius,) = next(csv.DictReader(io.StringIO(found.stdout)))["indenter_radius_mm"].split()
    assert float(radius) == 4


@pytest.mark.slow
@pytest.mark.parametrize("command", [["d33"], ["diagnose"], ["diagnose", "--together", "all"]])
def test_missing_file_is_named_once(command: list[str], tmp_path: Path) -> None:
    """A file that does not exist is named once, with the reason."""
    file = str(tmp_path / "none.csv")
    answer = run(*command, file, *(["--output-dir", str(tmp_path)] if command[0] == "diagnose" else []), COLUMNS="200")
    assert answer.returncode == 2
    assert answer.stderr.count(file) == 1
    assert "cannot be opened: No such file" in answer.stderr


def test_missing_table_says_what_to_do(tmp_path: Path) -> None:
    line = refused(*FRF, "--preload-n", "1", UNDERSKIN_TABLES=str(tmp_path))
    assert "sigma.h5 cannot be read: No such file or directory. Restore it" in line


def test_help_lists_all_commands_without_loading_them() -> None:
    report = run("--help", PYTHONPROFILEIMPORTTIME="1")
    for command in ("sigma", "frf", "d33", "serve", "key", "tablegen"):
        assert command in report.stdout
    assert "Serve σ, FRF and d33 over HTTP." in report.stdout
    loaded = {line.rpartition("|")[2].strip() for line in report.stderr.splitlines()}
    assert "underskin.cli" in loaded
    assert loaded.isdisjoint({"numpy", "scipy", "fastapi", "skfem", "httpx", "service.cli.serve", "tablegen.commands"})


@pytest.mark.slow
def test_commands_of_other_packages_get_their_arguments(tmp_path: Path) -> None:
    made = run("key", "create", "bench-1", UNDERSKIN_DATA=str(tmp_path))
    assert (made.returncode, made.stderr) == (0, "")
    assert "bench-1" in run("key", "list", UNDERSKIN_DATA=str(tmp_path)).stdout
    assert "--port" in run("serve", "--help").stdout
    assert "Invalid value for '--port'" in refused("serve", "--port", "seven")


@pytest.mark.slow
def test_reader_that_goes_away() -> None:
    """As `underskin … | head` does."""
    many = ",".join(["1"] * 5_000)
    command = [str(COMMAND), *FRF, "--preload-n", many, "--csv"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == b""


@pytest.mark.slow
def test_columns_come_from_a_sheet_of_a_workbook_by_its_name(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    book.active.append(["measured by", "mb"])
    sheet = book.create_sheet("Day 2")
    for row in (["a_over_h", "rt_over_h"], [0.3, 0.6], [0.5, 0.6]):
        sheet.append(row)
    file, text = tmp_path / "points.xlsx", tmp_path / "points.csv"
    book.save(file)
    text.write_text("a_over_h,rt_over_h\n0.3,0.6\n0.5,0.6\n")
    of_csv = run("sigma", "--input", str(text), "--csv").stdout
    assert run("sigma", "--input", str(file), "--sheet", "Day 2", "--csv").stdout == of_csv
    assert "those with anything in them: 'Sheet', 'Day 2'" in refused("sigma", "--input", str(file))
    assert "is no workbook" in refused("sigma", "--input", str(text), "--sheet", "Day 2")
    assert "--sheet goes with --input" in refused("sigma", "--a-over-h", "1", "--rt-over-h", "1", "--sheet", "Day 2")
