"""The diagnosis as a user meets it: verdicts on campaigns whose answer is known, bad input by name, the commands."""

import gc
import json
import os
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import COSTLY, lean_report
from tests.support.mechanism_campaigns import indentation_campaign
from underskin.cli.app import app
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.mechanisms import CATALOGUE, compose
from underskin.recordings.campaign import Campaign, FrfRecording, IndentationRecording, to_dict
from underskin.surrogate.sigma_table import SigmaTable

SHARED = os.environ.get("UNDERSKIN_CAMPAIGNS")
SENSORS = Made(sensors=3, repeats=2)


def names(report: dict[str, Any]) -> set[str]:
    return {entry["name"] for entry in report["mechanisms"]}


def changed(original: Campaign, number: int, change: Callable[[FrfRecording], FrfRecording]) -> Campaign:
    recordings = list(original.recordings)
    entry = recordings[number]
    assert isinstance(entry, FrfRecording)
    recordings[number] = change(entry)
    return replace(original, recordings=tuple(recordings))


def scaled(entry: FrfRecording, factor: float) -> FrfRecording:
    assert entry.frf_re_pc_per_n is not None
    assert entry.frf_im_pc_per_n is not None
    return replace(
        entry, frf_re_pc_per_n=factor * entry.frf_re_pc_per_n, frf_im_pc_per_n=factor * entry.frf_im_pc_per_n
    )


@pytest.mark.parametrize("made", [SENSORS, Made(lines=12, repeats=2)], ids=["one line", "twelve lines"])
def test_a_diagnosis_leaves_no_campaign_in_memory(table: SigmaTable, made: Made) -> None:
    def kept() -> int:
        gc.collect()
        return sum(isinstance(entry, Campaign) for entry in gc.get_objects())

    before = kept()
    diagnosis_report(campaign(made, table), table)
    assert kept() == before


@pytest.mark.slow
def test_nothing_is_found_where_nothing_is_missing(table: SigmaTable) -> None:
    report = diagnosis_report(campaign(SENSORS, table), table)
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


@pytest.fixture(scope="module")
def reported(table: SigmaTable) -> Callable[[Made], str]:
    """The report on such a campaign, as JSON, made once for all tests here."""
    return cache(lambda made: json.dumps(diagnosis_report(campaign(made, table), table)))


HIGH_PASS = replace(SENSORS, mechanisms=("amplifier_high_pass",), parameters=(0.6,))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("made", "value"),
    [
        (HIGH_PASS, 0.6),
        (replace(SENSORS, mechanisms=("ageing",), parameters=(0.2, 300.0, 0.0)), None),
        (replace(SENSORS, mechanisms=("sensor_spread",), parameters=(0.2,), sensors=6), None),
        (Made(("misalignment",), (0.5, 0.4), offsets_mm=(-2.0, 0.0, 2.0)), 0.5),
    ],
)
def test_what_is_missing_is_named_with_its_parameters(
    made: Made, value: float | None, reported: Callable[[Made], str]
) -> None:
    report = json.loads(reported(made))
    assert report["verdict"] == "explained"
    assert names(report) == set(made.mechanisms)
    assert report["probability"] > 0.8
    first = report["mechanisms"][0]["parameters"][0]
    assert first["low"] <= first["value"] <= first["high"]
    if value is not None:
        assert first["low"] <= value <= first["high"]
    fit = report["fit"]
    assert fit["after"]["heldout_rmse_percent"] < fit["before"]["heldout_rmse_percent"]
    assert report["location"]["axes"]
    assert report["d33"]["low"] < 15.0 < report["d33"]["high"]


