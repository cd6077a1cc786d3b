"""Campaigns of one skin, and skins of one make, diagnosed together."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.support.cases import first
from tests.support.kinds_campaigns import of_block
from tests.support.lean_reports import lean_together
from tests.support.skins import HEAVY_TIP, document, made
from underskin.cli.app import app
from underskin.diagnosis.reporting.html_report import page
from underskin.diagnosis.several.campaigns import diagnose_together
from underskin.diagnosis.several.fleet import diagnose_fleet
from underskin.errors import InvalidInput
from underskin.recordings.campaign import Campaign, FrfRecording, to_dict
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.usefixtures("skins_diagnosed_once")

SEPTEMBER = "2017-09-12T09:00:00Z"


def scopes(report: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {entry["name"]: entry["scope"] for entry in report["mechanisms"]}


def with_gain(campaign: Campaign, sensor: str, gain: float) -> Campaign:
    entries = []
    for entry in campaign.recordings:
        assert isinstance(entry, FrfRecording)
        assert entry.frf_re_pc_per_n is not None
        assert entry.frf_im_pc_per_n is not None
        factor = gain if entry.sensor == sensor else 1.0
        real, imag = factor * entry.frf_re_pc_per_n, factor * entry.frf_im_pc_per_n
        entries.append(replace(entry, frf_re_pc_per_n=real, frf_im_pc_per_n=imag))
    return replace(campaign, recordings=tuple(entries))


@pytest.fixture(scope="module")
def appeared(table: SigmaTable) -> dict[str, Any]:
    """The report on a campaign with a heavy tip and an earlier one without it, given in that order."""
    before, after = made("may"), made("september", SEPTEMBER, effects=HEAVY_TIP, seed=8)
    return lean_together([after, before], table, "both")


@pytest.fixture(scope="module")
def block_apart(table: SigmaTable) -> dict[str, Any]:
    """The report on two dates of a skin of 9 MPa where 16 is declared, and a block of its elastomer."""
    dates = [made("may", modulus=9.0), made("september", SEPTEMBER, seed=8, modulus=9.0)]
    return diagnose_together([*dates, of_block(9.0)], table, "all")


def test_what_appeared_between_two_campaigns_is_named_with_its_date(appeared: dict[str, Any]) -> None:
    """Whatever the order in which they are given."""
    report = appeared
    assert (report["campaign"], report["campaigns"]) == ("both", ["may", "september"])
    assert report["verdict"] == "explained"
    assert scopes(report) == {"contact_resonance": {"campaigns": ["september"], "since": "2017-09-12"}}
    assert "contact resonance since 2017-09-12" in report["statement"]
    (mass, _) = report["mechanisms"][0]["parameters"]
    assert mass["low"] < 4.0 < mass["high"]


def test_what_acts_in_all_is_known_better_than_from_one(appeared: dict[str, Any], table: SigmaTable) -> None:
    each = [made("may", effects=HEAVY_TIP), made("september", SEPTEMBER, effects=HEAVY_TIP, seed=8)]
    report = lean_together(each, table, "both")
    assert scopes(report) == {"contact_resonance": {"campaigns": ["may", "september"]}}
    (mass, _) = report["mechanisms"][0]["parameters"]
    (alone, _) = appeared["mechanisms"][0]["parameters"]
    assert np.log(mass["high"] / mass["low"]) < 0.8 * np.log(alone["high"] / alone["low"])
    assert mass["low"] < 4.0 < mass["high"]


def test_without_all_dates_no_date_is_given_and_the_order_is_told(table: SigmaTable) -> None:
    """Of one campaign no time is known, so that nothing can be said to be there since a date."""
    before = made("may")
    undated = replace(before, recordings=tuple(replace(entry, recorded_at=None) for entry in before.recordings))
    report = lean_together([undated, made("september", SEPTEMBER, effects=HEAVY_TIP, seed=8)], table, "both")
    assert scopes(report) == {"contact_resonance": {"campaigns": ["september"]}}
    assert "since" not in report["statement"]
    assert (
        "Not every campaign has a date, so they count in the order in which they were given: campaign may (no date), "
        "campaign september (2017-09-12);"
    ) in report["statement"]


def test_a_d33_of_all_sensors_that_fell_is_a_change_of_level(table: SigmaTable) -> None:
    """Ageing would do this, and so would an amplifier: the text of the mechanism is not claimed."""
    fallen = made("september", SEPTEMBER, seed=8)
    for sensor in [entry.id for entry in fallen.skin.sensors]:
        fallen = with_gain(fallen, sensor, 0.75)
    report = lean_together([made("may"), fallen], table, "both")
    assert scopes(report) == {"ageing": {"campaigns": ["september"], "since": "2017-09-12"}}
    (entry,) = report["mechanisms"]
    assert "a change of level that ageing or " in entry["statement"]
    assert "or the temperature would make: these recordings do not tell which" in entry["statement"]
    shown = page(report)
    assert "<h3>change of level of d33</h3>" in shown
    assert "again and again" not in shown  # as the text of ageing has it


def test_one_sensor_that_ages_is_no_physics_of_the_skin(table: SigmaTable) -> None:
    aged = with_gain(made("september", SEPTEMBER, seed=8), "s03", 0.75)
    report = lean_together([made("may"), aged], table, "both")
    assert report["verdict"] == "explained"
    assert scopes(report) == {"ageing": {"campaigns": ["september"], "since": "2017-09-12", "sensors": ["s03"]}}
    (change,) = report["mechanisms"][0]["parameters"]
    assert change["low"] < -25.0 < change["high"]
    values = {(row["campaign"], row["sensor"]): row for row in report["d33"]["per_sensor"]}
    assert values["september", "s03"]["value"] == pytest.approx(0.75 * 14.0, rel=0.05)
    assert values["may", "s03"]["low"] < 14.0 < values["may", "s03"]["high"]


def test_two_sensors_that_have_each_others_d33_since_a_date_are_exchanged_and_none_aged(table: SigmaTable) -> None:
    """Presses at the sensors' centres: places tell nothing, the levels alone do."""
    before = with_gain(with_gain(made("may"), "s02", 1.3), "s05", 0.8)
    after = with_gain(with_gain(made("september", SEPTEMBER, seed=8), "s05", 1.3), "s02", 0.8)
    report = lean_together([before, after], table, "both")
    assert "ageing" not in scopes(report)
    assert "Sensors s02 and s05 look exchanged since 2017-09-12" in report["statement"]
    (finding,) = [one for one in report["findings"] if "each have the d33" in one["statement"]]
    assert finding["code"] == "sensors_exchanged"
    apart = with_gain(with_gain(made("september", SEPTEMBER, seed=8), "s05", 0.8), "s02", 0.8)
    report = lean_together([before, apart], table, "both")
    assert "exchanged" not in report["statement"]


