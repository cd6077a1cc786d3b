"""The proof's own tools: judging, statistics, stored results, the ideal diagnoser, and the page from a small run."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from bench.soak import SOAK
from proof import own_rig, paper_array
from proof.cases import DrawnCase, MadeCase
from proof.commands import prove
from proof.ideal import diagnosed
from proof.ideal_laws import suppositions
from proof.judge import QUIET, judge
from proof.real import recorded
from proof.stored import Work, reports
from rig.description import parse as parse_experiment
from rig.draw import CATALOGUED, UNKNOWN, drawn
from rig.strengths import of_frf
from tests.support.cases import first
from underskin import diagnose
from underskin.recordings.campaign import parse
from underskin.surrogate.sigma_table import load_table

RECORDINGS = os.environ.get("UNDERSKIN_RECORDINGS")


def report(verdict: str, *names: str, probability: float = 0.9) -> dict[str, Any]:
    return {
        "verdict": verdict,
        "probability": probability,
        "mechanisms": [{"name": name} for name in names],
        "alternatives": [{"mechanisms": ["twin"]}],
        "fit": {"after": {"heldout_rmse_percent": 2.0}, "noise_floor_percent": 1.0},
    }


@pytest.mark.parametrize(
    ("given", "effects", "right"),
    [
        (report("explained", "b", "a"), ["a", "b"], True),
        (report("ambiguous", "a"), ["a"], True),
        (report("explained", "a"), ["a", "b"], False),
        (report("unexplained"), ["unknown"], True),
        (report("no_mismatch"), [], True),
        (report("no_mismatch"), ["unknown"], False),
        (report("explained", "a"), [], False),
    ],
)
def test_an_answer_is_right_if_it_is_exactly_the_truth(given: dict[str, Any], effects: list[str], right: bool) -> None:
    truth = {"effects": effects, "identifiable": True, "chi2_gain_of_truth": 49.0}
    found = judge("c", given, truth)
    assert found.right is right
    assert found.size == 7.0
    assert found.held_out == (2.0, 1.0)


def test_a_pair_is_visible_only_if_each_of_its_members_is() -> None:
    truth = {
        "effects": ["a", "b"],
        "identifiable": True,
        "every_effect_identifiable": False,
        "chi2_gain_of_truth": 90.0,
    }
    found = judge("c", report("explained", "a"), truth)
    assert (found.kind, found.visible, found.one_visible) == ("pair", False, True)


def test_a_twin_is_left_open_only_under_ambiguous() -> None:
    truth = {"effects": ["twin"], "identifiable": True, "chi2_gain_of_truth": 90.0}
    for verdict in ("ambiguous", "explained"):
        found = judge("c", report(verdict, "a"), truth)
        assert not found.right
        assert found.left_open is (verdict == "ambiguous")


def test_drawn_cases_tell_nothing_of_the_truth() -> None:
    case = DrawnCase(own_rig.SEED, 4)
    document = case.document()
    assert document == case.document()
    assert set(document) == {"schema", "name", "skin", "recordings"}
    assert document["skin"]["d33_pc_per_n"] is None


@pytest.mark.slow
def test_every_effect_that_is_drawn_can_be_supposed_where_it_is() -> None:
    """The ideal diagnoser's laws reach the parameters that the rig draws, and no others of the same name."""
    for number in range(60 if SOAK else 40):
        description = drawn(3, number)
        effects = parse_experiment(description).effects
        found = [entry.positions_of(effects) for entry in suppositions(tuple(sorted(effects)), of_frf(description))]
        places = [place for place in found if place is not None]
        assert len(places) == 1
    assert not set(CATALOGUED) & set(UNKNOWN)


def test_a_supposition_gives_back_the_effects_of_its_place() -> None:
    description = drawn(3, 1, "single")
    for name in ("misalignment", "thickness_error", "preload_dependent_d33"):
        for supposed in suppositions((name,), of_frf(description)):
            place = np.linspace(0.3, 0.6, len(supposed.coordinates))
            again = supposed.positions_of(supposed.effects(place))
            assert again == pytest.approx(place)


@pytest.mark.slow
def test_the_ideal_diagnoser_names_what_plainly_shows() -> None:
    quiet = next(n for n in range(50) if _light(drawn(9, n, "none")))
    assert diagnosed(DrawnCase(9, quiet, "none"))["answer"] == []


def _light(description: dict[str, Any]) -> bool:
    return not description["noise"]["position_mm"] and description["design"]["most_recordings"] < 40


