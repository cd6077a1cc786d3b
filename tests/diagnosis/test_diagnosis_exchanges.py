"""Labels and cables of sensors that are exchanged: named, and never seen where sensors fail or step."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
import pytest

from rig.draw import drawn, record
from rig.recorded import campaign as recorded_campaign
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.slip_campaigns import MADE, Change, changed, named, times
from underskin.diagnosis.screening.inspection import inspect
from underskin.findings.codes import FindingCode, Reason
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings, from_dict
from underskin.surrogate.sigma_table import SigmaTable


@pytest.fixture(scope="module")
def good(table: SigmaTable) -> Campaign:
    return campaign(MADE, table)


def exchanged(first: str, second: str, since: int = 0) -> Change:
    other = {first: second, second: first}
    return lambda entry, n: replace(entry, sensor=other.get(entry.sensor, entry.sensor)) if n >= since else entry


def test_exchanged_labels_contradict_the_places(good: Campaign, table: SigmaTable) -> None:
    inspected = inspect(changed(good, exchanged("s0", "s2")), table)
    assert named(inspected) == [Reason.LABELS_EXCHANGED]
    assert [entry.sensor for entry in frf_recordings(inspected.campaign)] == [
        entry.sensor for entry in frf_recordings(good)
    ]


def test_an_exchange_shows_nowhere_where_each_contact_is_on_its_own_sensor(good: Campaign, table: SigmaTable) -> None:
    centred = changed(good, lambda entry, _: replace(entry, position_mm=None))
    assert named(inspect(changed(centred, exchanged("s0", "s2")), table)) == []


def test_cables_exchanged_from_some_recording_on(good: Campaign, table: SigmaTable) -> None:
    """Told by the places; without them by the sensors' gains; and by two sensors that are silent since."""
    since = 26
    inspected = inspect(changed(good, exchanged("s0", "s2", since)), table)
    assert named(inspected) == [Reason.CABLES_EXCHANGED]
    told = next(entry for entry in inspected.findings if entry.reason == Reason.CABLES_EXCHANGED)
    assert told.arguments["since"] == "r26"
    gains = {"s0": 0.8, "s1": 1.0, "s2": 1.2}
    unequal = changed(good, lambda entry, _: replace(times(entry, gains[entry.sensor]), position_mm=None))
    by_gains = inspect(changed(unequal, exchanged("s0", "s2", since)), table)
    assert named(by_gains) == [Reason.CABLES_EXCHANGED]
    assert [entry.sensor for entry in frf_recordings(by_gains.campaign)] == [
        entry.sensor for entry in frf_recordings(good)
    ]


def rotated(since: int) -> Change:
    """A plug that is off by one: each label is the next sensor's."""
    following = {"s0": "s1", "s1": "s2", "s2": "s0"}
    return lambda entry, n: replace(entry, sensor=following[entry.sensor]) if n >= since else entry


@pytest.mark.parametrize("since", [0, 20])
def test_a_rotated_connector_is_put_right_as_a_whole(since: int, good: Campaign, table: SigmaTable) -> None:
    inspected = inspect(changed(good, rotated(since)), table)
    assert named(inspected) == [Reason.LABELS_PERMUTED]
    assert [entry.sensor for entry in frf_recordings(inspected.campaign)] == [
        entry.sensor for entry in frf_recordings(good)
    ]


def test_four_sensors_shifted_by_one_are_put_right_and_no_pair_of_them_is(table: SigmaTable) -> None:
    four = campaign(replace(MADE, sensors=4, repeats=1), table)
    shifted = changed(four, lambda entry, _: replace(entry, sensor=f"s{(int(entry.sensor[1:]) + 1) % 4}"))
    inspected = inspect(shifted, table)
    assert named(inspected) == [Reason.LABELS_PERMUTED]
    assert [entry.sensor for entry in frf_recordings(inspected.campaign)] == [
        entry.sensor for entry in frf_recordings(four)
    ]


