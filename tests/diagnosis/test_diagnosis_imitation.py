"""Laws of no catalogue that would look like an explanation of curves: fewer, the more the recordings say."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.selection.search import Search
from underskin.diagnosis.validation.imitation import Imitation, imitation
from underskin.recordings.campaign import Campaign, parse
from underskin.surrogate.sigma_table import SigmaTable, load_table

MODULUS, NOISE = 2.0, 5e-4  # MPa, and of the largest force
SUPPORTED = 6


@pytest.fixture(scope="module")
def table() -> SigmaTable:
    return load_table()


def force_on_stage(travel: float, radius: float, stiffness: float) -> float:
    """F [N] of Hertz' contact behind a stage of that stiffness [N/mm], travel and radius in mm."""

    def beyond(force: float) -> float:
        return force - 16 / 9 * MODULUS * np.sqrt(radius) * max(travel - force / stiffness, 0.0) ** 1.5

    return float(brentq(beyond, 0.0, 100.0)) if travel > 0 else 0.0


def pressed(stiffness: float, radii: tuple[float, ...]) -> Campaign:
    """Curves with air before them and a way back, pressed through a stage."""
    random = np.random.default_rng(4)
    way_in = np.linspace(-0.05, 0.3, 150)
    travel = np.concatenate([way_in, way_in[::-1]])
    recordings = []
    for number, radius in enumerate(radii):
        force = np.array([force_on_stage(one, radius, stiffness) for one in travel])
        force += NOISE * force.max() * random.normal(size=len(force))
        curve = {"displacement_mm": travel.tolist(), "force_n": force.tolist()}
        time = np.linspace(0, 20, len(travel)).tolist()
        named = {"id": f"c{number}", "kind": "indentation", "indenter_radius_mm": radius}
        recordings.append({**named, **curve, "time_s": time})
    skin = {"thickness_mm": 80.0, "poisson_ratio": 0.5}
    return parse({"schema": "campaign/1", "name": "pressed", "skin": skin, "recordings": recordings})


def explained(campaign: Campaign, names: tuple[str, ...], table: SigmaTable) -> tuple[Explanation, Explanation]:
    """The explanation by these mechanisms, and the null hypothesis."""
    problem = FittingProblem(curve_lines(campaign, "indentation"), table)
    (null,) = problem.explain([Request(())])
    assert null is not None
    (found,) = problem.explain([Request(names, begin=null.point)])
    assert found is not None
    return found, null


def imitated(stiffness: float, radii: tuple[float, ...], table: SigmaTable) -> Imitation:
    found, null = explained(pressed(stiffness, radii), ("instrument_compliance",), table)
    result = imitation(found, null, SUPPORTED)
    assert result is not None
    return result


@pytest.mark.slow
def test_a_stronger_effect_and_several_spheres_leave_fewer_imitated_laws(table: SigmaTable) -> None:
    weak, strong = imitated(60.0, (5.0,), table), imitated(3.0, (5.0,), table)
    several = imitated(60.0, (1.0, 5.0), table)
    assert weak.laws == strong.laws == several.laws
    assert weak.imitated > max(strong.imitated, several.imitated)
    assert 1.0 >= weak.odds > max(strong.odds, several.odds)


@pytest.mark.slow
def test_what_is_imitated_takes_from_the_probability_and_is_said(table: SigmaTable) -> None:
    weak = diagnosis_report(pressed(60.0, (5.0,)), table)
    strong = diagnosis_report(pressed(3.0, (5.0,)), table)
    for report in (weak, strong):
        assert [entry["name"] for entry in report["mechanisms"]] == ["instrument_compliance"]
    assert weak["probability"] < strong["probability"]
    (finding,) = [entry for entry in weak["findings"] if entry["code"] == "imitated"]
    assert "would look like instrument compliance in these recordings" in finding["statement"]
    assert finding["statement"][1:] in weak["statement"]
    other = [entry for entry in weak["alternatives"] if entry["mechanisms"] == ["none_of_these"]]
    assert other[0]["probability"] <= weak["probability"]


@pytest.mark.slow
def test_an_unlisted_law_outweighs_only_sets_of_several_mechanisms(table: SigmaTable) -> None:
    campaign = pressed(3.0, (5.0,))
    single, null = explained(campaign, ("instrument_compliance",), table)
    for names, least in ((("instrument_compliance",), 0.49), (("contact_creep", "instrument_compliance"), 0.0)):
        leader = replace(single, names=names, log_evidence=single.log_evidence + 40)
        search = Search((null, leader), (), {}, imitating={names: 5.0})
        beside = {answer.names: answer.probability for answer in search.answers}
        assert sum(beside.values()) == pytest.approx(1.0)
        assert (beside[names] >= beside[("none_of_these",)]) is (least > 0)
        assert beside[names] >= least
        assert search.shown_or_nothing(replace(search.answers[0], explanation=None)) is leader
