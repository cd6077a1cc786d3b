"""Campaigns of one skin: exchanged labels are undone by label, levels compared by one answer, and the headline."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.skins import made
from underskin.diagnosis.reporting.d33 import StatedD33
from underskin.diagnosis.reporting.report import Reported
from underskin.diagnosis.several.histories import Period, SetHistory
from underskin.diagnosis.several.joint_report import SkinOverDates, together_document
from underskin.diagnosis.several.sensors import (
    CampaignDates,
    Change,
    Failure,
    Fault,
    Sensor,
    SensorsOverDates,
    SensorsUnderSet,
    exchanges,
    without_steps,
)
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings

OWN = {"s01": 20.0, "s02": 24.0, "s03": 30.0, "s04": 21.0, "s05": 22.5, "s06": 26.0, "s07": 28.0}
EXCHANGED = {**OWN, "s01": OWN["s03"], "s03": OWN["s01"]}
DATES = ["2026-05-12", "2026-09-21", "2026-11-02"]


def sensor(d33: float) -> Sensor:
    """Known to 1 %."""
    return np.array([d33, 0.01 * d33, 0.98 * d33, 1.02 * d33])


def over(*levels: Mapping[str, float]) -> SensorsOverDates:
    campaigns = [{label: sensor(d33) for label, d33 in of_labels.items()} for of_labels in levels]
    number = len(campaigns)
    return SensorsOverDates(campaigns, np.arange(float(number)), [0.0] * number, [frozenset()] * number)


def times(entry: FrfRecording, factor: float) -> FrfRecording:
    assert entry.frf_re_pc_per_n is not None
    assert entry.frf_im_pc_per_n is not None
    return replace(
        entry, frf_re_pc_per_n=factor * entry.frf_re_pc_per_n, frf_im_pc_per_n=factor * entry.frf_im_pc_per_n
    )


@pytest.fixture(scope="module")
def steady() -> Campaign:
    return made("november")


@pytest.mark.parametrize("last", [OWN, {**EXCHANGED, "s03": 0.8 * EXCHANGED["s03"]}], ids=["put right", "and a step"])
def test_exchange_undone_under_its_labels(last: Mapping[str, float], steady: Campaign) -> None:
    """Exchanged on the second date; on the third put right, or the sensor that is labelled s03 since then lost 20 %:
    the third campaign is handed on with each label's level of the first date."""
    recorded = replace(
        steady,
        recordings=tuple(
            times(entry, last.get(entry.sensor, 1.0) / OWN.get(entry.sensor, 1.0)) for entry in frf_recordings(steady)
        ),
    )
    as_first = without_steps(recorded, over(OWN, EXCHANGED, last).steps, 2)
    for entry, before in zip(frf_recordings(as_first), frf_recordings(steady), strict=True):
        assert entry.frf_re_pc_per_n == pytest.approx(before.frf_re_pc_per_n, rel=0.02, abs=1e-3), entry.sensor


def test_second_exchange_has_signs_of_its_labels() -> None:
    """Put right, label s01 falls to its first level and s03 rises: opposite to the first exchange."""
    first, second = (
        {change.sensor: change.value for change in pair} for pair in exchanges(over(OWN, EXCHANGED, OWN).steps)
    )
    assert (first["s01"], first["s03"]) == pytest.approx((0.5, -1 / 3), abs=0.02)
    assert (second["s01"], second["s03"]) == pytest.approx((-1 / 3, 0.5), abs=0.02)


def reported(names: Sequence[str] = DATES, contradict: str = "", **changes: Any) -> dict[str, Any]:
    """The report on campaigns of these names, and with these facts; `contradict`: the name of one that does."""
    reports = {}
    for name in names:
        rows = [{"statement": "the skin's FRFs and curves want different moduli"}] if name == contradict else []
        own = {"verdict": "explained", "probability": 0.9, "findings": [], "contradictions": rows, "by_kind": [{}]}
        reports[name] = Reported(own, StatedD33(None))
    number = len(names)
    skin = SkinOverDates(
        dates=CampaignDates(names, DATES[:number]),
        reports=reports,
        provenance={},
        p_unlisted=[0.0] * number,
        p_described=0.98,
        histories=[SetHistory(((),) * number, 0.99)],
        periods=[],
        sensors=[{}] * number,
        over_sets=[[]] * number,
        failures={},
        changes=[],
        array=None,
    )
    return together_document("palm", replace(skin, **changes))


FALLEN = Change("s03", 0, 1, -0.2, 0.01, 0.99, (), "s03")


def test_headline_names_three_mechanisms() -> None:
    """Of which the dates take more than twenty words: they are left out, and the mechanisms are not."""
    acting = ("contact_resonance", "misalignment", "amplifier_high_pass")
    empty = np.zeros(0)
    periods = [
        Period(name, tuple(range(begins, 3)), bool(begins), 0.97, (), empty, empty)
        for begins, name in zip((0, 1, 0), acting, strict=True)
    ]
    names = [f"{date} on bench A" for date in DATES]
    report = reported(names, histories=[SetHistory((acting,) * 3, 0.99)], periods=periods)
    assert "misalignment since 2026-09-21" in report["statement"]
    assert report["headline"] == "Contact resonance and misalignment and amplifier high pass (97 %)."


def test_headline_keeps_what_is_missing_before_changes() -> None:
    """The verdict stands before a change of d33, and no change hides it."""
    headline = reported(p_unlisted=[0.9, 0.9, 0.0], p_described=0.2, changes=[FALLEN])["headline"]
    assert headline.startswith("Something is missing")
    assert "that no known mechanism describes (80 %)" in headline
    assert "d33 of sensor s03 fell by 20 %" in headline


def test_headline_begins_with_failures_and_contradictions() -> None:
    """Dead sensors and a contradicting campaign come first, whatever the name of the campaign holds."""
    died = {Failure(Fault.DEAD, 1, 0, None): ["s06"]}
    headline = reported(failures=died, changes=[FALLEN])["headline"]
    assert headline.startswith("Sensor s06 is dead since 2026-09-21; ")
    assert "nothing is missing" in headline
    names = ["2026-05", "run 10:30", "november"]
    headline = reported(names, contradict="run 10:30")["headline"]
    assert headline.startswith("Recordings of run 10:30 contradict one another; ")
    assert len(headline.split()) <= 20


def test_relative_intervals_compare_campaigns() -> None:
    """The same level by the leading answer has the same interval, whatever the shares of another answer."""
    level = {"s01": sensor(30.0)}
    parts = [
        [SensorsUnderSet(1 - share, level, 0.01), SensorsUnderSet(share, {"s01": sensor(24.0)}, 0.01)]
        for share in (0.3, 0.55)
    ]
    first, second = reported(DATES[:2], sensors=[level] * 2, over_sets=parts)["d33"]["per_sensor"]
    assert first["value"] != second["value"]
    assert first["relative"] == second["relative"] == {"low": 29.4, "high": 30.6}
