"""Slips of a lab in whole campaigns: named, put right or left out, and never seen in what physics does."""

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from rig.draw import drawn, record
from rig.recorded import campaign as recorded_campaign
from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.slip_campaigns import MADE, changed, named, times
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.reporting.caveats import slips
from underskin.diagnosis.screening.inspection import inspect
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unnamed.axes import recording_order
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings, from_dict
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats


@pytest.fixture(scope="module")
def good(table: SigmaTable) -> Campaign:
    return campaign(MADE, table)


def lines(made: Campaign) -> dict[str, np.ndarray]:
    return {
        entry.id: np.asarray(entry.frf_re_pc_per_n) + 1j * np.asarray(entry.frf_im_pc_per_n)
        for entry in frf_recordings(made)
    }


def same(one: Campaign, other: Campaign) -> bool:
    """Whether the recordings of the first are those of the other."""
    known = lines(other)
    return all(np.allclose(values, known[name]) for name, values in lines(one).items())


PHASES = [
    ("amplifier_high_pass", (1.0,)),
    ("timing_delay", (200.0,)),
    ("sensor_relaxation", (0.03, 0.0)),
    ("contact_resonance", (30.0, 0.05)),
]


@pytest.mark.parametrize(("mechanism", "parameters"), PHASES)
def test_conjugated_recordings_contradict_the_others(
    mechanism: str, parameters: tuple[float, ...], table: SigmaTable
) -> None:
    made = campaign(replace(MADE, mechanisms=(mechanism,), parameters=parameters), table)
    assert named(inspect(made, table)) == []
    inspected = inspect(changed(made, lambda entry, n: times(entry, 1.0, -1.0 if n % 4 == 1 else 1.0)), table)
    assert named(inspected) == [Reason.RECORDINGS_CONJUGATED]
    assert same(inspected.campaign, made)


@pytest.mark.parametrize(("mechanism", "parameters"), PHASES)
def test_a_campaign_that_is_conjugated_has_a_phase_that_nothing_has(
    mechanism: str, parameters: tuple[float, ...], table: SigmaTable
) -> None:
    """Only a delay may as well be a lag of the force channel: it stays as it is."""
    made = campaign(replace(MADE, mechanisms=(mechanism,), parameters=parameters), table)
    conjugated = changed(made, lambda entry, _: times(entry, 1.0, -1.0))
    inspected = inspect(conjugated, table)
    assert named(inspected) == [Reason.ALL_CONJUGATED]
    assert same(inspected.campaign, conjugated if mechanism == "timing_delay" else made)


def test_where_there_is_no_phase_nothing_is_said_of_it(good: Campaign, table: SigmaTable) -> None:
    assert named(inspect(changed(good, lambda entry, _: times(entry, 1.0, -1.0)), table)) == []


def test_polarity_at_random_is_put_right(good: Campaign, table: SigmaTable) -> None:
    turned = np.random.default_rng(4).random(len(good.recordings)) < 1 / 3
    inspected = inspect(changed(good, lambda entry, n: times(entry, -1.0 if turned[n] else 1.0)), table)
    assert named(inspected) == [Reason.RECORDINGS_REVERSED]
    assert same(inspected.campaign, good)
    assert len(inspected.campaign.recordings) == len(good.recordings)


def test_a_sensor_at_a_tenth_is_left_out_and_a_spread_of_sensors_is_not(good: Campaign, table: SigmaTable) -> None:
    inspected = inspect(changed(good, lambda entry, _: times(entry, 0.1 if entry.sensor == "s1" else 1.0)), table)
    assert named(inspected) == [Reason.WEAK_SENSOR]
    assert {entry.sensor for entry in frf_recordings(inspected.campaign)} == {"s0", "s2"}
    assert "'s1' answers with 0.1 " in next(entry for entry in inspected.findings if entry.code == "weak").statement
    spread = {"s0": 0.6, "s1": 1.4, "s2": 1.0}
    assert named(inspect(changed(good, lambda entry, _: times(entry, spread[entry.sensor])), table)) == []