@pytest.mark.slow
def test_what_has_no_name_is_declared_unexplained_and_described(table: SigmaTable) -> None:
    def notch(entry: FrfRecording) -> FrfRecording:
        assert entry.frequency_hz is not None
        assert entry.frf_re_pc_per_n is not None
        depth = 1 - 0.3 / (1 + ((entry.frequency_hz - 20.0) / 3.0) ** 2)
        return replace(entry, frf_re_pc_per_n=entry.frf_re_pc_per_n * depth)

    whole = campaign(replace(SENSORS, lines=40), table)
    for number in range(len(whole.recordings)):
        whole = changed(whole, number, notch)
    report = diagnosis_report(whole, table)
    assert report["verdict"] == "unexplained"
    law = report["unnamed"]
    assert (law["acts_on"], law["axis"], law["form"]) == ("frequency_response", "frequency_hz", "notch")
    centre = next(entry["value"] for entry in law["parameters"] if entry["name"] == "centre")
    assert centre == pytest.approx(20.0, abs=0.5)
    assert law["heldout_rmse_percent"]["after"] < law["heldout_rmse_percent"]["before"]
    axes = {entry["axis"]: entry["p_value"] for entry in report["location"]["axes"]}
    assert axes["frequency_hz"] == 0.001
    assert axes["preload_n"] > 0.05


@pytest.mark.slow
def test_the_same_input_gives_the_same_report(reported: Callable[[Made], str], table: SigmaTable) -> None:
    assert json.dumps(diagnosis_report(campaign(HIGH_PASS, table), table)) == reported(HIGH_PASS)


@pytest.mark.slow
def test_twins_are_reported_as_such(table: SigmaTable) -> None:
    """At one amplitude a moving edge and a finite amplitude cannot be told apart; neither is guessed."""
    made = replace(SENSORS, mechanisms=("moving_contact_edge",), parameters=(0.9,), thickness_mm=1.2)
    report = diagnosis_report(campaign(made, table), table)
    assert report["verdict"] == "ambiguous"
    pairs = [{entry["mechanism"], entry["confounded_with"]} for entry in report["not_identifiable"]]
    assert {"moving_contact_edge", "amplitude_nonlinearity"} in pairs


def codes(report: dict[str, Any]) -> set[tuple[str, str]]:
    return {(entry["code"], entry["recording"]) for entry in report["findings"]}


BAD: list[tuple[str, Callable[[FrfRecording], FrfRecording]]] = [
    ("units_off_by_1000", lambda entry: scaled(entry, 1000.0)),
    ("sign_flipped", lambda entry: scaled(entry, -1.0)),
    ("no_response", lambda entry: scaled(entry, 0.0)),
    ("units_off_by_1000", lambda entry: scaled(entry, 1e-3)),
    ("no_finite_line", lambda entry: scaled(entry, np.nan)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("code", "change"), first(3, BAD))
def test_one_bad_recording_is_named_and_no_mechanism_absorbs_it(
    code: str, change: Callable[[FrfRecording], FrfRecording], table: SigmaTable
) -> None:
    report = diagnosis_report(changed(campaign(SENSORS, table), 3, change), table)
    assert (code, "r3") in codes(report)
    assert report["verdict"] == "no_mismatch"


@pytest.mark.slow
def test_a_copy_is_named(table: SigmaTable) -> None:
    whole = campaign(SENSORS, table)
    copies = tuple(replace(entry, id=f"{entry.id} copy") for entry in whole.recordings[:4])
    report = diagnosis_report(replace(whole, recordings=(*whole.recordings, *copies)), table)
    assert ("duplicated_recording", "r2 copy") in codes(report)
    assert report["verdict"] == "no_mismatch"


@pytest.mark.slow
def test_units_of_the_whole_campaign(table: SigmaTable) -> None:
    whole = campaign(SENSORS, table)
    for number in range(len(whole.recordings)):
        whole = changed(whole, number, lambda entry: scaled(entry, 1000.0))
    report = diagnosis_report(whole, table)
    assert ("units_off_by_1000", "") in codes(report)
    assert report["verdict"] == "no_mismatch"


@pytest.mark.parametrize("count", [1, 12])
def test_too_little_is_said_to_be_too_little(count: int, table: SigmaTable) -> None:
    alone = Made(sensors=1, preloads_n=(1.0,), spheres_mm=(4.0,), lines=count)
    report = diagnosis_report(campaign(alone, table), table)
    assert report["verdict"] == "insufficient_data"
    assert "at least 2" in report["statement"]


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 5])
def test_few_recordings_or_one_line_never_crash(count: int, table: SigmaTable) -> None:
    for count_of_lines in (1, 9):
        whole = campaign(replace(SENSORS, lines=count_of_lines), table)
        report = diagnosis_report(replace(whole, recordings=whole.recordings[:count]), table)
        assert report["verdict"] in ("no_mismatch", "insufficient_data")


