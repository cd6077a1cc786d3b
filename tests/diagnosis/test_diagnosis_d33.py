"""The stated d33 counts what does not show: an effect that changes it alone, few sensors, a law's unknown level."""

from dataclasses import replace

import numpy as np
import pytest

from proof.cases import DrawnCase
from rig.wide_tails import WIDE
from tests.support.diagnosis_campaigns import Made, campaign
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.inference.over_spread import Normals, over_spread
from underskin.diagnosis.inference.unseen import beside
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.reporting.numbers import parameter, place_of
from underskin.recordings.campaign import parse
from underskin.surrogate.sigma_table import SigmaTable

# One sphere on one sensor's centre, over a narrow range of preloads: nearly everything is a factor on d33
CENTRED = Made(sensors=1, spheres_mm=(6.0,), preloads_n=(0.9, 1.0, 1.1, 1.2), repeats=3)


def problem(made: Made, table: SigmaTable) -> FittingProblem:
    return FittingProblem(lines(campaign(made, table)), table)


def spread_of(mixture: Normals) -> float:
    share = mixture.share / mixture.share.sum()
    mean = share @ mixture.mean
    return float(np.sqrt(share @ (mixture.deviation**2 + (mixture.mean - mean) ** 2)))


def test_an_effect_that_only_changes_d33_leaves_the_evidence_and_moves_d33(table: SigmaTable) -> None:
    fitting = problem(CENTRED, table)
    (nothing,) = fitting.explain([Request(())])
    assert nothing is not None
    found = beside(fitting, nothing, "thickness_error", "d33")
    assert found is not None
    assert found.share.sum() == pytest.approx(1.0, abs=0.4)
    assert np.ptp(found.mean) > 0.2
    assert beside(fitting, nothing, "sensor_spread", "d33") is None  # one sensor
    assert beside(fitting, nothing, "mains_pickup", "d33") is None  # moves no prediction


def test_an_effect_that_would_show_is_not_there_unseen(table: SigmaTable) -> None:
    """Over spheres of two sizes, preloads to ten times and places beside the sensor, a wrong thickness is no factor."""
    wide = Made(preloads_n=(0.3, 1.0, 3.0), spheres_mm=(4.0, 8.0), offsets_mm=(0.0, 0.8, 1.6), gain=0.005)
    fitting = problem(wide, table)
    (nothing,) = fitting.explain([Request(())])
    assert nothing is not None
    found = beside(fitting, nothing, "thickness_error", "d33")
    assert found is None or found.share.sum() < 0.5
    assert found is None or np.ptp(found.mean) < 0.2


def test_an_effect_that_shows_by_more_than_floats_hold_has_shares_all_the_same(table: SigmaTable) -> None:
    fitting = problem(Made(("amplifier_high_pass",), (3.0,), lines=400, line=0.002), table)
    (nothing,) = fitting.explain([Request(())])
    assert nothing is not None
    found = beside(fitting, nothing, "amplifier_high_pass", "d33")
    assert found is not None
    assert np.log(found.share.sum()) > 300
    assert np.all(np.isfinite(found.share))


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.94, 1.06])
def test_the_stated_d33_holds_the_true_one_beside_an_effect_that_does_not_show(
    factor: float, table: SigmaTable
) -> None:
    """The fit alone excludes it."""
    hidden = Made(**{**vars(CENTRED), "mechanisms": ("thickness_error",), "parameters": (factor,)})
    report = diagnosis_report(campaign(hidden, table), table)
    assert report["mechanisms"] == []
    assert report["d33"]["low"] < hidden.d33_pc_per_n < report["d33"]["high"]
    (nothing,) = problem(hidden, table).explain([Request(())])
    assert nothing is not None
    stated = parameter(nothing, place_of(nothing, "d33"))
    assert not stated["low"] < hidden.d33_pc_per_n < stated["high"]


@pytest.mark.slow
@pytest.mark.parametrize(("times", "said"), [(2.0, "2 times the declared 14 pC/N"), (1.0, "")])
def test_a_charge_taken_peak_to_peak_shows_beside_the_declared_d33(times: float, said: str, table: SigmaTable) -> None:
    """Nothing else in the recordings tells a factor on all of them."""
    made = campaign(Made(**{**vars(CENTRED), "d33_pc_per_n": 14.0 * times}), table)
    statement = diagnosis_report(replace(made, skin=replace(made.skin, d33_pc_per_n=14.0)), table)["statement"]
    assert said in statement
    assert ("times the declared" in statement) == bool(said)


@pytest.mark.slow
def test_two_sensors_leave_d33_more_open_than_their_most_probable_spread(table: SigmaTable) -> None:
    """32 sensors determine the spread, and the integral over it is the normal distribution at its best value."""
    ratios = []
    for sensors in (2, 32):
        made = Made(mechanisms=("sensor_spread",), parameters=(0.15,), sensors=sensors, preloads_n=(0.5, 1.0, 2.0))
        fitting = problem(made, table)
        (found,) = fitting.explain([Request(("sensor_spread",))])
        assert found is not None
        place = place_of(found, "d33")
        index = found.best.hypothesis.mean_places.index(place)
        averages = over_spread(found.best.fitter, found.best.at, place)
        assert averages is not None
        (mixture,) = averages
        assert mixture.share.sum() == pytest.approx(1.0)
        ratios.append(spread_of(mixture) / np.sqrt(found.best.covariance[index, index]))
    assert ratios[0] > 1.3
    assert ratios[1] == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
def test_beside_what_does_not_show_two_sensors_leave_d33_as_open_as_without_it(table: SigmaTable) -> None:
    """At each strength of a wrong thickness d33 is averaged over the sensors' spread, as it is without one."""
    made = Made(**{**vars(CENTRED), "mechanisms": ("sensor_spread",), "parameters": (0.15,), "sensors": 2})
    fitting = problem(made, table)
    (spread,) = fitting.explain([Request(("sensor_spread",))])
    assert spread is not None
    averages = over_spread(spread.best.fitter, spread.best.at, place_of(spread, "d33"))
    assert averages is not None
    found = beside(fitting, spread, "thickness_error", "d33")
    assert found is not None
    places = len(found.share) // len(averages[0].share)
    assert places > 3
    for share, mean, deviation in zip(
        *(np.split(part, places) for part in (found.share, found.mean, found.deviation)), strict=True
    ):
        at_one = spread_of(Normals(share, mean, deviation))
        assert at_one == pytest.approx(spread_of(averages[0]), rel=0.25)
        assert at_one > 1.2 * deviation[np.argmax(share)]


@pytest.mark.slow
def test_a_resonance_of_no_list_may_leave_either_end_of_the_band(table: SigmaTable) -> None:
    """A loose part takes 18 % from all that is below its frequency or adds it above: the lines do not tell which."""
    case = DrawnCase(900010, 72, None, WIDE)
    assert list(case.description["effects"]) == ["rattle"]
    report = diagnosis_report(parse(case.document()), table)
    assert report["verdict"] == "unexplained"
    assert report["d33"]["low"] < case.description["skin"]["d33_pc_per_n"] < report["d33"]["high"]
