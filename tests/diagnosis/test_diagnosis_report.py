"""The diagnosis as a user meets it: verdicts on campaigns whose answer is known, bad input by name, the command."""

import gc
import json
import os
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

import underskin
from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import beside, lean_report, whole_report
from tests.support.slip_campaigns import looked_at
from underskin.cli.app import app
from underskin.mechanisms import CATALOGUE
from underskin.recordings import read_file
from underskin.recordings.campaign import Campaign, frf_recordings, to_dict
from underskin.surrogate.sigma_table import SigmaTable

SHARED = os.environ.get("UNDERSKIN_CAMPAIGNS")
SENSORS = Made(sensors=3, repeats=2)


def test_a_diagnosis_leaves_no_campaign_in_memory(table: SigmaTable) -> None:
    def kept() -> int:
        gc.collect()
        return sum(isinstance(entry, Campaign) for entry in gc.get_objects())

    before = kept()
    looked_at(campaign(Made(sensors=1, lines=6), table), table)
    assert kept() == before


def test_a_mechanism_to_leave_out_that_is_not_known_is_named(table: SigmaTable) -> None:
    with pytest.raises(underskin.InvalidInput, match="without"):
        underskin.diagnose(campaign(SENSORS, table), table, without=["gravity"])


@pytest.mark.slow
def test_nothing_is_found_where_nothing_is_missing(table: SigmaTable) -> None:
    report = whole_report(campaign(SENSORS, table), table)
    assert report["verdict"] == "no_mismatch"
    assert report["mechanisms"] == []
    assert report["findings"] == [
        {
            "code": "constant_axis",
            "recording": "",
            "field": "dynamic_force_n",
            "statement": "dynamic_force_n is the same in all recordings",
        }
    ]
    assert report["fit"]["after"]["heldout_rmse_percent"] < 1.3 * report["fit"]["noise_floor_percent"]


@pytest.mark.slow
def test_what_has_no_name_is_declared_unexplained_and_described(table: SigmaTable) -> None:
    whole = campaign(replace(SENSORS, lines=40), table)
    notched = []
    for entry in frf_recordings(whole):
        assert entry.frequency_hz is not None
        assert entry.frf_re_pc_per_n is not None
        left = 1 - 0.3 / (1 + ((entry.frequency_hz - 20.0) / 3.0) ** 2)
        notched.append(replace(entry, frf_re_pc_per_n=entry.frf_re_pc_per_n * left))
    known = beside("contact_resonance", "timing_delay", "amplifier_high_pass", "mains_pickup", "sensor_relaxation")
    report = lean_report(replace(whole, recordings=tuple(notched)), table, *known)
    assert report["verdict"] == "unexplained"
    law = report["unnamed"]
    assert (law["acts_on"], law["axis"], law["form"]) == ("frequency_response", "frequency_hz", "notch")
    centre = next(entry["value"] for entry in law["parameters"] if entry["name"] == "centre")
    assert centre == pytest.approx(20.0, abs=0.5)
    assert law["heldout_rmse_percent"]["after"] < law["heldout_rmse_percent"]["before"]
    axes = {entry["axis"]: entry["p_value"] for entry in report["location"]["axes"]}
    assert axes["frequency_hz"] == 0.001
    assert axes["preload_n"] > 0.05


@pytest.mark.parametrize("count", [1, 12])
def test_too_little_is_said_to_be_too_little(count: int, table: SigmaTable) -> None:
    alone = Made(sensors=1, preloads_n=(1.0,), spheres_mm=(4.0,), lines=count)
    report = looked_at(campaign(alone, table), table)
    assert report["verdict"] == "insufficient_data"
    assert "at least 2" in report["statement"]
    two = looked_at(campaign(replace(alone, preloads_n=(0.5, 1.5), lines=12), table), table)
    assert two["verdict"] == "insufficient_data"
    assert "at least 3 are needed" in two["statement"]


@pytest.mark.slow
@pytest.mark.parametrize(("count", "lines"), first(1, [(2, 1), (5, 9), (2, 9), (5, 1)]))
def test_few_recordings_or_one_line_never_crash(count: int, lines: int, table: SigmaTable) -> None:
    whole = campaign(replace(SENSORS, lines=lines), table)
    report = whole_report(replace(whole, recordings=whole.recordings[:count]), table)
    assert report["verdict"] in ("no_mismatch", "insufficient_data")


