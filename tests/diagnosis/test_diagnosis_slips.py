"""Slips of a lab in whole campaigns: named, put right or left out, and never seen in what physics does."""

import re
from dataclasses import replace

import numpy as np
import pytest

from rig.draw import drawn, record
from rig.recorded import campaign as recorded_campaign
from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.slip_campaigns import MADE, Change, changed, looked_at, named, put_right, right, slips, times
from underskin.mechanisms.unlisted.forms import recording_order
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings, from_dict
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def good(table: SigmaTable) -> Campaign:
    return campaign(MADE, table)


def of_rig(seed: int, number: int, hidden: str) -> Campaign:
    made, _ = from_dict(recorded_campaign(record(drawn(seed, number, hidden))))
    return made


def by(factors: Floats) -> Change:
    """Each recording times a factor of its own."""
    return lambda entry, n: times(entry, float(factors[n]))


def a_third(count: int, factor: float, seed: int = 8) -> Floats:
    """The factor for a third of the recordings, at random."""
    return np.where(np.random.default_rng(seed).random(count) < 1 / 3, factor, 1.0)


PHASES = [("contact_resonance", (30.0, 0.05)), ("timing_delay", (200.0,)), ("amplifier_high_pass", (1.0, 1.0))]


@pytest.mark.parametrize(("mechanism", "parameters"), first(1, PHASES))
def test_conjugated_frfs_are_put_right(mechanism: str, parameters: tuple[float, ...], table: SigmaTable) -> None:
    """Those that contradict the others, and all, which then have a phase that nothing has; but a delay of all may as
    well be a lag of the force channel: it stays as it is."""
    made = campaign(replace(MADE, mechanisms=(mechanism,), parameters=parameters), table)
    report = looked_at(made, table, mechanism)
    assert slips(report) == []
    quarter = looked_at(
        changed(made, lambda entry, n: times(entry, 1.0, -1.0 if n % 4 == 1 else 1.0)), table, mechanism
    )
    ((code, statement),) = slips(quarter)
    assert code == "conjugated"
    assert "12 of 48 recordings" in statement
    assert put_right(quarter, report)
    every = looked_at(changed(made, conjugate), table, mechanism)
    ((code, statement),) = slips(every)
    assert code == "conjugated"
    if mechanism == "timing_delay":
        (delay,) = every["mechanisms"][0]["parameters"]
        assert delay["value"] == pytest.approx(-parameters[0], rel=0.05)
    else:
        assert put_right(every, report)
    assert ("either the FRFs are conjugated" in statement) == (mechanism == "timing_delay")


def test_where_there_is_no_phase_nothing_is_said_of_it(good: Campaign, table: SigmaTable) -> None:
    """Nor where each recording has one of its own, some milliradians, of either sign."""
    assert named(changed(good, lambda entry, _: times(entry, 1.0, -1.0)), table) == []
    exact = campaign(replace(MADE, line=0.002), table)
    phase = np.exp(0.004j * np.random.default_rng(1).normal(size=len(exact.recordings)))
    assert named(changed(exact, lambda entry, n: turned(entry, phase[n])), table) == []


def turned(entry: FrfRecording, factor: complex | np.ndarray) -> FrfRecording:
    frf = (np.asarray(entry.frf_re_pc_per_n) + 1j * np.asarray(entry.frf_im_pc_per_n)) * factor
    return replace(entry, frf_re_pc_per_n=frf.real, frf_im_pc_per_n=frf.imag)


def hertz(entry: FrfRecording) -> Floats:
    assert entry.frequency_hz is not None
    return entry.frequency_hz


def test_what_leads_by_nature_is_not_conjugated(table: SigmaTable) -> None:
    """A cable that vibrates, and a sharp resonance in the band, beyond which noise decides how phase is counted."""
    wide = campaign(replace(MADE, repeats=1, highest_hz=1000.0), table)

    def vibrating(entry: FrfRecording, _: int) -> FrfRecording:
        turn = 1j * hertz(entry) / 280.0
        return turned(entry, 1 + 0.3 * turn**2 / (turn**2 + 1.4 * turn + 1))

    def resonant(entry: FrfRecording, n: int) -> FrfRecording:
        ratio = hertz(entry) / (120.0 + n)
        return turned(entry, 1 / (1 - ratio**2 + 0.02j * ratio))

    for change in (vibrating, resonant):
        assert "conjugated" not in named(changed(wide, change), table)


def test_a_lag_of_the_force_channel_beside_a_high_pass_is_no_other_convention(table: SigmaTable) -> None:
    """The high pass tells that the phase is as it should be; conjugated, it tells that it is not."""
    wide = campaign(replace(MADE, repeats=1, highest_hz=1000.0), table)

    def lagging(entry: FrfRecording, _: int) -> FrfRecording:
        return turned(entry, np.exp(2e-4j * np.pi * hertz(entry)) / (1 - 0.5j / hertz(entry)))

    late = changed(wide, lagging)
    assert "conjugated" not in named(late, table)
    early = changed(changed(late, lambda entry, _: turned(entry, np.exp(-4e-4j * np.pi * hertz(entry)))), conjugate)
    assert named(early, table) == ["conjugated"]


