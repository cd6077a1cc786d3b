"""Skins of one make as a fleet: which departs, and in what; what a skin of few recordings gains by its sisters."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.cases import first
from tests.support.kinds_campaigns import of_block
from tests.support.lean_reports import lean_fleet
from tests.support.skins import HEAVY_TIP, made
from underskin.diagnosis.inference.knowledge import Knowledge
from underskin.diagnosis.reporting import numbers
from underskin.diagnosis.reporting.report import DiagnosisResult
from underskin.diagnosis.several.bench import benches
from underskin.diagnosis.several.course import Candidate
from underskin.diagnosis.several.fleet import declared_wrongly
from underskin.diagnosis.several.population import Make, Spread, State, populations
from underskin.diagnosis.several.skin import D33, ERRORS, FAR
from underskin.mechanisms.parameter import Normal
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.usefixtures("skins_diagnosed_once")


def population(fleet: dict[str, Any], parameter: str) -> dict[str, Any]:
    (entry,) = [one for one in fleet["population"] if one["parameter"] == parameter]
    return entry


def departures(fleet: dict[str, Any]) -> set[str]:
    return {one["skin"] for entry in fleet["population"] for one in entry["departures"]}


def likeliest(fleet: dict[str, Any], skin: str) -> str:
    """The quantity in which a skin most probably departs."""
    each = {
        entry["parameter"]: one["probability"]
        for entry in fleet["population"]
        for one in entry["departures"]
        if one["skin"] == skin
    }
    return max(each, key=lambda parameter: each[parameter])


def sisters(count: int) -> dict[str, list[Campaign]]:
    return {f"skin-{number}": [made(f"c{number}", seed=20 + number)] for number in range(count)}


@pytest.mark.slow
def test_of_three_skins_the_one_with_another_d33_is_named_and_tells_nothing_of_the_others(table: SigmaTable) -> None:
    fleet = lean_fleet(sisters(2) | {"weak": [made("weak", seed=40, d33=9.0)]}, table, "batch")
    d33 = population(fleet, "d33")
    assert departures(fleet) == {"weak"}
    assert likeliest(fleet, "weak") == "d33"
    assert d33["mean"] == pytest.approx(14.0, rel=0.03)
    assert fleet["verdict"] == "explained"
    assert "One departs, weak, in d33: " in fleet["statement"]
    truth = {"skin-0": 14.0, "skin-1": 14.0, "weak": 9.0}
    assert all(entry["low"] < truth[entry["skin"]] < entry["high"] for entry in d33["skins"])


@pytest.mark.slow
def test_of_many_skins_two_that_depart_are_named(table: SigmaTable) -> None:
    others = {f"skin-{n}": [made(f"c{n}", seed=20 + n, d33=14 + 0.2 * n)] for n in first(1, (4, 3))}
    skins = sisters(3) | others
    skins |= {"weak": [made("weak", seed=40, d33=9.0)], "strong": [made("strong", seed=41, d33=20.0)]}
    fleet = lean_fleet(skins, table, "batch")
    assert departures(fleet) == {"weak", "strong"}
    assert population(fleet, "d33")["mean"] == pytest.approx(14.2 if len(others) == 1 else 14.28, rel=0.03)


@pytest.mark.slow
def test_a_skin_of_another_modulus_departs_in_that_while_its_d33_stays(table: SigmaTable) -> None:
    """What is declared of all skins is wrong for one: `modulus_error` has that skin alone in its scope."""
    fleet = lean_fleet(sisters(3) | {"soft": [made("soft", seed=40, modulus=6.0)]}, table, "batch")
    assert departures(fleet) == {"soft"}
    assert likeliest(fleet, "soft") == "youngs_modulus"
    (entry,) = fleet["mechanisms"]
    assert (entry["name"], entry["scope"]) == ("modulus_error", {"skins": ["soft"]})
    for parameter, truth in (("youngs_modulus", 6.0), ("d33", 14.0)):
        own = next(one for one in population(fleet, parameter)["skins"] if one["skin"] == "soft")
        assert own["low"] < truth < own["high"]


@pytest.mark.slow
def test_a_skin_of_another_thickness_departs_in_that(table: SigmaTable) -> None:
    thin = made("thin", seed=40, effects={"thickness_error": {"factor": 0.8}})
    fleet = lean_fleet(sisters(3) | {"thin": [thin]}, table, "batch")
    assert departures(fleet) == {"thin"}
    assert likeliest(fleet, "thin") == "thickness"
    (entry,) = fleet["mechanisms"]
    assert (entry["name"], entry["scope"]) == ("thickness_error", {"skins": ["thin"]})
    own = next(one for one in population(fleet, "thickness")["skins"] if one["skin"] == "thin")
    assert own["low"] < 0.8 * 2.5 < own["high"]


@pytest.mark.slow
def test_a_skin_that_is_rightly_declared_to_be_thinner_does_not_depart(table: SigmaTable) -> None:
    fleet = lean_fleet(sisters(3) | {"thin": [made("thin", seed=40, thickness=2.0)]}, table, "batch")
    assert departures(fleet) == set()
    assert (fleet["verdict"], fleet["mechanisms"]) == ("no_mismatch", [])
    thickness = {one["skin"]: one["value"] for one in population(fleet, "thickness")["skins"]}
    assert thickness["thin"] == pytest.approx(2.0, rel=0.04)
    assert thickness["skin-0"] == pytest.approx(2.5, rel=0.04)


@pytest.mark.slow
def test_a_departure_is_told_beside_what_the_others_would_have_if_declared_alike(table: SigmaTable) -> None:
    thin = made("thin", seed=40, thickness=2.0, effects={"thickness_error": {"factor": 0.8}})
    fleet = lean_fleet(sisters(3) | {"thin": [thin]}, table, "batch")
    assert (departures(fleet), likeliest(fleet, "thin")) == ({"thin"}, "thickness")
    assert re.search(r"where the others have (1\.9\d*|2(\.0\d*)?) for the same declared", fleet["statement"])


@pytest.mark.slow
def test_where_it_is_open_in_what_a_skin_departs_the_verdict_is_ambiguous(table: SigmaTable) -> None:
    """Its headline is no surer than the departure that it states."""
    fleet = lean_fleet(sisters(3) | {"weak": [made("weak", seed=41, d33=12.5)]}, table, "batch")
    assert departures(fleet) == {"weak"}
    likely = likeliest(fleet, "weak")
    share = next(one["probability"] for one in population(fleet, likely)["departures"] if one["skin"] == "weak")
    assert share < 0.8
    assert fleet["probability"] <= share
    assert fleet["verdict"] == "ambiguous"


@pytest.mark.slow
def test_where_the_modulus_is_declared_wrongly_for_all_none_departs(table: SigmaTable) -> None:
    skins = {f"skin-{n}": [made(f"c{n}", seed=20 + n, modulus=32.0)] for n in range(3)}
    fleet = lean_fleet(skins, table, "batch")
    assert departures(fleet) == set()
    (entry,) = fleet["mechanisms"]
    assert (entry["name"], entry["scope"]) == ("modulus_error", {"skins": list(skins)})
    assert population(fleet, "youngs_modulus")["mean"] == pytest.approx(32.0, rel=0.1)


@pytest.mark.slow
def test_a_block_measured_apart_for_one_skin_tells_the_modulus_of_its_sisters(table: SigmaTable) -> None:
    """E is 9 where 16 is declared, which FRFs of three skins do not tell."""
    skins = {f"s{number}": [made(f"c{number}", seed=10 + number, modulus=9.0)] for number in range(3)}
    skins["s0"].append(of_block(9.0))
    report = lean_fleet(skins, table, "palms")
    assert [entry["name"] for entry in report["mechanisms"]] == ["modulus_error"]
    assert report["campaigns"] == ["c0", "block", "c1", "c2"]
    moduli = population(report, "youngs_modulus")
    assert moduli["mean"] == pytest.approx(9.0, rel=0.1)
    assert all(skin["low"] < 9.0 < skin["high"] for skin in moduli["skins"])


def test_a_block_that_contradicts_its_skin_is_told_of_the_fleet(table: SigmaTable) -> None:
    skins = sisters(3)
    one = next(iter(skins))
    skins[one] = [*skins[one], of_block(48.0)]
    report = lean_fleet(skins, table, "palms")
    (contradiction,) = report["contradictions"]
    assert contradiction["statement"].startswith(f"{one}: The FRFs and the block contradict each other")
    assert f"n {one}: The FRFs and the block contradict each other" in report["statement"]


def test_which_campaign_counts_as_the_latest_is_told_where_one_has_no_date(table: SigmaTable) -> None:
    skins = sisters(3)
    undated = made("undated", seed=30)
    undated = replace(
        undated,
        recordings=tuple(
            replace(one, recorded_at=None) if isinstance(one, FrfRecording) else one for one in undated.recordings
        ),
    )
    told = "not every campaign has a date, so they count in the order in which they were given"
    later = made("later", "2018-05-03T09:00:00Z", seed=31)
    dated = lean_fleet(skins | {"skin-1": [*skins["skin-1"], later], "skin-2": [undated]}, table, "batch")
    assert told not in dated["statement"]
    open_order = lean_fleet(skins | {"skin-1": [*skins["skin-1"], undated]}, table, "batch")
    assert (
        f"skin-1, the last that can be used speaks: {told}: campaign c1 (2017-05-03), campaign undated (no date)"
        in (open_order["statement"])
    )


def test_populations_are_of_skins_that_may_be_regular() -> None:
    said = State(D33, Knowledge(np.eye(1), np.zeros(1), 0.0), np.ones(1))
    with pytest.raises(AssertionError):
        populations([[said]] * 3, [Make(0.0, np.zeros(1), np.ones(1))], [Spread(0.03, 1.0)])


def test_skins_depart_as_far_as_the_mechanisms_have_errors() -> None:
    for far, error in zip(FAR, ERRORS, strict=False):
        (factor,) = CATALOGUE[error].parameters_stated
        assert isinstance(factor.prior, Normal)
        assert far == pytest.approx(factor.prior.sd)


def test_an_error_of_what_is_declared_of_all_counts_wherever_it_was_looked_at() -> None:
    attempts = {"": 0.55, "modulus_error": 0.45}
    makes = {"": 0.88, "modulus_error": 0.1, "thickness_error": 0.02}
    found = declared_wrongly(attempts, makes)
    assert found == pytest.approx({"modulus_error": 0.55 * 0.1 + 0.45, "thickness_error": 0.55 * 0.02})


@pytest.mark.slow
def test_where_skins_differ_as_those_of_one_make_none_departs(table: SigmaTable) -> None:
    skins = {
        f"skin-{n}": [made(f"c{n}", seed=20 + n, d33=d33, modulus=modulus)]
        for n, (d33, modulus) in enumerate(first(3, [(13.6, 15.5), (14.2, 16.6), (14.5, 15.8), (14.0, 16.0)]))
    }
    fleet = lean_fleet(skins, table, "batch")
    assert departures(fleet) == set()
    assert (fleet["verdict"], fleet["mechanisms"]) == ("no_mismatch", [])
    assert "None is seen to depart" in fleet["statement"]


@pytest.mark.slow
def test_a_skin_of_two_recordings_borrows_strength_from_its_sisters(
    skins_diagnosed_once: Callable[..., DiagnosisResult], table: SigmaTable
) -> None:
    """Alone, where what is declared may be wrong, its interval is wider than with them, and over all draws but one the
    pooled one holds the true d33."""
    widths, narrower, held = [], [], []
    three = sisters(3)
    for seed in first(3, range(6)):
        whole = made("few", seed=60 + seed)
        few = replace(whole, recordings=whole.recordings[:2])
        fleet = lean_fleet(three | {"few": [few]}, table, "batch")
        own = next(one for one in population(fleet, "d33")["skins"] if one["skin"] == "few")
        held.append(own["low"] < 14.0 < own["high"])
        result = skins_diagnosed_once(few, table)
        assert result.few is not None
        assert result.problem is not None
        fit = Candidate(result.problem, result.few).explained(frozenset(ERRORS))
        assert fit is not None
        alone = numbers.parameter(fit, numbers.place_of(fit, "d33"))
        widths.append(np.log(own["high"] / own["low"]))
        narrower.append(widths[-1] / np.log(alone["high"] / alone["low"]))
    assert sum(held) >= len(held) - 1  # of six, less is as probable as 3 %, at 95 % each
    assert max(narrower) < 0.25  # a sixth
    assert max(widths) < 0.1  # 0.08, of which two gains of 2 % make 0.055


@pytest.mark.slow
def test_a_skin_of_three_recordings_has_the_scatter_of_its_sisters(
    skins_diagnosed_once: Callable[..., DiagnosisResult], table: SigmaTable
) -> None:
    """The rig scatters gains by 2 % and no position."""
    whole = made("few", seed=61)
    campaigns = [*(one for (one,) in sisters(3).values()), replace(whole, recordings=whole.recordings[:3])]
    results = [skins_diagnosed_once(one, table) for one in campaigns]
    found = benches([Candidate(one.problem, one.search) for one in results if one.problem and one.search])
    assert len(found) == 4
    assert found[3].gain.middle == pytest.approx(np.log(0.02), abs=0.3)
    assert found[3].placed < 0.3


@pytest.mark.slow
def test_strengths_of_a_mechanism_that_all_have_are_a_population(table: SigmaTable) -> None:
    skins = {f"skin-{n}": [made(f"c{n}", seed=20 + n, effects=HEAVY_TIP)] for n in range(3)}
    fleet = lean_fleet(skins, table, "batch")
    assert [(entry["name"], entry["scope"]) for entry in fleet["mechanisms"]] == [
        ("contact_resonance", {"skins": list(skins)})
    ]
    mass = population(fleet, "contact_resonance.tip_mass")
    assert (mass["unit"], mass["departures"]) == ("g", [])
    assert all(entry["low"] < 4.0 < entry["high"] for entry in mass["skins"])
