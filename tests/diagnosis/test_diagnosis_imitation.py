"""Laws of no catalogue that would look like an explanation of curves: fewer, the more the recordings say."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.lean_reports import COSTLY, lean_report
from tests.support.pressed_curves import explained, pressed
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.validation.imitation import Imitation, imitation
from underskin.recordings.campaign import IndentationRecording
from underskin.surrogate.sigma_table import SigmaTable

SUPPORTED = 6


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
    strong = lean_report(pressed(3.0, (5.0,)), table, *COSTLY)
    for report in (weak, strong):
        assert [entry["name"] for entry in report["mechanisms"]] == ["instrument_compliance"]
    assert weak["probability"] < strong["probability"]
    (finding,) = [entry for entry in weak["findings"] if entry["code"] == "imitated"]
    assert "would look like instrument compliance in these recordings" in finding["statement"]
    assert finding["statement"][1:] in weak["statement"]
    other = [entry for entry in weak["alternatives"] if entry["mechanisms"] == ["none_of_these"]]
    assert other[0]["probability"] <= weak["probability"]


@pytest.mark.slow
def test_a_law_that_would_look_like_a_set_never_outweighs_it(table: SigmaTable) -> None:
    """A law that is more probable than a set is one that was fitted."""
    campaign = pressed(3.0, (5.0,))
    single, null = explained(campaign, ("instrument_compliance",), table)
    for names in (("instrument_compliance",), ("contact_creep", "instrument_compliance")):
        leader = replace(single, names=names, log_evidence=single.log_evidence + 40)
        search = Search((null, leader), (), {}, imitating={names: 1.0})
        beside = {answer.names: answer.probability for answer in search.answers}
        assert sum(beside.values()) == pytest.approx(1.0)
        assert beside[names] >= beside[("none_of_these",)] > 0.45
        fitted = replace(search, imitating={})
        assert beside[("none_of_these",)] > fitted.answers[1].probability
        assert search.answers[0].names == names


@pytest.mark.slow
def test_without_times_no_law_follows_time(table: SigmaTable) -> None:
    campaign = pressed(3.0, (5.0,))
    curves = [one for one in campaign.recordings if isinstance(one, IndentationRecording)]
    still = tuple(replace(one, time_s=np.zeros(len(one.displacement_mm))) for one in curves)
    laws = []
    for tried in (campaign, replace(campaign, recordings=still)):
        result = imitation(*explained(tried, ("instrument_compliance",), table), SUPPORTED)
        assert result is not None
        laws.append(result.laws)
    assert laws[0] > laws[1] >= 20


@pytest.mark.slow
def test_a_cantilever_that_gives_is_named_under_a_sphere_of_micrometres(table: SigmaTable) -> None:
    report = lean_report(pressed(2.5e-3, (5e-3,), depth=2e-4), table, "contact_creep", "compressible_layer")
    assert [entry["name"] for entry in report["mechanisms"]] == ["instrument_compliance"]
    (stiffness,) = report["mechanisms"][0]["parameters"]
    assert stiffness["low"] < 2.5e-3 < stiffness["high"]
    assert stiffness["value"] == pytest.approx(2.5e-3, rel=0.2)