def conjugate(entry: FrfRecording, _: int) -> FrfRecording:
    return times(entry, 1.0, -1.0)


def test_polarity_at_random_is_put_right(good: Campaign, table: SigmaTable) -> None:
    report = looked_at(changed(good, by(a_third(len(good.recordings), -1.0, seed=4))), table)
    assert [code for code, _ in slips(report)] == ["sign_flipped"]
    assert put_right(report, right(good, table))


def test_weak_sensor_left_out_spread_sensors(good: Campaign, table: SigmaTable) -> None:
    """A sensor at 7 %, the factor of no range, is left out and a spread of sensors is not."""
    report = looked_at(changed(good, lambda entry, _: times(entry, 0.07 if entry.sensor == "s1" else 1.0)), table)
    ((code, statement),) = slips(report)
    assert code == "weak"
    assert "'s1' answers with 0.07" in statement
    others = replace(good, recordings=tuple(entry for entry in frf_recordings(good) if entry.sensor != "s1"))
    assert put_right(report, looked_at(others, table))
    spread = {"s0": 0.6, "s1": 1.4, "s2": 1.0}
    assert named(changed(good, lambda entry, _: times(entry, spread[entry.sensor])), table, "sensor_spread") == []


def test_two_ranges_leave_d33_open(table: SigmaTable) -> None:
    """Half of the sensors on another range of the amplifier are no spread: both halves are named, d33 is not quoted."""
    six = campaign(Made(sensors=6), table)
    halves = changed(six, lambda entry, _: times(entry, 4.0 if entry.sensor in ("s1", "s3", "s4") else 1.0))
    report = looked_at(halves, table)
    ((code, statement),) = slips(report)
    assert code == "gain_steps"
    assert statement.startswith("sensors s0, s2, s5 and sensors s1, s3, s4 are two groups")
    assert report["verdict"] == "no_mismatch"
    assert not report["d33"]["quotable"]
    by_others = re.search(r"by the sensors s1, s3 and s4 it is ([0-9.]+) times that", report["statement"])
    assert by_others
    assert float(by_others[1]) == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(("share", "word"), first(2, [(0.75, "weak"), (2.0, "strong"), (1.35, "strong")]))
def test_a_sensor_that_stands_alone_is_its_own_fault_and_no_physics(share: float, word: str, table: SigmaTable) -> None:
    six = campaign(Made(sensors=6), table)
    report = looked_at(changed(six, lambda entry, _: times(entry, share if entry.sensor == "s3" else 1.0)), table)
    ((code, statement),) = slips(report)
    assert code == word
    told = re.match(r"sensor 's3' responds with ([0-9.]+) times the others' charge", statement)
    assert told
    assert float(told[1]) == pytest.approx(share, rel=0.04)
    assert ("peak-to-peak for amplitudes" in statement) == (share == 2.0)
    assert report["verdict"] == "no_mismatch"
    assert report["statement"].startswith("Sensor 's3' responds with ")
    assert report["d33"]["low"] < 15.0 < report["d33"]["high"]


