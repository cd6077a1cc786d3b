"""What a report says: three sentences at most, slips before the verdict, plain words, what stays open."""

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from proof.slip_kinds import SLIPS, Case
from rig.draw import drawn, record
from rig.recorded import campaign as rig_campaign
from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import beside, lean_report, sentences
from underskin.recordings.campaign import frf_recordings, from_dict
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.slow

SEED = 940501
# Those that make the longest statements, one of each kind, stand first.
TELLING = [
    "charge peak-to-peak", "sensor at a tenth", "cables exchanged", "dead sensor", "warm-up, rising",
    "polarity at random", "force rms", "a third conjugated",
]  # fmt: skip


def with_slips(table: SigmaTable) -> Iterator[dict[str, Any]]:
    description = drawn(SEED, 2, "single")
    recorded = record(description)
    made, _ = from_dict(rig_campaign(recorded))
    case = Case(made, recorded, np.full(len(recorded.exact), 0.02))
    for slip in first(2, [*TELLING, *sorted(SLIPS.keys() - TELLING)]):
        wrong = SLIPS[slip][0](case, np.random.default_rng(3))
        if wrong is not None:
            yield lean_report(wrong.campaign, table, *beside(*description["effects"], "sensor_spread"))


def test_a_slip_that_decides_comes_before_the_verdict(table: SigmaTable) -> None:
    """In few sentences all the same, as `lean_report` holds every report to."""
    begun = [report for report in with_slips(table) if report["verdict"] != "insufficient_data"]
    decided = [report for report in begun if "apart from that, " in sentences(report["statement"])[0]]
    assert len(decided) >= 2
    for report in decided:
        before = sentences(report["statement"])[0].partition("; apart from that, ")[0].lower()
        told = [entry["statement"][:25].lower() for entry in report["findings"]]
        assert any(said in before for said in told), report["statement"]


def test_what_keeps_an_axis_undecidable_is_named(table: SigmaTable) -> None:
    """Each sphere on a day of its own: what differs between the spheres may have come with the day."""
    plain = campaign(Made(sensors=4), table)
    on_days = [
        replace(
            entry, recorded_at=f"2020-01-{int(entry.indenter_radius_mm):02d}T10:{number:02d}:00Z", load_cycles=None,
            dwell_s=None,
        )
        for number, entry in enumerate(frf_recordings(plain))
    ]  # fmt: skip
    report = lean_report(replace(plain, recordings=tuple(on_days)), table, *beside("ageing", "modulus_error"))
    (entry,) = [one for one in report["location"]["axes"] if one["axis"] == "indenter_radius_mm"]
    assert entry["undecidable"] == "the time of recording determines it in this design"
    assert "whether it depends on" in report["location"]["statement"]


def test_each_mechanism_of_a_set_has_its_own_part_of_the_misfit(table: SigmaTable) -> None:
    made = Made(("ageing", "amplifier_high_pass"), (0.3, 300.0, 0.0, 0.3, 1.0))
    report = lean_report(campaign(made, table), table, *beside(*made.mechanisms, "timing_delay", "thickness_error"))
    parts = {entry["name"]: entry["explains_percent"] for entry in report["mechanisms"]}
    assert set(parts) == set(made.mechanisms)
    assert 10 < parts["ageing"] < 50 < parts["amplifier_high_pass"] < 90
    assert sum(parts.values()) == pytest.approx(100, abs=5)


@pytest.fixture(scope="module")
def ageing(table: SigmaTable) -> dict[str, Any]:
    made = campaign(Made(("ageing",), (0.3, 300.0, 0.0), sensors=3, repeats=2), table)
    return lean_report(made, table, *beside("ageing", "preload_dependent_d33", "sensor_spread", "thickness_error"))


def test_a_probability_is_never_certain_and_the_same_everywhere(ageing: dict[str, Any]) -> None:
    assert ageing["verdict"] == "explained"
    assert ageing["probability"] == 0.985
    assert ageing["alternatives"][0]["mechanisms"] == ["none_of_these"]
    assert "what nobody thought of" in ageing["alternatives"][0]["why_not"]
    assert ageing["statement"].startswith("The paper's model lacks ageing (probability 98.5 %). Ageing: ")
    numbers = "the recordings are (about [0-9]+|more than a million) times less probable under it"
    assert any(re.fullmatch(numbers, entry["why_not"]) for entry in ageing["alternatives"][1:])


def test_sentences_are_plain_and_hold_no_statistics(ageing: dict[str, Any]) -> None:
    assert "recordings after many load cycles are lower" in ageing["statement"]
    texts = [ageing["statement"], ageing["location"]["statement"]]
    texts += [entry["why_not"] for entry in ageing["alternatives"]]
    texts += [entry["reason"] for entry in ageing["not_identifiable"]]
    texts += [entry["statement"] for entry in ageing["findings"]]
    assert [text for text in texts if re.search(r"e\^|χ|cosine|evidence|residual|nats|_n\b|_mm\b|_hz\b", text)] == [
        "dynamic_force_n is the same in all recordings"
    ]
    assert "ageing" not in {entry["mechanism"] for entry in ageing["not_identifiable"]}
    low, high = ageing["location"]["effect_interval_percent"]
    assert low < ageing["location"]["effect_percent"] < high
    assert re.match(r"The misfit depends on .*load cycles", ageing["location"]["statement"])