@pytest.mark.slow
@pytest.mark.usefixtures("quick_digests")
def test_small_run_writes_page_goes_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small run writes the page and goes on from what it kept."""
    monkeypatch.setattr(own_rig, "SEED", 18)  # its first campaigns are small
    command = typer.Typer()
    command.command()(prove)
    options = ["--count=1", "--workers=1", *(f"--{name}-dir={tmp_path / name}" for name in ("work", "results", "docs"))]
    begun = CliRunner().invoke(command, ["mixture", *options])
    assert begun.exit_code == 0, begun.output
    page = (tmp_path / "docs/proof.md").read_text(encoding="utf-8")
    assert "1 of 300 campaigns" in page
    drawings = sorted(file.name for file in (tmp_path / "docs/figures").iterdir())
    assert drawings == ["proof-calibration.svg", "proof-confusion.svg"]
    reports = {file: file.stat().st_mtime_ns for file in (tmp_path / "work/reports").iterdir()}
    assert len(reports) == 1
    assert CliRunner().invoke(command, ["mixture", *options]).exit_code == 0
    assert {file: file.stat().st_mtime_ns for file in (tmp_path / "work/reports").iterdir()} == reports
    assert (tmp_path / "docs/proof.md").read_text(encoding="utf-8") == page


@pytest.mark.soak
def test_the_ideal_diagnoser_finds_a_twin_no_better_than_the_truth() -> None:
    found = diagnosed(DrawnCase(7001, 12, "single"))
    assert set(drawn(7001, 12, "single")["effects"]) == {"amplitude_nonlinearity"}
    assert abs(found["chi2_over_rivals"]) < 3.0


@pytest.mark.slow
@pytest.mark.usefixtures("quick_digests")
def test_a_diagnosis_that_fails_is_a_wrong_answer(tmp_path: Path) -> None:
    [made] = reports(Work(tmp_path), [MadeCase("broken", {"schema": "campaign/1"})], lambda _, __: None)
    found = judge("broken", made, {"effects": [], "identifiable": True, "chi2_gain_of_truth": 0.0})
    assert not found.right
    assert found.verdict not in QUIET


@pytest.mark.slow
def test_the_papers_question_is_left_open_and_what_would_settle_it_is_planned() -> None:
    """Preload and age go together on the array: both are named, neither is guessed, and the plan takes them apart."""
    made = paper_array.worlds()
    array = diagnose(parse(made["array"]), load_table())
    rivals = {"preload_dependent_d33", "ageing"}
    assert array["verdict"] == "ambiguous"
    assert array["probability"] < 0.6
    assert {entry["name"] for entry in array["mechanisms"]} | set(array["alternatives"][0]["mechanisms"]) == rivals
    tied = [entry for entry in array["not_identifiable"] if entry["confounded_with"] in rivals]
    assert [{entry["mechanism"], entry["confounded_with"]} for entry in tied] == [rivals]
    planned = array["next_experiment"]
    assert planned["probability_of_deciding"] > 0.9
    assert {entry["preload_n"] for entry in planned["recordings"]} - {1.0}
    assert all(entry["position_mm"] == [0.0, 0.0] for entry in planned["recordings"])


@pytest.mark.soak
def test_what_would_settle_the_papers_question_does() -> None:
    """Both preloads on late sensors: what did it is named."""
    made = paper_array.worlds()
    aged = diagnose(parse(made["array, then both preloads: age did it"]), load_table())
    assert {entry["name"] for entry in aged["mechanisms"]} == {"ageing"}


@pytest.mark.soak
@pytest.mark.skipif(RECORDINGS is None, reason="UNDERSKIN_RECORDINGS names no folder of recordings")
def test_real_recordings() -> None:
    """The main outcomes: stiffening PDMS, creeping gel, relaxing cell, a well that no law fits to its noise."""
    assert RECORDINGS is not None
    found = {}
    names = first(2, ["tension-RTV615", "well-E5", "polymergel_creep", "cell_stress_relaxation"])
    for entry in recorded():
        if entry.name in names:
            document = entry.make(Path(RECORDINGS))
            made = diagnose(parse(document), load_table())
            found[entry.name] = made, {mechanism["name"] for mechanism in made["mechanisms"]}
    assert set(found) == set(names)
    assert found["well-E5"][0]["verdict"] == "unexplained"  # with a layer, too, several times the noise remain
    tied = {(entry["mechanism"], entry["confounded_with"]) for entry in found["well-E5"][0]["not_identifiable"]}
    assert any("instrument_compliance" in pair for pair in tied)
    assert "strain_stiffening" in found["tension-RTV615"][1]
    if SOAK:
        assert "contact_creep" in found["polymergel_creep"][1]
        # one time is not all of it
        assert "contact_creep" in found["cell_stress_relaxation"][0]["fit"]["mechanisms"]
    fits = {name: report["fit"] for name, (report, _) in found.items()}
    for name in {"tension-RTV615", "polymergel_creep"} & set(fits):
        assert fits[name]["after"]["heldout_rmse_percent"] < 0.5 * fits[name]["before"]["heldout_rmse_percent"]
    # The base model alone extrapolates it to within twice the noise
    assert fits["well-E5"]["after"]["heldout_rmse_percent"] < 2 * fits["well-E5"]["noise_floor_percent"]
