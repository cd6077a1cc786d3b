"""The next experiment: within the rig's limits, never silent under `ambiguous`, and as good as it promises."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import beside, whole_report
from underskin.cli.app import app
from underskin.findings.formatting import in_percent
from underskin.mechanisms import compose
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings, to_dict
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.slow

DRAWS = 40
NARROW = Made(("modulus_error",), (1.25,), preloads_n=(1.0, 2.0), spheres_mm=(4.0,), sensors=3, repeats=3, gain=0.01)
RIVALS = beside("modulus_error", "thickness_error", "preload_dependent_d33")


@pytest.fixture(scope="module")
def narrow(table: SigmaTable) -> Campaign:
    return campaign(NARROW, table)


def planned(made: Campaign, folder: Path, *limits: str) -> dict[str, Any]:
    """By the command."""
    file = folder / "palm.json"
    file.write_text(json.dumps(to_dict(made)), encoding="utf-8")
    result = CliRunner().invoke(app, ["plan", str(file), *limits])
    assert result.exit_code == 0, result.output
    return dict(json.loads(result.stdout))


def test_a_plan_keeps_within_the_limits_and_names_all_that_it_separates(narrow: Campaign, tmp_path: Path) -> None:
    """A place that no sensor allows, 60 mm beside it, is not asked for."""
    spheres = ["--indenter-radius-mm", "4", "--indenter-radius-mm", "8"]
    places = ["--offset-mm", "0", "--offset-mm", "60"]
    plan = planned(narrow, tmp_path, "--preload-n", "0.3", "2.5", "--recordings", "5", *spheres, *places)
    assert 0 < sum(entry["repeats"] for entry in plan["recordings"]) <= 5
    at = {sensor.id: [sensor.x_mm, sensor.y_mm] for sensor in narrow.skin.sensors}
    for entry in plan["recordings"]:
        assert 0.3 <= entry["preload_n"] <= 2.5
        assert entry["indenter_radius_mm"] in (4.0, 8.0)
        assert entry["dynamic_force_n"] == 0.05
        assert entry["position_mm"] == at[entry["sensor"]]
    assert plan["probability_of_deciding"] > plan["without_it"]
    assert len(plan["separates"]) >= 2
    for names in plan["separates"]:
        assert all(name.replace("_", " ") in plan["statement"] or name == "nothing_missing" for name in names)
    assert f"probability of {in_percent(plan['probability_of_deciding'])}." in plan["statement"]


def with_planned(whole: Campaign, plan: Mapping[str, Any]) -> Campaign:
    """The campaign and the planned recordings after it, with lines of 1."""
    last = frf_recordings(whole)[-1]
    added: list[FrfRecording] = []
    for entry in plan["recordings"]:
        settings = {name: value for name, value in entry.items() if name not in ("repeats", "position_mm")}
        place = (entry["position_mm"][0], entry["position_mm"][1])
        added += [
            replace(last, id=f"planned {len(added)} {number}", position_mm=place, **settings)
            for number in range(entry["repeats"])
        ]
    return replace(whole, recordings=(*whole.recordings, *added))


def recorded(
    together: Campaign, own: int, truth: Mapping[str, Any], table: SigmaTable, random: np.random.Generator
) -> Campaign:
    """The planned recordings as they come out if an answer is true, its parameters drawn from their intervals."""
    names = [entry["name"] for entry in truth["mechanisms"]]
    model = compose(tuple(names), together, table)
    fit = np.array([entry.start for entry in model.parameters])
    stated = [parameter for entry in truth["mechanisms"] for parameter in entry["parameters"]] + [truth["d33"]]
    for place, parameter in enumerate(model.parameters[: len(stated)]):
        low, middle, high = (parameter.to_fit(stated[place][end]) for end in ("low", "value", "high"))
        fit[place] = np.clip(random.normal(middle, (high - low) / (2 * 1.96)), parameter.low, parameter.high)
    value = 1e12 * model.predict(fit).value
    entries = list(frf_recordings(together))
    for number in range(own, len(entries)):
        rows = value[model.recording == number] * (1 + NARROW.gain * random.normal())
        rows = rows * (1 + NARROW.line * (random.normal(size=len(rows)) + 1j * random.normal(size=len(rows))))
        entries[number] = replace(entries[number], frf_re_pc_per_n=rows.real, frf_im_pc_per_n=rows.imag)
    return replace(together, recordings=tuple(entries))


@pytest.mark.soak
def test_a_plan_decides_as_often_as_it_promises(narrow: Campaign, table: SigmaTable) -> None:
    """Each rival in turn as the truth, as often as it is probable: the planned recordings are made, and all diagnosed
    again."""
    report = whole_report(narrow, table, *RIVALS)
    plan = report["next_experiment"]
    rivals = [frozenset(names) - {"nothing_missing"} for names in plan["separates"]]
    probability = {frozenset(entry["name"] for entry in report["mechanisms"]): report["probability"]}
    for entry in report["alternatives"]:
        probability[frozenset(entry["mechanisms"]) - {"nothing_missing"}] = entry["probability"]
    prior = np.array([probability[names] for names in rivals])
    alone = {names: whole_report(narrow, table, *beside(*names)) for names in rivals}
    assert all({entry["name"] for entry in alone[names]["mechanisms"]} == names for names in rivals)
    random = np.random.default_rng(4)
    together = with_planned(narrow, plan)
    decided = 0
    for truth in random.choice(len(rivals), size=DRAWS, p=prior / prior.sum()):
        made = recorded(together, len(narrow.recordings), alone[rivals[truth]], table, random)
        again = whole_report(made, table, *RIVALS)
        decided += {entry["name"] for entry in again["mechanisms"]} == rivals[truth] and again["verdict"] in (
            "explained",
            "no_mismatch",
        )
    promised = plan["probability_of_deciding"]
    assert promised > plan["without_it"] + 0.1
    assert abs(decided / DRAWS - promised) < 3 * np.sqrt(promised * (1 - promised) / DRAWS) + 0.05