def test_of_sensors_that_all_differ_none_stands_alone(table: SigmaTable) -> None:
    """A spread of 15 %, as poled films have, in skins of six sensors."""
    six = campaign(Made(sensors=6), table)
    for seed in first(1, range(12)):
        gains = np.exp(0.15 * np.random.default_rng(seed).normal(size=6))
        assert named(changed(six, by(np.repeat(gains, len(six.recordings) // 6))), table, "sensor_spread") == [], seed


@pytest.mark.parametrize(
    ("factor", "meant"), first(2, [(2.0, "peak-to-peak"), (0.5**0.5, "rms"), (0.5, "peak-to-peak"), (2**0.5, "rms")])
)
def test_amplitudes_of_another_kind_are_put_right(factor: float, meant: str, good: Campaign, table: SigmaTable) -> None:
    report = looked_at(changed(good, by(a_third(len(good.recordings), factor))), table)
    ((code, statement),) = slips(report)
    assert code == "gain_steps"
    assert meant in statement
    assert put_right(report, right(good, table))


def test_factor_recordings_share_no_meaning(good: Campaign, table: SigmaTable) -> None:
    """A factor that all recordings share and one of no meaning are no slips.

    Nor one of two recordings, which may have missed their place.
    """
    count = len(good.recordings)
    two = np.where(np.isin(np.random.default_rng(5).permutation(count), (0, 1)), 0.5**0.5, 1.0)
    for factors in (np.full(count, 2.0), a_third(count, 1.65), two):
        assert named(changed(good, by(factors)), table) == []


@pytest.mark.parametrize(
    ("seed", "number", "factor"),
    first(1, [(900500, 11, 0.5**0.5), (944207, 59, 2.0), (900500, 11, 2**0.5), (944207, 59, 0.5)]),
)
def test_kind_amplitude_told_beside_scatter(seed: int, number: int, factor: float, table: SigmaTable) -> None:
    """Another kind of amplitude is told beside a scatter that no rig has.

    Campaigns of the rig whose places scatter: levels of two kinds overlap, or look like a gain that scatters.
    """
    made = of_rig(seed, number, "none")
    assert named(changed(made, by(a_third(len(made.recordings), factor, seed=11))), table) == ["gain_steps"]


@pytest.mark.parametrize("number", first(1, [274, 297]))
def test_presses_that_miss_their_place_are_no_factor(number: int, table: SigmaTable) -> None:
    """One sensor, presses beside it that scatter by 0.45 mm: such a miss lowers the level, some by half and more."""
    description = drawn(961377, number, "none")
    description["noise"]["position_mm"] = 0.45
    made, _ = from_dict(recorded_campaign(record(description)))
    assert "gain_steps" not in named(made, table)


def warming(made: Campaign, amplitude: float, recordings: float) -> Campaign:
    """That starts beside its level and comes to it over so many recordings."""
    return changed(made, by(1 + amplitude * np.exp(-recording_order(frf_recordings(made)) / recordings)))


def shuffled(made: Campaign) -> Campaign:
    """Recorded in another order than listed, by `recorded_at`; without load cycles, which may age a sensor."""
    order = np.random.default_rng(3).permutation(len(made.recordings))

    def at(entry: FrfRecording, n: int) -> FrfRecording:
        minutes = int(order[n])
        stamp = f"2020-01-01T{10 + minutes // 60:02d}:{minutes % 60:02d}:00Z"
        return replace(entry, load_cycles=None, recorded_at=stamp)

    return changed(made, at)


@pytest.mark.parametrize("amplitude", first(1, [0.3, -0.2]))
def test_a_warm_up_is_left_out(amplitude: float, good: Campaign, table: SigmaTable) -> None:
    report = looked_at(warming(shuffled(good), amplitude, 2.0), table)
    ((code, statement),) = slips(report)
    assert code == "warm_up"
    left_out = re.search(r"The first (\d+) were left out", statement)
    assert left_out
    assert 3 <= int(left_out[1]) <= 12
    assert report["verdict"] == "no_mismatch"
    assert report["d33"]["low"] < 15.0 < report["d33"]["high"]


def test_a_warm_up_is_told_of_few_recordings_and_no_drift_of_a_few_percent(good: Campaign, table: SigmaTable) -> None:
    made = shuffled(good)
    for count, recordings in ((6, 1.5), (10, 2.0)):
        few = replace(made, recordings=made.recordings[:count])
        assert named(few, table) == []
        assert named(warming(few, -0.3, recordings), table) == ["warm_up"]
    assert named(warming(made, -0.03, 2.0), table) == []
    aged = changed(good, lambda entry, n: times(entry, 1 + 0.3 * float(np.exp(-n / 2))))
    assert named(aged, table) == []  # which load cycles explain


def quiet_of_rig(seed: int, numbers: int, hidden: str, least: int) -> list[Campaign]:
    """Campaigns of the rig of so many recordings at least, that scatter by at most 3 %."""
    descriptions = [drawn(seed, number, hidden) for number in range(numbers)]
    made = [from_dict(recorded_campaign(record(one)))[0] for one in descriptions if one["noise"]["gain"] <= 0.03]
    return [one for one in made if len(one.recordings) >= least]


@pytest.mark.soak
def test_a_warm_up_is_told_from_mechanisms_that_move_the_levels(table: SigmaTable) -> None:
    """Of campaigns that hide a mechanism of contact."""
    moving = ("contact_creep", "misalignment", "layered_contact", "moving_contact_edge")
    every = quiet_of_rig(938002, 70, "single", 12)
    assert not any("warm_up" in named(made, table, *moving) for made in every)
    told = ["warm_up" in named(warming(made, -0.25, 4.0), table, *moving) for made in every]
    assert len(told) >= 8
    assert sum(told) >= 0.9 * len(told)


@pytest.mark.parametrize("hidden", ["none", "single"])
def test_physics_is_no_slip(hidden: str, table: SigmaTable) -> None:
    """The rig's own effects, from subtle to strong, on 40 campaigns in `make soak`, else on one."""
    for number in first(1, range(40)):
        description = drawn(77, number, hidden)
        made, _ = from_dict(recorded_campaign(record(description)))
        assert named(made, table, *description["effects"]) == [], number