def test_where_nothing_changed_one_d33_serves(table: SigmaTable) -> None:
    report = lean_together([made("may"), made("september", SEPTEMBER, seed=8)], table, "both")
    assert (report["verdict"], report["mechanisms"]) == ("no_mismatch", [])
    assert report["probability"] > 0.9


def test_what_cannot_be_put_together_is_refused(table: SigmaTable) -> None:
    with pytest.raises(InvalidInput, match="two at least"):
        diagnose_together([made("may")], table, "one")
    with pytest.raises(InvalidInput, match="name of its own"):
        diagnose_together([made("may"), made("may", seed=8)], table, "twice")
    other = made("september", SEPTEMBER, seed=8)
    thick = replace(other, skin=replace(other.skin, thickness_mm=3.0))
    with pytest.raises(InvalidInput, match="as may has it"):
        diagnose_together([made("may"), thick], table, "two skins")
    with pytest.raises(InvalidInput, match="two at least, one of them with recordings of kind frf"):
        diagnose_together([of_block(9.0), replace(of_block(9.0), name="again")], table, "curves")
    again = replace(made("may"), name="renamed")
    with pytest.raises(InvalidInput, match=r"renamed: recordings\[0\].*a recording of may: it would count twice"):
        diagnose_together([made("may"), again], table, "copy")
    with pytest.raises(InvalidInput, match="it would count twice"):
        diagnose_fleet({"a": [other], "b": [made("may")], "c": [again]}, table, "copy")
    with pytest.raises(InvalidInput, match="must be 3 at least"):
        diagnose_fleet({"a": [other], "b": [other]}, table, "two")


def test_the_command_writes_one_report_of_several_files(tmp_path: Path) -> None:
    """Files of one name in two folders are one report all the same; a recording that was refused is a finding of it."""
    files = []
    for number, (name, start) in enumerate([("may", "2017-05-03T09:00:00Z"), ("september", SEPTEMBER)]):
        made = document(name, start, seed=5 + number)
        if name == "september":
            made["recordings"][2]["preload_n"] = -1.0
        file = tmp_path / name / "campaign.json"
        file.parent.mkdir()
        file.write_text(json.dumps(made))
        files.append(str(file))
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["diagnose", *files, "--together", "both", "--output-dir", str(out), "--html"])
    assert done.exit_code == 0, done.output
    report = json.loads((out / "both.json").read_text())
    assert report["campaigns"] == ["may", "september"]
    refusal = report["findings"][0]
    assert (refusal["code"], refusal["recording"]) == ("refused", made["recordings"][2]["id"])
    assert refusal["statement"].startswith("september: preload_n = -1.0")
    assert "agree within the noise" in (out / "both.html").read_text()
    refused = CliRunner().invoke(app, ["diagnose", *files, "--fleet", "f", "--output-dir", str(out)])
    assert refused.exit_code != 0