@pytest.mark.parametrize(("share", "word"), [(0.75, "weak"), (1.35, "strong"), (2.0, "strong")])
def test_a_sensor_that_stands_alone_is_its_own_fault_and_no_physics(share: float, word: str, table: SigmaTable) -> None:
    six = campaign(Made(sensors=6), table)
    wrong = changed(six, lambda entry, _: times(entry, share if entry.sensor == "s3" else 1.0))
    report = diagnosis_report(wrong, table)
    (finding,) = [entry for entry in report["findings"] if entry["code"] in ("weak", "strong")]
    assert finding["code"] == word
    told = re.match(r"sensor 's3' responds with ([0-9.]+) times the others' charge", finding["statement"])
    assert told
    assert float(told[1]) == pytest.approx(share, rel=0.04)
    assert ("peak-to-peak beside amplitudes" in finding["statement"]) == (share == 2.0)
    assert report["verdict"] == "no_mismatch"
    assert report["statement"].startswith("Sensor 's3' responds with ")
    assert report["d33"]["low"] < 15.0 < report["d33"]["high"]


def _with_gain(gain_of: Mapping[str, float], entry: FrfRecording, _: int) -> FrfRecording:
    return times(entry, gain_of[entry.sensor])


def test_of_sensors_that_all_differ_none_stands_alone(table: SigmaTable) -> None:
    """A spread of 15 %, as poled films have, in twelve skins of six sensors."""
    six = campaign(Made(sensors=6), table)
    for seed in range(12):
        gains = np.exp(0.15 * np.random.default_rng(seed).normal(size=6))
        gain_of = {f"s{number}": float(gain) for number, gain in enumerate(gains)}
        assert named(inspect(changed(six, partial(_with_gain, gain_of)), table)) == [], seed


@pytest.mark.parametrize(
    ("factor", "meant"), [(2.0, "peak-to-peak"), (0.5, "peak-to-peak"), (2**0.5, "rms"), (0.5**0.5, "rms")]
)
def test_amplitudes_of_another_kind_are_put_right(factor: float, meant: str, good: Campaign, table: SigmaTable) -> None:
    off = np.random.default_rng(8).random(len(good.recordings)) < 1 / 3
    inspected = inspect(changed(good, lambda entry, n: times(entry, factor if off[n] else 1.0)), table)
    assert named(inspected) == [Reason.AMPLITUDE_FACTOR]
    assert meant in next(entry for entry in inspected.findings if entry.code == "gain_steps").statement
    assert same(inspected.campaign, good)


def test_a_factor_that_all_recordings_share_and_one_of_no_meaning_are_no_slips(
    good: Campaign, table: SigmaTable
) -> None:
    assert named(inspect(changed(good, lambda entry, _: times(entry, 2.0)), table)) == []
    off = np.random.default_rng(8).random(len(good.recordings)) < 1 / 3
    assert named(inspect(changed(good, lambda entry, n: times(entry, 1.65 if off[n] else 1.0)), table)) == []


@pytest.mark.parametrize("factor", [0.5**0.5, 2**0.5])
def test_rms_is_told_beside_a_scatter_that_no_rig_has(factor: float, table: SigmaTable) -> None:
    """A campaign of the rig whose places scatter: levels of two kinds look like a gain that scatters by 16 %."""
    made, _ = from_dict(recorded_campaign(record(drawn(900500, 11, "none"))))
    off = np.random.default_rng(11).random(len(made.recordings)) < 1 / 3
    assert named(inspect(made, table)) == []
    inspected = inspect(changed(made, lambda entry, n: times(entry, factor if off[n] else 1.0)), table)
    assert named(inspected) == [Reason.AMPLITUDE_FACTOR]