@pytest.mark.slow
def test_the_command_writes_a_report_for_each_readable_file(tmp_path: Path, table: SigmaTable) -> None:
    good, bad = tmp_path / "palm.json", tmp_path / "torn.json"
    good.write_text(json.dumps(to_dict(campaign(SENSORS, table))), encoding="utf-8")
    bad.write_text("{", encoding="utf-8")
    result = CliRunner().invoke(
        app, ["diagnose", str(bad), str(good), "--output-dir", str(tmp_path / "reports"), "--workers", "1"]
    )
    assert result.exit_code == 2
    assert "torn.json" in result.stderr
    report = json.loads((tmp_path / "reports" / "palm.json").read_text(encoding="utf-8"))
    assert report["schema"] == "report/1"
    assert f"{good}: {report['verdict']}\n{report['statement']}\n" in result.stderr
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
def test_a_plan_separates_what_is_confusable(tmp_path: Path, table: SigmaTable) -> None:
    made = replace(
        SENSORS, mechanisms=("strain_stiffening",), parameters=(8.0,), modulus_mpa=2.7, offsets_mm=(0.0, 0.8)
    )
    file = tmp_path / "palm.json"
    file.write_text(json.dumps(to_dict(campaign(made, table))), encoding="utf-8")
    asked = ["--preload-n", "0.2", "6.0", "--recordings", "6", "--offset-mm", "0", "--offset-mm", "60"]
    result = CliRunner().invoke(app, ["plan", str(file), *asked])
    assert result.exit_code == 0
    planned = json.loads(result.stdout)
    assert planned["probability_of_deciding"] > planned["without_it"]
    assert sum(entry["repeats"] for entry in planned["recordings"]) <= 6
    assert all(0.2 <= entry["preload_n"] <= 6.0 for entry in planned["recordings"])
    places = {entry.id: [entry.x_mm, entry.y_mm] for entry in campaign(made, table).skin.sensors}
    assert all(entry["position_mm"] == places[entry["sensor"]] for entry in planned["recordings"])


@pytest.mark.slow
@pytest.mark.skipif(SHARED is None, reason="UNDERSKIN_CAMPAIGNS is not set")
@pytest.mark.parametrize(
    ("name", "verdict"), [("c4chxhg3d", "explained"), ("c2pdsjnae", "no_mismatch"), ("cxcz7s613", "unexplained")]
)
def test_campaigns_of_another_rig(name: str, verdict: str, table: SigmaTable) -> None:
    from underskin.recordings import read_file

    assert SHARED is not None
    report = diagnosis_report(read_file(Path(SHARED) / "open" / f"{name}.json", name).campaign, table)
    assert report["verdict"] == verdict
    assert names(report) <= set(CATALOGUE)


@pytest.mark.slow
def test_curves_are_diagnosed_too(table: SigmaTable) -> None:
    """A thin layer under a sphere, diagnosed from force against depth."""
    empty = indentation_campaign()
    model = compose(("layered_contact",), empty, table, "indentation")
    force = model.predict(np.array([entry.start for entry in model.parameters])).value.real
    random = np.random.default_rng(1)
    recordings = []
    for number, entry in enumerate(empty.recordings):
        assert isinstance(entry, IndentationRecording)
        own = force[model.recording == number]
        recordings.append(replace(entry, force_n=own + 1e-3 * np.abs(own).max() * random.normal(size=len(own))))
    report = lean_report(replace(empty, recordings=tuple(recordings)), table, *COSTLY)
    assert report["verdict"] == "explained"
    assert names(report) == {"layered_contact"}
    assert report["d33"] is None
