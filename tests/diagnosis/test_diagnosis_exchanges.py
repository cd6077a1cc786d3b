"""Labels and cables of sensors that are exchanged: named, and never seen where sensors fail or step."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
import pytest

from bench.soak import SOAK
from rig.draw import drawn, record
from rig.recorded import campaign as recorded_campaign
from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.slip_campaigns import MADE, Change, changed, looked_at, named, put_right, right, slips, times
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings, from_dict
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def good(table: SigmaTable) -> Campaign:
    return campaign(MADE, table)


def exchanged(first: str, second: str, since: int = 0) -> Change:
    other = {first: second, second: first}
    return lambda entry, n: replace(entry, sensor=other.get(entry.sensor, entry.sensor)) if n >= since else entry


def require_put_right(wrong: Campaign, good: Campaign, table: SigmaTable, *words: str, known: str = "") -> None:
    """One slip is named, in these words, and the report comes to the numbers of that on the good recordings."""
    report = looked_at(wrong, table, known)
    ((code, statement),) = slips(report)
    assert code == "sensors_exchanged"
    assert all(word in statement for word in words), statement
    assert put_right(report, right(good, table, known))


def test_exchanged_labels_contradict_the_places(good: Campaign, table: SigmaTable) -> None:
    """Of three sensors, and of an array of two, of which then no recording answers as given."""
    require_put_right(changed(good, exchanged("s0", "s2")), good, table, "'s0' and 's2'", "labels")
    two = campaign(Made(sensors=2, repeats=2, lines=20), table)
    require_put_right(changed(two, exchanged("s0", "s1")), two, table, "'s0' and 's1'", "labels")


def test_an_exchange_shows_nowhere_where_each_contact_is_on_its_own_sensor(good: Campaign, table: SigmaTable) -> None:
    centred = changed(good, lambda entry, _: replace(entry, position_mm=None))
    assert named(changed(centred, exchanged("s0", "s2")), table) == []


def test_cables_exchanged_from_some_recording_on(good: Campaign, table: SigmaTable) -> None:
    """Told by the places, also of a single recording after it; and without places by the sensors' gains."""
    require_put_right(changed(good, exchanged("s0", "s2", 26)), good, table, "r26")
    last = max(number for number, entry in enumerate(frf_recordings(good)) if entry.sensor in ("s0", "s2"))
    if SOAK:
        require_put_right(changed(good, exchanged("s0", "s2", last)), good, table, f"r{last}")
    gains = {"s0": 0.8, "s1": 1.0, "s2": 1.2}
    unequal = changed(good, lambda entry, _: replace(times(entry, gains[entry.sensor]), position_mm=None))
    require_put_right(changed(unequal, exchanged("s0", "s2", 26)), unequal, table, "r26", known="sensor_spread")


@pytest.mark.parametrize("since", first(1, [20, 0]))
def test_a_rotated_connector_is_put_right_as_a_whole(since: int, good: Campaign, table: SigmaTable) -> None:
    """A plug that is off by one: each label is the next sensor's."""
    following = {"s0": "s1", "s1": "s2", "s2": "s0"}
    wrong = changed(good, lambda entry, n: replace(entry, sensor=following[entry.sensor]) if n >= since else entry)
    require_put_right(wrong, good, table, "s0", "s1", "s2")


def test_labels_that_no_permutation_explains_are_left_out(table: SigmaTable) -> None:
    """The channel of s0 has the charge of s1, that of s1 the charge of s2, that of s2 none; s3 is right."""
    random = np.random.default_rng(6)

    def shifted(entry: FrfRecording, _: int) -> FrfRecording:
        if entry.sensor != "s0":
            return replace(entry, sensor={"s1": "s0", "s2": "s1", "s3": "s3"}[entry.sensor])
        real, imaginary = 0.02 * random.normal(size=(2, MADE.lines))
        return replace(entry, sensor="s2", frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary)

    whole = campaign(replace(MADE, sensors=4, repeats=1), table)
    report = looked_at(changed(whole, shifted), table)
    ((code, statement),) = slips(report)
    assert code == "sensors_exchanged"
    assert "s0, s1 answer where others were pressed" in statement
    s3 = replace(whole, recordings=tuple(entry for entry in frf_recordings(whole) if entry.sensor == "s3"))
    assert put_right(report, looked_at(s3, table))