@pytest.mark.parametrize("number", [274, 297])
def test_presses_that_miss_their_place_are_no_factor(number: int, table: SigmaTable) -> None:
    """One sensor, presses beside it that scatter by 0.45 mm: such a miss lowers the level, some by half and more."""
    description = drawn(961377, number, "none")
    description["noise"]["position_mm"] = 0.45
    made, _ = from_dict(recorded_campaign(record(description)))
    assert Reason.AMPLITUDE_FACTOR not in named(inspect(made, table))


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_peak_to_peak_is_told_where_the_two_levels_overlap(factor: float, table: SigmaTable) -> None:
    """A campaign of the rig whose places scatter: 15 % of its recordings lie far from either level."""
    made, _ = from_dict(recorded_campaign(record(drawn(944207, 59, "none"))))
    off = np.random.default_rng(11).random(len(made.recordings)) < 1 / 3
    inspected = inspect(changed(made, lambda entry, n: times(entry, factor if off[n] else 1.0)), table)
    assert named(inspected) == [Reason.AMPLITUDE_FACTOR]


def test_a_warm_up_is_told_where_nothing_else_moves_the_levels(table: SigmaTable) -> None:
    """A campaign of the rig of one sensor, its preloads in rising order, that starts at 0.8 of its level."""
    made, _ = from_dict(recorded_campaign(record(drawn(900500, 14, "none"))))
    order = recording_order(frf_recordings(made))
    cold = changed(made, lambda entry, n: times(entry, 1 - 0.2 * float(np.exp(-order[n] / 3.5))))
    assert named(inspect(made, table)) == []
    assert named(inspect(cold, table)) == [Reason.WARM_UP]


def shuffled(made: Campaign) -> Campaign:
    """Recorded in another order than listed, by `recorded_at`; without load cycles, which may age a sensor."""
    order = np.random.default_rng(3).permutation(len(made.recordings))

    def at(entry: FrfRecording, n: int) -> FrfRecording:
        minutes = int(order[n])
        return replace(
            entry, load_cycles=None, recorded_at=f"2020-01-01T{10 + minutes // 60:02d}:{minutes % 60:02d}:00Z"
        )

    return changed(made, at)


def minute(entry: FrfRecording) -> int:
    assert entry.recorded_at is not None
    return 60 * (int(entry.recorded_at[11:13]) - 10) + int(entry.recorded_at[14:16])


@pytest.mark.parametrize("amplitude", [0.3, -0.2])
def test_a_warm_up_is_left_out(amplitude: float, good: Campaign, table: SigmaTable) -> None:
    made = shuffled(good)
    cold = changed(made, lambda entry, _: times(entry, 1 + amplitude * float(np.exp(-minute(entry) / 2))))
    inspected = inspect(cold, table)
    assert named(inspected) == [Reason.WARM_UP]
    left = sorted(minute(entry) for entry in frf_recordings(inspected.campaign))
    assert 3 <= left[0] <= 12
    assert left == list(range(left[0], len(good.recordings)))


def _warming(factors: Floats, entry: FrfRecording, number: int) -> FrfRecording:
    return times(entry, float(factors[number]))


def test_a_warm_up_is_told_beside_steps_of_its_first_recordings(table: SigmaTable) -> None:
    """A short one looks much like a step of a few recordings, which is rarer; of the rig's campaigns of 25 recordings
    and more, which hide nothing and scatter by at most 3 %."""
    numbers = first(30, range(60))
    told, seen = 0, 0
    for number in numbers:
        description = drawn(938001, number, "none")
        if description["noise"]["gain"] > 0.03:
            continue
        made, _ = from_dict(recorded_campaign(record(description)))
        if len(made.recordings) < 25:
            continue
        cold = changed(made, partial(_warming, 1 - 0.25 * np.exp(-recording_order(frf_recordings(made)) / 2)))
        seen += 1
        told += Reason.WARM_UP in named(inspect(cold, table))
    assert seen > len(numbers) / 3
    assert told >= 0.85 * seen


