"""Reports of several campaigns draw d33 over campaigns, and skins on the band of their population."""

from html import escape
from typing import Any

import numpy as np
import pytest

from service.pages.diagnosis.figure_columns import columns
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import lean_fleet, lean_together
from underskin.diagnosis.data.names import quantity_in_words
from underskin.diagnosis.reporting.html_report import of_report, page
from underskin.diagnosis.reporting.several_figures import sensors_over_campaigns
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable


def made(name: str, d33: float, seed: int, table: SigmaTable) -> Campaign:
    whole = campaign(Made(sensors=3, d33_pc_per_n=d33, seed=seed), table)
    return Campaign(name, whole.skin, whole.recordings)


@pytest.fixture(scope="module")
def together(table: SigmaTable) -> dict[str, Any]:
    return lean_together([made("<b>may", 15.0, 1, table), made("june", 12.0, 2, table)], table, "both")


@pytest.fixture(scope="module")
def fleet(table: SigmaTable) -> dict[str, Any]:
    skins = {f"skin-{n}": [made(f"c{n}", 15.0 + 0.2 * n, n, table)] for n in range(3)}
    return lean_fleet({**skins, "<i>weak": [made("c9", 9.0, 9, table)]}, table, "batch")


def test_d33_of_each_sensor_is_drawn_over_the_campaigns_with_its_interval(together: dict[str, Any]) -> None:
    figure = of_report(together)["sensors"]
    assert [trace.name for trace in figure.data] == ["s0", "s1", "s2"]
    rows = together["d33"]["per_sensor"]
    for trace in figure.data:
        own = [row for row in rows if row["sensor"] == trace.name]
        assert list(trace.y) == [row["value"] for row in own]
        assert np.array(trace.y) + trace.error_y.array == pytest.approx([row["high"] for row in own])
        assert np.array(trace.y) - trace.error_y.arrayminus == pytest.approx([row["low"] for row in own])
        assert np.array(trace.y) == pytest.approx([15.0, 12.0], rel=0.06)
    assert list(figure.layout.xaxis.ticktext) == ["&lt;b&gt;may", "june"]
    assert columns("sensors", together, {})["value"] == [row["value"] for row in rows]
    assert 'id="figure-sensors"' in page(together)


def test_a_campaign_of_which_no_d33_is_told_has_its_place(together: dict[str, Any]) -> None:
    rows = together["d33"]["per_sensor"]
    figure = sensors_over_campaigns(rows, ["<b>may", "of curves", "june"])
    assert list(figure.layout.xaxis.ticktext) == ["&lt;b&gt;may", "of curves<br>(no d33)", "june"]
    assert {round(x) for trace in figure.data for x in trace.x} == {0, 2}


def test_each_skin_stands_on_the_band_of_its_population(fleet: dict[str, Any]) -> None:
    figure = of_report(fleet)["population"]
    (d33,) = [entry for entry in fleet["population"] if entry["parameter"] == "d33"]
    assert [entry["skin"] for entry in d33["departures"]] == ["<i>weak"]
    band = figure.layout.shapes[0]
    assert (band.x0 + band.x1) / 2 == pytest.approx(d33["mean"])
    assert band.x1 - band.x0 == pytest.approx(2 * 1.96 * d33["sd"], rel=1e-3)
    usual, departing = figure.data[:2]
    assert list(departing.y) == ["&lt;i&gt;weak"]
    assert departing.x[0] < band.x0
    assert len(usual.x) == 3
    told = columns("population", fleet, {})
    assert told["skin"][:4] == [entry["skin"] for entry in d33["skins"]]
    shown = page(fleet)
    assert 'id="figure-population"' in shown
    assert "<i>weak" not in shown


def test_of_many_sensors_the_median_the_range_and_those_apart_are_drawn_without_a_legend() -> None:
    random = np.random.default_rng(5)
    rows = []
    for name, level in (("may", 15.0), ("june", 12.0)):
        for number, d33 in enumerate(level * np.exp(0.02 * random.normal(size=60))):
            value = 0.7 * level if (name, number) == ("june", 31) else float(d33)
            rows.append({"campaign": name, "sensor": f"s{number}", "unit": "pC/N", "value": value})
            rows[-1] |= {"low": 0.98 * value, "high": 1.02 * value}
    figure = sensors_over_campaigns(rows, ["may", "june"])
    median, apart = figure.data
    assert figure.layout.showlegend is False
    for number, name in enumerate(("may", "june")):
        own = np.array([row["value"] for row in rows if row["campaign"] == name])
        assert median.y[number] == pytest.approx(np.median(own))
        low, high = (
            median.y[number] + way for way in (-median.error_y.arrayminus[number], median.error_y.array[number])
        )
        assert ((own > low) & (own < high)).sum() == 54  # 90 %
    assert (list(apart.text), list(apart.x), list(apart.y)) == (["s31"], [1], [0.7 * 12.0])


def test_quantities_of_a_fleet_are_called_in_words(fleet: dict[str, Any]) -> None:
    titles = [entry.text for entry in of_report(fleet)["population"].layout.annotations]
    assert titles == ["d33 [pC/N]", "Young's modulus [MPa]", "Thickness [mm]"]
    assert quantity_in_words("contact_resonance.tip_mass") == "tip mass of contact resonance"


def test_the_page_of_several_says_what_each_was_alone_and_that_nothing_is_planned(
    together: dict[str, Any], fleet: dict[str, Any]
) -> None:
    for document, key in ((together, "campaign"), (fleet, "skin")):
        shown = page(document, {})
        assert "these recordings decide" not in shown
        assert "Each campaign's own diagnosis says what to measure next" in shown
        assert [one[key] for one in document["provenance"]["each"] if f"{escape(one[key])} alone: " not in shown] == []
        assert "&#39;verdict&#39;" not in shown  # no notation of the code
    rival = {"mechanisms": ["adhesion"], "probability": 0.1, "why_not": "May: adhesion; June: nothing missing"}
    assert "what acts in each campaign" in page({**together, "alternatives": [rival]}, {})


def test_an_answer_that_is_not_sure_is_not_called_decided(together: dict[str, Any]) -> None:
    """Of a single campaign whose rivals no recording of its rig would tell apart."""
    single = {name: value for name, value in together.items() if name != "campaigns"}
    for verdict, probability, decided in (
        ("explained", 0.97, True),
        ("no_mismatch", 0.6, False),
        ("ambiguous", 0.5, False),
    ):
        shown = page({**single, "verdict": verdict, "probability": probability}, {})
        assert ("these recordings decide" in shown) == decided
        assert ("These recordings do not decide" in shown) == (not decided)