@pytest.mark.slow
def test_the_command_writes_a_report_for_each_readable_file(tmp_path: Path, table: SigmaTable) -> None:
    good, bad = tmp_path / "palm.json", tmp_path / "torn.json"
    good.write_text(json.dumps(to_dict(campaign(SENSORS, table))), encoding="utf-8")
    bad.write_text("{", encoding="utf-8")
    left_out = [word for name in beside("ageing") for word in ("--without", name)]
    asked = ["diagnose", str(bad), str(good), "--output-dir", str(tmp_path / "reports"), "--workers", "1", *left_out]
    result = CliRunner().invoke(app, asked)
    assert result.exit_code == 2
    assert "torn.json" in result.stderr
    report = json.loads((tmp_path / "reports" / "palm.json").read_text(encoding="utf-8"))
    assert report["schema"] == "report/1"
    assert f"{good}: {report['headline'].rstrip('.')} ({report['verdict']}).\n{report['statement']}\n" in result.stderr
    assert [file.name for file in (tmp_path / "reports").iterdir()] == ["palm.json"]


def test_campaigns_of_one_name_are_told_what_to_do(tmp_path: Path) -> None:
    files = [tmp_path / folder / "campaign.json" for folder in ("monday", "tuesday")]
    asked = ["diagnose", *map(str, files), "--campaign", "campaign", "--output-dir", str(tmp_path / "reports")]
    result = CliRunner(env={"COLUMNS": "400"}).invoke(app, asked)
    assert result.exit_code == 2
    assert f"{files[0]} and {files[1]} and --campaign campaign would all become campaign.json" in result.stderr
    assert "with an --output-dir of its own" in result.stderr
    assert not (tmp_path / "reports").exists()


@pytest.mark.slow
@pytest.mark.skipif(SHARED is None, reason="UNDERSKIN_CAMPAIGNS is not set")
@pytest.mark.parametrize(
    ("name", "verdict"),
    first(1, [("cxcz7s613", "unexplained"), ("c2pdsjnae", "no_mismatch"), ("c4chxhg3d", "explained")]),
)
def test_campaigns_of_another_rig(name: str, verdict: str, table: SigmaTable) -> None:
    assert SHARED is not None
    report = whole_report(read_file(Path(SHARED) / "open" / f"{name}.json", name).campaign, table)
    assert report["verdict"] == verdict
    assert {entry["name"] for entry in report["mechanisms"]} <= set(CATALOGUE)


@pytest.mark.slow
@pytest.mark.skipif(SHARED is None, reason="UNDERSKIN_CAMPAIGNS is not set")
def test_layer_unseen_beside_edge(table: SigmaTable) -> None:
    """A layer that does not show beside the moving edge is integrated over: its weight is that of the edge, and no
    rival of the edge gains by it."""
    assert SHARED is not None
    report = whole_report(read_file(Path(SHARED) / "solved-open" / "frf" / "fyqp7v6a9.json", "edge").campaign, table)
    assert report["verdict"] == "explained"
    assert [entry["name"] for entry in report["mechanisms"]] == ["moving_contact_edge"]
    (layer,) = report["idealised"]
    assert layer["name"] == "layered_contact"
    assert layer["probability"] > 0.8


@pytest.mark.slow
@pytest.mark.skipif(SHARED is None, reason="UNDERSKIN_CAMPAIGNS is not set")
def test_edge_held_in_part_is_a_guess(table: SigmaTable) -> None:
    """A sphere that sticks is not taken, with confidence, for one whose contact edge moves by a third: contact with the
    layer and a free edge is no guess, an edge held in part is one."""
    assert SHARED is not None
    report = whole_report(read_file(Path(SHARED) / "solved-open" / "frf" / "f3g5qfgzw.json", "stuck").campaign, table)
    assert report["verdict"] == "ambiguous"
    assert "sticking_contact" in [entry["name"] for entry in report["mechanisms"]]