def test_a_warm_up_is_told_from_mechanisms_that_move_the_levels(table: SigmaTable) -> None:
    """Of the rig's campaigns of 12 recordings and more that scatter by at most 3 % and hide a mechanism of contact."""
    moving = {"contact_creep", "misalignment", "layered_contact", "amplitude_nonlinearity", "moving_contact_edge"}
    told, seen = 0, 0
    for number in first(45, range(70)):
        description = drawn(938002, number, "single")
        if not moving & set(description["effects"]) or description["noise"]["gain"] > 0.03:
            continue
        made, _ = from_dict(recorded_campaign(record(description)))
        if len(made.recordings) < 12:
            continue
        assert Reason.WARM_UP not in named(inspect(made, table))
        cold = changed(made, partial(_warming, 1 - 0.25 * np.exp(-recording_order(frf_recordings(made)) / 4)))
        seen += 1
        told += Reason.WARM_UP in named(inspect(cold, table))
    assert seen >= 8
    assert told >= 0.9 * seen


def test_a_warm_up_is_told_of_six_recordings(good: Campaign, table: SigmaTable) -> None:
    six = replace(good, recordings=tuple(shuffled(good).recordings[:6]))
    order = recording_order(frf_recordings(six))
    assert named(inspect(six, table)) == []
    assert named(inspect(changed(six, partial(_warming, 1 - 0.3 * np.exp(-order / 1.5))), table)) == [Reason.WARM_UP]


def test_a_warm_up_is_told_of_ten_recordings_and_no_drift_of_a_few_percent(good: Campaign, table: SigmaTable) -> None:
    ten = replace(good, recordings=tuple(shuffled(good).recordings[:10]))
    order = recording_order(frf_recordings(ten))
    assert named(inspect(changed(ten, partial(_warming, 1 - 0.3 * np.exp(-order / 2))), table)) == [Reason.WARM_UP]
    order = recording_order(frf_recordings(shuffled(good)))
    slight = changed(shuffled(good), partial(_warming, 1 - 0.03 * np.exp(-order / 2)))
    assert named(inspect(slight, table)) == []


def test_a_few_of_many_levels_that_are_an_rms_off_may_have_missed_their_place(
    good: Campaign, table: SigmaTable
) -> None:
    """Two of the recordings at 1/√2 of their level are no slip of amplitudes, five are."""
    number = np.random.default_rng(5).permutation(len(good.recordings))
    for off, told in ((number[:2], []), (number[:5], [Reason.AMPLITUDE_FACTOR])):
        factors = np.where(np.isin(np.arange(len(number)), off), 0.5**0.5, 1.0)
        assert named(inspect(changed(good, partial(_warming, factors)), table)) == told


def test_a_fall_that_load_cycles_explain_is_ageing(good: Campaign, table: SigmaTable) -> None:
    aged = changed(good, lambda entry, n: times(entry, 1 + 0.3 * float(np.exp(-n / 2))))
    assert named(inspect(aged, table)) == []


@pytest.mark.parametrize("hidden", ["none", "single"])
def test_physics_is_no_slip(hidden: str, table: SigmaTable) -> None:
    """The rig's own effects, from subtle to strong, on 40 campaigns in `make soak`, else on 6."""
    for number in first(6, range(40)):
        made, _ = from_dict(recorded_campaign(record(drawn(77, number, hidden))))
        assert named(inspect(made, table)) == [], number


def test_slips_lead_the_caveats_and_a_dead_sensor_leads_them_all() -> None:
    weak = Finding(Reason.WEAK_SENSOR, "r8", "frf_re_pc_per_n", {"sensor": "s1", "share": 0.1, "recordings": 8})
    dead = Finding(Reason.SILENT_SENSOR, "r4", "frf_re_pc_per_n", {"sensor": "s0", "recordings": 4})
    first, second = slips([weak.in_report(), dead.in_report()])
    assert "'s0' shows no response" in first
    assert "'s1' answers with 0.1" in second