def test_slips_of_several_kinds_are_all_put_right(good: Campaign, table: SigmaTable) -> None:
    """Exchanged labels beside reversed recordings: each is named, and none hides the other."""
    wrong = changed(changed(good, exchanged("s0", "s2")), lambda entry, n: times(entry, -1.0 if n in (3, 20) else 1.0))
    report = looked_at(wrong, table)
    assert sorted(code for code, _ in slips(report)) == ["sensors_exchanged", "sign_flipped", "sign_flipped"]
    assert put_right(report, right(good, table))


def test_exchange_sensor_no_recording_put_right(good: Campaign, table: SigmaTable) -> None:
    """An exchange with a sensor that has no recording of its own is put right.

    The recordings at s2 are labelled s0, and none is labelled s2.
    """
    once = replace(good, recordings=good.recordings[:24])
    wrong = changed(once, lambda entry, n: replace(entry, sensor="s0") if n >= 16 else entry)
    require_put_right(wrong, once, table, "r16")


def unheard(silent: Collection[str], since: int) -> Change:
    """No response of these sensors from a recording on, pressed where they are."""
    random = np.random.default_rng(6)

    def change(entry: FrfRecording, n: int) -> FrfRecording:
        if n < since or entry.sensor not in silent:
            return replace(entry, position_mm=None)
        real, imaginary = 0.02 * random.normal(size=(2, MADE.lines))
        return replace(entry, position_mm=None, frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary)

    return change


def test_two_sensors_fall_silent_together_left(good: Campaign, table: SigmaTable) -> None:
    """Two sensors that fall silent together are left out and may share a failure."""
    report = looked_at(changed(good, unheard(("s0", "s2"), 26)), table)
    ((_, statement),) = slips(report)
    assert "both show no response since recording 'r26'" in statement
    assert "a connector or amplifier that they share" in statement
    assert report["verdict"] == "no_mismatch"
    assert report["d33"]["low"] < 15.0 < report["d33"]["high"]


@pytest.mark.soak
def test_a_failure_that_sensors_do_not_share_is_no_exchange(good: Campaign, table: SigmaTable) -> None:
    """The last recording of s0 and of s2, both before s1; all sensors, of which the amplifier may have failed; and a
    sensor that steps to just the level that another one has."""
    at = {name: [n for n, entry in enumerate(frf_recordings(good)) if entry.sensor == name] for name in ("s0", "s2")}
    last = {own[-1] for own in at.values()}
    change, all_of_them = unheard(("s0", "s2"), 0), unheard(("s0", "s1", "s2"), 26)
    once = changed(good, lambda entry, n: change(entry, n) if n in last else replace(entry, position_mm=None))
    for silent in (once, changed(good, all_of_them)):
        report = looked_at(silent, table)
        assert slips(report) == []
        assert "no_response" in {entry["code"] for entry in report["findings"]}
    gains = {"s0": 0.8, "s1": 1.0, "s2": 0.95}

    def stepped(entry: FrfRecording, n: int) -> FrfRecording:
        gain = gains["s2"] if entry.sensor == "s0" and n >= 26 else gains[entry.sensor]
        return replace(times(entry, gain), position_mm=None)

    assert named(changed(good, stepped), table, "sensor_spread") == []


def test_a_silent_recording_near_a_crossing_of_zero_is_physics(table: SigmaTable) -> None:
    """The rig's layer is thinner than declared, so that one contact beside its sensor lies where σ crosses zero."""
    description = drawn(956789, 88, "single")
    assert set(description["effects"]) == {"thickness_error"}
    made, _ = from_dict(recorded_campaign(record(description)))
    assert "no_response" not in {entry["code"] for entry in looked_at(made, table, "thickness_error")["findings"]}