def test_a_rotation_is_put_right_where_not_every_sensor_would_show_it_alone(table: SigmaTable) -> None:
    """The rig's contacts lie between the sensors: those of s05, labelled s09, might be of its neighbours."""
    made, _ = from_dict(recorded_campaign(record(drawn(944001, 49, "single"))))
    label = {"s05": "s09", "s09": "s04", "s04": "s05"}
    wrong = changed(made, lambda entry, _: replace(entry, sensor=label.get(entry.sensor, entry.sensor)))
    inspected = inspect(wrong, table)
    assert named(inspected) == [Reason.LABELS_PERMUTED]
    right = {entry.id: entry.sensor for entry in frf_recordings(made)}
    assert all(right[entry.id] == entry.sensor for entry in frf_recordings(inspected.campaign))


def test_labels_that_no_permutation_explains_are_left_out(table: SigmaTable) -> None:
    """The channel of s0 has the charge of s1, that of s1 the charge of s2, that of s2 none; s3 is right."""
    random = np.random.default_rng(6)

    def shifted(entry: FrfRecording, _: int) -> FrfRecording:
        if entry.sensor != "s0":
            return replace(entry, sensor={"s1": "s0", "s2": "s1", "s3": "s3"}[entry.sensor])
        real, imaginary = 0.02 * random.normal(size=(2, MADE.lines))
        return replace(entry, sensor="s2", frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary)

    inspected = inspect(changed(campaign(replace(MADE, sensors=4, repeats=1), table), shifted), table)
    assert named(inspected) == [Reason.LABELS_CONTRADICT_PLACES]
    told = next(entry for entry in inspected.findings if entry.reason == Reason.LABELS_CONTRADICT_PLACES)
    assert told.arguments == {"sensors": ["s0", "s1"], "recordings": 16}
    assert {entry.sensor for entry in frf_recordings(inspected.campaign)} == {"s3"}


def test_an_exchange_with_a_sensor_that_has_no_recording_of_its_own_is_put_right(
    good: Campaign, table: SigmaTable
) -> None:
    """The recordings at s2 are labelled s0, and none is labelled s2."""
    once = replace(good, recordings=good.recordings[:24])
    inspected = inspect(changed(once, lambda entry, n: replace(entry, sensor="s0") if n >= 16 else entry), table)
    assert named(inspected) == [Reason.CABLES_EXCHANGED]
    assert [entry.sensor for entry in frf_recordings(inspected.campaign)] == [
        entry.sensor for entry in frf_recordings(once)
    ]


def unheard(silent: Collection[str], since: int) -> Change:
    """No response of these sensors from a recording on, pressed where they are."""
    random = np.random.default_rng(6)

    def change(entry: FrfRecording, n: int) -> FrfRecording:
        if n < since or entry.sensor not in silent:
            return replace(entry, position_mm=None)
        real, imaginary = 0.02 * random.normal(size=(2, MADE.lines))
        return replace(entry, position_mm=None, frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary)

    return change


def test_two_sensors_that_fall_silent_together_are_left_out_and_may_share_a_failure(
    good: Campaign, table: SigmaTable
) -> None:
    inspected = inspect(changed(good, unheard(("s0", "s2"), 26)), table)
    assert named(inspected) == [Reason.SILENT_TOGETHER]
    told = next(entry for entry in inspected.findings if entry.reason == Reason.SILENT_TOGETHER)
    assert "both show no response since recording 'r26'" in told.statement
    assert "a connector or amplifier that they share" in told.statement
    assert len(inspected.campaign.recordings) == 26 + 8


