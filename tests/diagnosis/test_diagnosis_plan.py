"""The next experiment: within the rig's limits, never silent under `ambiguous`, and as good as it promises."""

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.mechanism_campaigns import indentation_campaign
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.data.names import EXPLAINED
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.planning.optimal_design import plan
from underskin.diagnosis.planning.rig_limits import RigLimits
from underskin.diagnosis.reporting.next_experiment import next_experiment
from underskin.diagnosis.selection.answers import Answer, Search
from underskin.diagnosis.selection.search import search
from underskin.findings.formatting import in_percent
from underskin.mechanisms import compose
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable

DRAWS = 400 if os.environ.get("UNDERSKIN_SOAK") == "1" else 40
TWINS = Made(("moving_contact_edge",), (0.9,), sensors=3, repeats=2, thickness_mm=1.2)
NARROW = Made(("modulus_error",), (1.25,), preloads_n=(1.0, 2.0), spheres_mm=(4.0,), sensors=3, repeats=2, gain=0.01)


class Left:
    """A campaign, what it leaves open, and the search that says so."""

    def __init__(self, made: Made, table: SigmaTable) -> None:
        self.problem = FittingProblem(lines(campaign(made, table)), table)
        self.search = search(self.problem)

    def plan(self, **limits: Any) -> dict[str, Any]:
        return next_experiment(plan(self.problem, self.search, RigLimits(**limits)))


@pytest.fixture(scope="module")
def narrow(table: SigmaTable) -> Left:
    return Left(NARROW, table)


@pytest.fixture(scope="module")
def twins(table: SigmaTable) -> Left:
    return Left(TWINS, table)


@pytest.mark.slow
def test_a_plan_keeps_within_the_limits(narrow: Left) -> None:
    planned = narrow.plan(preload_n=(0.3, 2.5), indenter_radius_mm=[4.0, 8.0], recordings=5)
    assert sum(entry["repeats"] for entry in planned["recordings"]) <= 5
    for entry in planned["recordings"]:
        assert 0.3 <= entry["preload_n"] <= 2.5
        assert entry["indenter_radius_mm"] in (4.0, 8.0)
        assert entry["dynamic_force_n"] == 0.05
        assert entry["position_mm"] == [0.0, 0.0]


@pytest.mark.slow
def test_the_sentence_names_all_that_it_separates(narrow: Left) -> None:
    planned = narrow.plan()
    assert len(planned["separates"]) >= 2
    for names in planned["separates"]:
        assert all(name.replace("_", " ") in planned["statement"] or name == "nothing_missing" for name in names)
    assert f"probability of {in_percent(planned['probability_of_deciding'])}." in planned["statement"]


@pytest.mark.slow
def test_where_the_campaign_s_own_settings_tell_nothing_others_are_tried(twins: Left) -> None:
    """At one dynamic force a moving edge and a finite amplitude are the same; another one tells them apart."""
    assert twins.search.answers[0].probability < EXPLAINED
    planned = twins.plan()
    assert planned["probability_of_deciding"] > planned["without_it"]
    assert "beyond what this campaign did" in planned["statement"]


@pytest.mark.slow
def test_limits_beyond_the_tables_are_said_to_be_that(narrow: Left) -> None:
    planned = narrow.plan(indenter_radius_mm=[2000.0], preload_n=(50.0, 60.0))
    assert planned["recordings"] == []
    assert "the tables hold none of their contacts" in planned["statement"]
    assert "more widely" not in planned["statement"]


@pytest.mark.slow
def test_where_nothing_can_be_planned_it_is_said_why(twins: Left) -> None:
    planned = twins.plan(preload_n=(0.3, 2.4))
    assert planned["recordings"] == []
    assert {tuple(names) for names in planned["separates"]} >= {("moving_contact_edge",), ("amplitude_nonlinearity",)}
    assert "likely to tell whether it is" in planned["statement"]
    assert "dynamic force" in planned["statement"]


