"""Campaigns of one skin diagnosed together: what acts in all, what appeared and since when, what a block tells all."""

import re
from dataclasses import replace
from html import unescape
from typing import Any

import numpy as np
import pytest

from bench.soak import SOAK
from tests.support.cases import first
from tests.support.kinds_campaigns import of_block
from tests.support.lean_reports import beside, lean_together, sentences
from tests.support.report_pages import figures_in, written
from tests.support.skins import HEAVY_TIP, document, made
from underskin import InvalidInput, diagnose_fleet, diagnose_together
from underskin.recordings.campaign import Campaign, frf_recordings
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.slow

SEPTEMBER = "2017-09-12T09:00:00Z"
FEW = ("modulus_error", "thickness_error", "sensor_spread")


def reported(campaigns: list[Campaign], table: SigmaTable, *known: str) -> dict[str, Any]:
    """Of a search among these mechanisms beside what is declared wrongly and how sensors differ."""
    return lean_together(campaigns, table, "both", beside(*FEW, *known))


def dates(**changes: Any) -> list[Campaign]:
    return [made("may", **changes), made("september", SEPTEMBER, seed=8, **changes)]


def scopes(report: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {entry["name"]: entry["scope"] for entry in report["mechanisms"]}


def with_gain(campaign: Campaign, **gains: float) -> Campaign:
    """Of these sensors times a factor."""
    entries = []
    for entry in frf_recordings(campaign):
        assert entry.frf_re_pc_per_n is not None
        assert entry.frf_im_pc_per_n is not None
        factor = gains.get(entry.sensor, 1.0)
        real, imag = factor * entry.frf_re_pc_per_n, factor * entry.frf_im_pc_per_n
        entries.append(replace(entry, frf_re_pc_per_n=real, frf_im_pc_per_n=imag))
    return replace(campaign, recordings=tuple(entries))


@pytest.fixture(scope="module")
def appeared(table: SigmaTable) -> dict[str, Any]:
    """The report on a campaign with a heavy tip and an earlier one without it, given in that order."""
    return reported([made("september", SEPTEMBER, effects=HEAVY_TIP, seed=8), made("may")], table, "contact_resonance")


def test_appeared_two_campaigns_named_date(appeared: dict[str, Any]) -> None:
    """What appeared between two campaigns is named with its date.

    Whatever the order in which they are given.
    """
    assert (appeared["campaign"], appeared["campaigns"]) == ("both", ["may", "september"])
    assert appeared["verdict"] == "explained"
    assert scopes(appeared) == {"contact_resonance": {"campaigns": ["september"], "since": "2017-09-12"}}
    assert "contact resonance since 2017-09-12" in appeared["statement"]
    (mass, _) = appeared["mechanisms"][0]["parameters"]
    assert mass["low"] < 4.0 < mass["high"]


def test_without_dates_no_date_given_order_told(table: SigmaTable) -> None:
    """Without all dates no date is given and the order is told.

    Of one campaign no time is known, so that nothing can be said to be there since a date.
    """
    before = made("may")
    undated = replace(before, recordings=tuple(replace(entry, recorded_at=None) for entry in frf_recordings(before)))
    report = reported([undated, made("september", SEPTEMBER, effects=HEAVY_TIP, seed=8)], table, "contact_resonance")
    assert scopes(report) == {"contact_resonance": {"campaigns": ["september"]}}
    assert "since" not in report["statement"]
    assert (
        "Not every campaign has a date, so they count in the order in which they were given: campaign may (no date), "
        "campaign september (2017-09-12);"
    ) in report["statement"]


def test_sensor_ages_no_physics_skin(table: SigmaTable) -> None:
    """One sensor that ages is no physics of the skin."""
    before, after = dates()
    report = reported([before, with_gain(after, s03=0.75)], table, "ageing")
    assert report["verdict"] == "explained"
    assert scopes(report) == {"ageing": {"campaigns": ["september"], "since": "2017-09-12", "sensors": ["s03"]}}
    (change,) = report["mechanisms"][0]["parameters"]
    assert change["low"] < -25.0 < change["high"]
    values = {(row["campaign"], row["sensor"]): row for row in report["d33"]["per_sensor"]}
    assert values["september", "s03"]["value"] == pytest.approx(0.75 * 14.0, rel=0.05)
    assert values["may", "s03"]["low"] < 14.0 < values["may", "s03"]["high"]


def of_four(campaign: Campaign) -> Campaign:
    """Of the first four sensors alone."""
    entries = frf_recordings(campaign)
    sensors = list(dict.fromkeys(entry.sensor for entry in entries))[:4]
    return replace(campaign, recordings=tuple(entry for entry in entries if entry.sensor in sensors))


@pytest.mark.parametrize("is_exchange", [True, False])
def test_half_of_four_sensors_change(table: SigmaTable, *, is_exchange: bool) -> None:
    """Two of four sensors that change are named with their changes, as an exchange where they have each other's d33.

    The array's change is as certain as by the two others.
    """
    before, after = map(of_four, dates())
    first, second = list(dict.fromkeys(entry.sensor for entry in frf_recordings(before)))[1:3]
    if is_exchange:
        before, after = (
            with_gain(before, **{first: 1.18, second: 0.85}),
            with_gain(after, **{first: 0.85, second: 1.18}),
        )
    else:
        after = with_gain(after, **{first: 0.72, second: 1.2})
    report = reported([before, after], table)
    if is_exchange:
        said = re.search(rf"Sensors {first} and {second} look exchanged since .*\({first} (\S+) %", report["statement"])
    else:
        said = re.search(rf"d33 of sensor {first}, beyond the others, fell by (\S+) %", report["statement"])
        assert f"d33 of sensor {second}, beyond the others, rose by" in report["statement"]
    assert said, report["statement"]
    assert abs(float(said[1])) == pytest.approx(28.0, abs=4.0)
    for row in report["d33"]["per_campaign"]:
        assert row["relative"]["high"] / row["relative"]["low"] < 1.1
        assert row["high"] / row["low"] >= 0.99 * row["relative"]["high"] / row["relative"]["low"]


def parts_of(campaign: Campaign, field: str) -> list[Campaign]:
    """A file for each value of a field of its recordings, which knows its own sensors only."""
    parts: dict[Any, list[Any]] = {}
    for entry in frf_recordings(campaign):
        parts.setdefault(getattr(entry, field), []).append(entry)
    files = []
    for value, entries in parts.items():
        own = {entry.sensor for entry in entries}
        skin = replace(campaign.skin, sensors=tuple(one for one in campaign.skin.sensors if one.id in own))
        files.append(Campaign(f"{campaign.name} {value}", skin, tuple(entries)))
    return files


def unlike(campaign: Campaign) -> Campaign:
    return with_gain(campaign, s01=1.1, s02=0.8, s03=1.25, s04=0.9, s05=1.3, s06=0.75)


@pytest.mark.parametrize("field", ["sensor", "preload_n", "id"])
def test_parts_are_one_campaign(table: SigmaTable, field: str) -> None:
    """Files of a sensor, a preload or a press each are one campaign: how sensors differ shows between them."""
    files = parts_of(unlike(made("may")), field)
    report = reported(files, table)
    assert report["campaigns"] == [file.name for file in files]
    assert report["verdict"] == "explained"
    assert [entry["name"] for entry in report["mechanisms"]] == ["sensor_spread"]


def test_parts_of_two_dates_are_two_campaigns(table: SigmaTable) -> None:
    """Files of a sensor each, of two dates, are put together by date: a sensor that fell between them is named."""
    before, after = map(unlike, dates())
    files = [*parts_of(with_gain(after, s03=0.75), "sensor"), *parts_of(before, "sensor")]
    report = reported(files, table)
    assert report["campaigns"] == ["may s01 and 7 more", "september s01 and 7 more"]
    assert "d33 of sensor s03, beyond the others, fell by" in report["statement"]


def silent(campaign: Campaign, sensor: str, seed: int) -> Campaign:
    """With nothing but noise of 0.03 pC/N in one channel."""
    generator = np.random.default_rng(seed)
    entries = []
    for entry in frf_recordings(campaign):
        assert entry.frf_re_pc_per_n is not None
        noise = 0.03 * generator.normal(size=(2, len(entry.frf_re_pc_per_n)))
        own = {"frf_re_pc_per_n": noise[0], "frf_im_pc_per_n": noise[1]} if entry.sensor == sensor else {}
        entries.append(replace(entry, **own))
    return replace(campaign, recordings=tuple(entries))


@pytest.mark.parametrize("seed", first(1, [4, 5, 6, 7]))
def test_sensor_died_two_dates_comes_first_hides(seed: int, table: SigmaTable) -> None:
    """A sensor that died between two dates comes first and hides no other.

    It is left out of all that is said of both: its noise is no sensor with 13 times the others' charge.
    """
    before, after = dates()
    report = reported([before, silent(with_gain(after, s03=0.85), "s06", seed)], table, "ageing")
    said = sentences(report["statement"])
    assert said[0].startswith("Sensor s06 is dead since 2017-09-12: no charge above noise, after 1")
    assert "d33 of sensor s03, beyond the others, fell by 1" in said[1]
    assert report["verdict"] == "explained"
    assert [entry["scope"]["sensors"] for entry in report["mechanisms"]] == [["s03"]]
    assert {row["sensor"] for row in report["d33"]["per_sensor"] if row["campaign"] == "september"} == {
        *(f"s{number:02d}" for number in (1, 2, 3, 4, 5, 7, 8))
    }


def test_a_sensor_reversed_on_one_date_is_said(table: SigmaTable) -> None:
    """What one campaign's recordings were turned by stands in the joint statement, not in its findings alone."""
    before, after = dates()
    statement = reported([before, with_gain(after, s04=-1.0)], table)["statement"]
    assert "In september: sensor 's04' answers with the opposite sign of the others: reversed" in statement


def test_slow_fall_array_over_four_dates_change(table: SigmaTable) -> None:
    """A slow fall of the array over four dates is a change.

    Each step of 3 % could be an amplifier's; all four together fall by 8.7 %, and no sensor beside the others.
    """
    times = ["2017-05-03", "2017-07-03", "2017-09-03", "2017-11-03"]
    made_on = [
        made(f"date {number}", f"{time}T09:00:00Z", seed=20 + number, d33=14.0 * 0.97**number)
        for number, time in enumerate(times)
    ]
    report = reported(made_on, table, "ageing")
    (entry,) = report["mechanisms"]
    assert (report["verdict"], entry["name"], entry["scope"]["since"]) == ("explained", "ageing", times[1])
    (change,) = entry["parameters"]
    assert change["low"] < 100 * (0.97**3 - 1) < change["high"] < 0
    assert "d33 of the array fell by " in report["statement"]
    assert "in 184 days, between 2017-05-03 and 2017-11-03" in report["statement"]
    levels = [row["value"] for row in report["d33"]["per_campaign"]]
    assert levels == pytest.approx([14.0 * 0.97**number for number in range(4)], rel=0.02)


def test_nothing_changed_d33_serves_last_alone(table: SigmaTable) -> None:
    """Where nothing changed one d33 serves and is of the last alone."""
    report = reported(dates(), table, "ageing", "contact_resonance")
    assert (report["verdict"], report["mechanisms"]) == ("no_mismatch", [])
    assert report["probability"] > 0.9
    assert not report["d33"]["quotable"]
    last = report["statement"].split(". ")[-1]
    assert last.startswith("d33 here is by the recordings of september alone, and not to be quoted for all campaigns")
    assert f"{report['d33']['low']:.3g} to {report['d33']['high']:.3g}" in last


@pytest.mark.soak
def test_changes_by_chance_are_rarely_seen(table: SigmaTable) -> None:
    """Of twenty pairs of dates of an unchanged skin, one at most."""
    pairs = [[made("may", seed=100 + n), made("september", SEPTEMBER, seed=200 + n)] for n in range(20)]
    assert sum(reported(pair, table, "ageing")["mechanisms"] != [] for pair in pairs) <= 1


def test_what_cannot_be_put_together_is_refused(table: SigmaTable) -> None:
    may, september = dates()
    again = replace(may, name="renamed")
    thick = replace(september, skin=replace(september.skin, thickness_mm=3.0))
    other = replace(of_block(9.0), skin=replace(of_block(9.0).skin, youngs_modulus_mpa=9.0))
    together = [
        ([may], "two at least, of one skin or material"),
        ([may, made("may", seed=8)], "name of its own"),
        ([may, thick], "as may has it"),
        ([may, again], r"renamed: recordings\[0\].*a recording of may: it would count twice"),
        ([may, september, other], r"block: skin\.youngs_modulus_mpa"),
    ]
    for campaigns, message in together:
        with pytest.raises(InvalidInput, match=message):
            diagnose_together(campaigns, "refused", table)
    for skins, message in (
        ({"a": [september], "b": [may], "c": [again]}, "it would count twice"),
        ({"a": [september], "b": [september]}, "must be 3 at least"),
    ):
        with pytest.raises(InvalidInput, match=message):
            diagnose_fleet(skins, "refused", table)


def test_command_writes_report_several_files() -> None:
    """The command writes one report of several files and its page.

    Files of one name in two folders are one report all the same; a recording that was refused is a finding of it.

    The d33 of all sensors fell: ageing would do this, and so would an amplifier, so that what is told of ageing
    elsewhere is not claimed. Its page draws the d33 of each sensor over the campaigns.
    """
    files = [document("<b>may", d33=14.0), document("september", SEPTEMBER, seed=6, d33=10.5)]
    files[1]["recordings"][2]["preload_n"] = -1.0
    report, page = written(files, "--together", "both", without=beside(*FEW, "ageing"))
    assert report["campaigns"] == ["<b>may", "september"]
    refusal = report["findings"][0]
    assert (refusal["code"], refusal["recording"]) == ("refused", files[1]["recordings"][2]["id"])
    assert refusal["statement"].startswith("september: preload_n = -1.0")
    assert scopes(report) == {"ageing": {"campaigns": ["september"], "since": "2017-09-12"}}
    (entry,) = report["mechanisms"]
    assert "a change of level that ageing or " in entry["statement"]
    assert "or the temperature would make: these recordings do not tell which" in entry["statement"]
    assert "<h3>change of level of d33</h3>" in page
    assert "again and again" not in page  # as the text of ageing has it
    assert "Each campaign's own diagnosis says what to measure next" in unescape(page)
    assert "of the last campaign alone" in page
    assert "<b>may" not in page
    figure = figures_in(page)["sensors"]
    rows = report["d33"]["per_sensor"]
    for trace in figure.data:
        own = [row for row in rows if row["sensor"] == trace.name]
        assert list(trace.y) == pytest.approx([row["value"] for row in own])
        assert list(trace.y) == pytest.approx([14.0, 10.5], rel=0.06)
        assert np.array(trace.y) + trace.error_y.array == pytest.approx([row["high"] for row in own])
        assert np.array(trace.y) - trace.error_y.arrayminus == pytest.approx([row["low"] for row in own])
    assert [trace.name for trace in figure.data] == [row["sensor"] for row in rows[: len(figure.data)]]
    assert list(figure.layout.xaxis.ticktext) == ["&lt;b&gt;may", "september"]


@pytest.mark.soak
def test_block_measured_apart_tells_modulus(table: SigmaTable) -> None:
    """A block measured apart tells the modulus of all dates.

    E is 9 where 16 is declared: FRFs leave open whether it is the thickness; the block counts for both dates, also
    where a campaign before them cannot be used, and once where it was joined to both.
    """
    short = replace(made("april", "2017-04-03T09:00:00Z"), recordings=made("april").recordings[:1])
    apart = reported([short, *dates(modulus=9.0), of_block(9.0)], table)
    assert apart["campaigns"] == ["april", "may", "september", "block"]
    assert [entry["verdict"] for entry in apart["provenance"]["each"]][:2] == ["insufficient_data", "explained"]
    assert scopes(apart) == {"modulus_error": {"campaigns": ["may", "september"]}}
    (factor,) = apart["mechanisms"][0]["parameters"]
    assert factor["low"] < 9 / 16 < factor["high"]
    assert "compression" in {entry["kind"] for entry in apart["by_kind"]}
    assert apart["contradictions"] == []
    if SOAK:
        joined = [replace(one, recordings=(*one.recordings, *of_block(9.0).recordings)) for one in dates(modulus=9.0)]
        both = reported(joined, table)
        assert both["by_kind"] == apart["by_kind"]
        assert both["mechanisms"] == apart["mechanisms"]


def test_block_measured_apart_counts_beside(table: SigmaTable) -> None:
    """A block measured apart counts beside one campaign of frfs.

    As if all were in one file.
    """
    report = reported([made("may", modulus=9.0), of_block(9.0)], table)
    assert report["campaigns"] == ["may", "block"]
    assert (report["verdict"], [entry["name"] for entry in report["mechanisms"]]) == ("explained", ["modulus_error"])
    assert "compression" in {entry["kind"] for entry in report["by_kind"]}


@pytest.mark.soak
def test_blocks_alone_are_named(table: SigmaTable) -> None:
    """A report on curves of several campaigns names these, as one with FRFs does."""
    report = reported([of_block(9.0, "old"), of_block(9.2, "new")], table)
    assert report["campaigns"] == ["old", "new"]