def test_one_silent_recording_of_each_is_no_failure_that_they_share(good: Campaign, table: SigmaTable) -> None:
    """The last of s0 and of s2, both recorded before s1."""
    at = {name: [n for n, entry in enumerate(frf_recordings(good)) if entry.sensor == name] for name in ("s0", "s2")}
    last = {own[-1] for own in at.values()}
    change = unheard(("s0", "s2"), 0)
    silent = changed(good, lambda entry, n: change(entry, n) if n in last else replace(entry, position_mm=None))
    inspected = inspect(silent, table)
    assert named(inspected) == []
    assert FindingCode.NO_RESPONSE in {entry.code for entry in inspected.findings}


def test_exchanged_labels_are_told_where_all_contacts_miss_their_places(table: SigmaTable) -> None:
    """The rig's array of 2 × 2 sensors, pressed 0.7 mm beside every commanded place."""
    description = drawn(934567, 56, "single")
    assert set(description["effects"]) == {"misalignment"}
    made, _ = from_dict(recorded_campaign(record(description)))
    assert named(inspect(made, table)) == []
    inspected = inspect(changed(made, exchanged("s02", "s04")), table)
    assert named(inspected) == [Reason.LABELS_EXCHANGED]
    assert [entry.sensor for entry in frf_recordings(inspected.campaign)] == [
        entry.sensor for entry in frf_recordings(made)
    ]


def test_the_labels_of_an_array_of_two_sensors_are_exchanged(table: SigmaTable) -> None:
    """No recording then answers as given."""
    two = campaign(Made(sensors=2, repeats=2, lines=20), table)
    inspected = inspect(changed(two, exchanged("s0", "s1")), table)
    assert named(inspected) == [Reason.LABELS_EXCHANGED]
    assert [entry.sensor for entry in frf_recordings(inspected.campaign)] == [
        entry.sensor for entry in frf_recordings(two)
    ]


def test_a_single_recording_after_an_exchange_tells_it_by_its_place(good: Campaign, table: SigmaTable) -> None:
    last = max(number for number, entry in enumerate(frf_recordings(good)) if entry.sensor in ("s0", "s2"))
    inspected = inspect(changed(good, exchanged("s0", "s2", last)), table)
    assert named(inspected) == [Reason.CABLES_EXCHANGED]
    told = next(entry for entry in inspected.findings if entry.reason == Reason.CABLES_EXCHANGED)
    assert told.arguments["recordings"] == 1
    assert [entry.sensor for entry in frf_recordings(inspected.campaign)] == [
        entry.sensor for entry in frf_recordings(good)
    ]


def test_a_step_of_one_sensor_alone_is_no_exchange(good: Campaign, table: SigmaTable) -> None:
    """Though another sensor has just the level that it steps to."""
    gains = {"s0": 0.8, "s1": 1.0, "s2": 0.95}

    def stepped(entry: FrfRecording, n: int) -> FrfRecording:
        gain = gains["s2"] if entry.sensor == "s0" and n >= 26 else gains[entry.sensor]
        return replace(times(entry, gain), position_mm=None)

    assert named(inspect(changed(good, stepped), table)) == []


def test_sensors_that_all_fall_silent_are_not_exchanged(good: Campaign, table: SigmaTable) -> None:
    """Two of three may be exchanged; of two, or where no other answers, the amplifier may have failed."""
    for left in ({"s0", "s1", "s2"}, {"s0", "s2"}):
        silent = changed(good, unheard(("s0", "s1", "s2"), 26))
        silent = replace(silent, recordings=tuple(entry for entry in frf_recordings(silent) if entry.sensor in left))
        inspected = inspect(silent, table)
        assert named(inspected) == []
        assert FindingCode.NO_RESPONSE in {entry.code for entry in inspected.findings}


def test_a_silent_recording_near_a_crossing_of_zero_is_physics(table: SigmaTable) -> None:
    """The rig's layer is thinner than declared, so that one contact beside its sensor lies where σ crosses zero."""
    description = drawn(956789, 88, "single")
    assert set(description["effects"]) == {"thickness_error"}
    made, _ = from_dict(recorded_campaign(record(description)))
    assert FindingCode.NO_RESPONSE not in {entry.code for entry in inspect(made, table).findings}