@pytest.mark.slow
def test_rivals_without_a_law_and_curves_have_a_document_too(narrow: Left, table: SigmaTable) -> None:
    leader = narrow.search.answers[0].explanation
    assert leader is not None
    process = narrow.search.discrepancies[0]

    class Torn(Search):
        @property
        def answers(self) -> list[Answer]:
            return [Answer(leader, 0.6), Answer(None, 0.4)]

    torn = Torn(narrow.search.explanations, (process,), narrow.search.unsupported)
    planned = next_experiment(plan(narrow.problem, torn, RigLimits()))
    assert planned["recordings"] == []
    assert "something without a name" in planned["statement"]
    assert diagnose(indentation_campaign(), table).next_experiment is not None


def with_planned(whole: Campaign, planned: Mapping[str, Any]) -> Campaign:
    """The campaign and the planned recordings after it, with lines of 1."""
    last = whole.recordings[-1]
    assert isinstance(last, FrfRecording)
    added: list[FrfRecording] = []
    for entry in planned["recordings"]:
        settings = {name: value for name, value in entry.items() if name not in ("repeats", "position_mm")}
        for number in range(entry["repeats"]):
            added.append(
                replace(
                    last,
                    id=f"planned {len(added)} {number}",
                    position_mm=(entry["position_mm"][0], entry["position_mm"][1]),
                    **settings,
                )
            )
    return replace(whole, recordings=(*whole.recordings, *added))


def recorded(
    together: Campaign, own: int, truth: Explanation, table: SigmaTable, random: np.random.Generator
) -> Campaign:
    """The planned recordings as they come out if an explanation is true, its parameters drawn from what is known."""
    model = compose(truth.names, together, table)
    fit = truth.point.fit.copy()
    places = truth.best.hypothesis.mean_places
    fit[places] = random.multivariate_normal(fit[places], truth.best.covariance)
    value = 1e12 * model.predict(np.clip(fit, truth.best.fitter.low[0], truth.best.fitter.high[0])).value
    levels = truth.best.levels
    entries = list(together.recordings)
    for number in range(own, len(entries)):
        entry = entries[number]
        assert isinstance(entry, FrfRecording)
        rows = value[model.recording == number] * (1 + levels.gain * random.normal())
        noise = NARROW.line * np.abs(rows) * (random.normal(size=len(rows)) + 1j * random.normal(size=len(rows)))
        rows = rows + noise
        entries[number] = replace(entry, frf_re_pc_per_n=rows.real, frf_im_pc_per_n=rows.imag)
    return replace(together, recordings=tuple(entries))


@pytest.mark.slow
def test_a_plan_decides_as_often_as_it_promises(narrow: Left, table: SigmaTable) -> None:
    """The experiment simulated with whole recordings, every rival fitted again to all of them."""
    planned = narrow.plan()
    names = [tuple(entry) for entry in planned["separates"]]
    rivals = [answer for answer in narrow.search.answers if answer.names in names]
    prior = np.array([answer.probability for answer in rivals])
    prior /= prior.sum()
    random = np.random.default_rng(4)
    whole = narrow.problem.lines.campaign
    together = with_planned(whole, planned)
    decided = 0
    for truth in random.choice(len(rivals), size=DRAWS, p=prior):
        explanations = [answer.explanation for answer in rivals]
        true = explanations[truth]
        assert true is not None
        made = recorded(together, len(whole.recordings), true, table, random)
        problem = FittingProblem(lines(made), table)
        log_posterior = np.log(prior)
        for number, explanation in enumerate(explanations):
            assert explanation is not None
            (again,) = problem.refit([explanation])
            (before,) = narrow.problem.refit([explanation])
            assert again is not None
            assert before is not None
            log_posterior[number] += again.log_evidence - before.log_evidence
        decided += bool(np.exp(log_posterior[truth] - np.logaddexp.reduce(log_posterior)) >= EXPLAINED)
    promised = planned["probability_of_deciding"]
    assert promised > planned["without_it"] + 0.1
    assert abs(decided / DRAWS - promised) < 3 * np.sqrt(promised * (1 - promised) / DRAWS) + 0.05