def test_a_block_measured_apart_tells_the_modulus_of_both_dates(block_apart: dict[str, Any], table: SigmaTable) -> None:
    """E is 9 where 16 is declared: FRFs leave open whether it is the thickness; the block counts for both dates."""
    report = block_apart
    assert report["campaigns"] == ["may", "september", "block"]
    assert scopes(report) == {"modulus_error": {"campaigns": ["may", "september"]}}
    (factor,) = report["mechanisms"][0]["parameters"]
    assert factor["low"] < 9 / 16 < factor["high"]
    assert [entry["kind"] for entry in report["by_kind"]] == ["compression"]
    assert report["contradictions"] == []
    dates = [made("may", modulus=9.0), made("september", SEPTEMBER, seed=8, modulus=9.0)]
    other = replace(of_block(9.0), skin=replace(of_block(9.0).skin, youngs_modulus_mpa=9.0))
    with pytest.raises(InvalidInput, match=r"block: skin\.youngs_modulus_mpa"):
        diagnose_together([*dates, other], table, "all")


def test_a_block_measured_apart_counts_where_the_first_campaign_cannot_be_used(table: SigmaTable) -> None:
    """One recording tells nothing: the block counts with the campaign after it."""
    short = replace(made("april", "2017-04-03T09:00:00Z"), recordings=made("april").recordings[:1])
    dates = [made("may", modulus=9.0), made("september", SEPTEMBER, seed=8, modulus=9.0)]
    report = diagnose_together([short, *dates, of_block(9.0)], table, "all")
    assert report["campaigns"] == ["april", "may", "september", "block"]
    assert [entry["verdict"] for entry in report["provenance"]["each"]][:2] == ["insufficient_data", "explained"]
    assert scopes(report) == {"modulus_error": {"campaigns": ["may", "september"]}}
    assert [entry["kind"] for entry in report["by_kind"]] == ["compression"]


def test_a_block_of_another_elastomer_contradicts_the_campaign_that_it_counts_with(table: SigmaTable) -> None:
    dates = [made("may"), made("september", SEPTEMBER, seed=8)]
    report = diagnose_together([*dates, of_block(48.0)], table, "all")
    (entry,) = report["contradictions"]
    assert entry["statement"].startswith("may: The FRFs and the block contradict each other")
    assert report["verdict"] == "no_mismatch"
    said, _ = report["statement"].split("; apart from that, all 2 campaigns")
    assert said.startswith("In may: The FRFs and the block contradict each other")


def test_a_block_that_was_joined_to_both_dates_counts_once(block_apart: dict[str, Any], table: SigmaTable) -> None:
    apart = [made("may", modulus=9.0), made("september", SEPTEMBER, seed=8, modulus=9.0)]
    both = [replace(one, recordings=(*one.recordings, *of_block(9.0).recordings)) for one in apart]
    report = diagnose_together(both, table, "both")
    assert report["by_kind"] == block_apart["by_kind"]
    assert report["mechanisms"] == block_apart["mechanisms"]


def test_a_block_measured_apart_counts_beside_one_campaign_of_frfs(tmp_path: Path) -> None:
    """As if all were in one file."""
    frfs, block = tmp_path / "frfs.json", tmp_path / "block.json"
    frfs.write_text(json.dumps(document("may", modulus=9.0)))
    block.write_text(json.dumps(to_dict(of_block(9.0))))
    asked = ["diagnose", str(frfs), str(block), "--together", "palm", "--output-dir", str(tmp_path)]
    done = CliRunner().invoke(app, asked)
    assert done.exit_code == 0, done.output
    report = json.loads((tmp_path / "palm.json").read_text())
    assert (report["campaign"], report["campaigns"]) == ("palm", ["may", "block"])
    assert (report["verdict"], [entry["name"] for entry in report["mechanisms"]]) == ("explained", ["modulus_error"])
    assert [entry["kind"] for entry in report["by_kind"]] == ["compression"]


@pytest.mark.parametrize(("stiffness", "scatter"), first(1, [(0.15, 0.0), (0.25, 0.16)]))
def test_a_glue_line_that_begins_to_slip_is_listed_with_its_date(
    stiffness: float, scatter: float, table: SigmaTable
) -> None:
    """On centred sensors it is one factor, as is ageing, which only falls; that sensors differ hides nothing."""
    slips = {"interface_slip": {"glue_stiffness": stiffness}}
    before, after = made("may"), made("september", SEPTEMBER, effects=slips, seed=8)
    gains = np.exp(scatter * np.random.default_rng(3).normal(size=len(before.skin.sensors))).tolist()
    for sensor, gain in zip([entry.id for entry in before.skin.sensors], gains, strict=True):
        before, after = with_gain(before, sensor, gain), with_gain(after, sensor, gain)
    report = diagnose_together([before, after], table, "both")
    (entry,) = [entry for entry in report["mechanisms"] if entry["scope"].get("since") == "2017-09-12"]
    groups = [set(group["mechanisms"]) for group in report["presence"] if entry["name"] in group["mechanisms"]]
    assert any("interface_slip" in group for group in groups)
    assert not any("ageing" in group for group in groups)
    assert "interface slip" in report["statement"]
    assert entry["parameters"][0]["low"] > 0
