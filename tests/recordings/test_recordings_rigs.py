"""Rig descriptions: what they refuse, what they convert."""

import copy
import functools
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from tests.recordings.real_files import example_rig
from tests.support.instrument_files import COMMON, EXAMPLES, rig, tdms
from underskin.errors import FileError, InvalidInput, SeveralInvalid
from underskin.recordings import read_file, rig_description
from underskin.recordings.campaign import FrfRecording, IndentationRecording
from underskin.recordings.rig_description import RigDescription

pytestmark = pytest.mark.slow

RIGS = sorted((EXAMPLES / "rigs").glob("*.yaml"))


@functools.cache
def parsed(text: str) -> RigDescription:
    return rig_description.parse(text.encode(), "rig.yaml")


SMALL = """
schema: rig/1
kind: indentation
skin: {poisson_ratio: 0.5}
recording: {indenter_radius_mm: 2.5, recorded_at: 2017-05-03T09:00:00Z}
channels:
  displacement_mm: {channel: depth, unit: um}
  force_n: {channel: load, unit: V, sensitivity: 1e-2, sensitivity_unit: V/mN}
"""


LOAD, DEPTH = ("channels", "force_n"), ("channels", "displacement_mm")


def indented(force: str, rig_text: str = SMALL) -> IndentationRecording:
    reading = read_file(f"depth;load\n0;0\n100;{force}\n200;{force}".encode(), "a.csv", parsed(rig_text))
    assert not reading.problems
    recording = reading.campaign.recordings[0]
    assert isinstance(recording, IndentationRecording)
    return recording


def test_units_and_sensitivities_are_applied() -> None:
    recording = indented("2.5")
    assert recording.displacement_mm == pytest.approx([0, 0.1, 0.2])
    assert recording.force_n == pytest.approx([0, 0.25, 0.25])  # 2.5 V over 0.01 V/mN is 250 mN
    assert recording.recorded_at == "2017-05-03T09:00:00Z"
    assert recording.id == "a"


def test_a_time_that_the_file_states_is_in_the_labs_zone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("UNDERSKIN_TIME_ZONE", "Europe/Rome")
    rig_of_file = parsed(SMALL.replace("2017-05-03T09:00:00Z", "{property: Date}"))
    for written in ("03.05.2026 14:30", "2026-05-03 14:30", "2026-05-03T12:30Z"):
        reading = read_file(f"# Date: {written}\ndepth;load\n0;0\n100;2,5\n200;3".encode(), "a.csv", rig_of_file)
        (recorded,) = [one.recorded_at for one in reading.campaign.recordings]
        assert datetime.fromisoformat(recorded or "") == datetime(2026, 5, 3, 12, 30, tzinfo=UTC)


def test_the_instruments_own_give_is_subtracted() -> None:
    stiff = SMALL.replace("unit: um}", "unit: um, stiffness_n_per_mm: 5}")
    recording = indented("2.5", stiff)
    assert recording.displacement_mm == pytest.approx([0, 0.05, 0.15])
    assert recording.stage_stiffness_n_per_mm == 5  # contact that sticks comes off by it


def test_a_force_that_falls_with_depth_needs_its_sign_said() -> None:
    with pytest.raises(FileError, match=r"a\.csv: channels: force falls .* say sign: 1, -1 or auto"):
        indented("-2.5")
    turned = SMALL.replace("channel: load,", "channel: load, sign: -1,").replace(
        "channel: depth,", "channel: depth, sign: 1,"
    )
    assert indented("-2.5", turned).force_n == pytest.approx([0, 0.25, 0.25])


@pytest.mark.parametrize(
    ("part", "changes", "message"),
    [
        ((), {"schema": "rig/2"}, "schema = 'rig/2': must be rig/1"),
        ((), {"kind": "tension"}, "kind = 'tension': must be one of frf, indentation, compression"),
        ((), {"rig": 3}, "rig = 3: unknown field"),
        (("skin",), {"colour": 0.5}, r"skin\.colour = 0\.5: must be one of"),
        (("recording",), {"preload_n": 2.5}, r"recording\.preload_n = 2\.5: must be one of"),
        (("channels",), {"charge_pc": {"channel": "load"}}, r"channels\.charge_pc .*must be one of"),
        (LOAD, {"channel": None}, r"channels\.force_n\.channel: required"),
        (LOAD, {"sign": 2}, r"channels\.force_n\.sign = 2: must be 1, -1 or auto"),
        (LOAD, {"offset": 2}, r"channels\.force_n\.offset = 2: unknown field"),
        (LOAD, {"sensitivity": None}, r"channels\.force_n\.sensitivity: needs a sensitivity_unit"),
        (LOAD, {"stiffness_n_per_mm": 1}, "is for displacement_mm"),
        (DEPTH, {"unit": None, "labelled": "um"}, r"channels\.displacement_mm\.unit: required where labelled"),
    ],
)
def test_wrong_rig_description_refused_field(part: tuple[str, ...], changes: dict[str, Any], message: str) -> None:
    """A wrong rig description is refused by field."""
    described: dict[str, Any] = copy.deepcopy(dict(parsed(SMALL).document))
    place = functools.reduce(lambda found, name: found[name], part, described)
    place.update(changes)
    for name in [name for name, value in changes.items() if value is None]:
        del place[name]
    with pytest.raises(InvalidInput, match=message):
        rig_description.from_dict(described)


def test_all_that_is_wrong_is_told_at_once_and_nothing_that_hangs_on_it() -> None:
    wrong = SMALL.replace("unit: um", "stiffness_n_per_mm: -1, sign: 3").replace("1e-2", "abc")
    wrong = wrong.replace("kind:", "trim: {first_sample: 0}\nderived: {depth: 2 *, load: )}\nestimator: H1\nkind:")
    with pytest.raises(SeveralInvalid) as raised:
        parsed(wrong)
    fields = ["channels.displacement_mm.sign", "channels.displacement_mm.stiffness_n_per_mm"]
    fields += ["channels.force_n.sensitivity", "derived.depth", "derived.load", "estimator", "trim.first_sample"]
    assert sorted(error.field for error in raised.value.errors) == fields
    assert all(f"{field} = " in str(raised.value) for field in fields)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [1, 2", r"rig\.yaml: line [12]: not YAML"),  # parsers differ on where an end is missing
        ("a: &x [1]\nb: *x", r"rig\.yaml: line 2: not YAML: references"),
        ("!!python/object/apply:os.system [ls]", r"rig\.yaml: line 1: not YAML: could not determine a constructor"),
        ("{" * 3000, "rig.yaml: line 1.*not JSON"),
        ("[" * 3000, r"rig\.yaml: line 1: not YAML: lists and mappings are nested more than 100 deep"),
        ("a: " + "[" * 60_000, r"rig\.yaml: line 1: not YAML: lists and mappings are nested more than 100 deep"),
        ("a: !!int " + "9" * 60_000, r"rig\.yaml: not YAML: .*digits"),
        ('{"schema": }', r"rig\.yaml: line 1, column 12: not JSON"),
        ("x" * 64_001, r"rig\.yaml: has 64001 bytes; a rig description may have up to 64000"),
    ],
)
def test_what_is_no_rig_description_is_refused(text: str, message: str) -> None:
    with pytest.raises(FileError, match=message):
        parsed(text)


def test_what_json_has_not_is_no_number() -> None:
    text = SMALL.replace("radius_mm: 2.5", "radius_mm: 2.5, temperature: .nan").replace("1e-2", "!!float .inf")
    text = text.replace("depth,", "depth, sign: !!set {a}, stiffness_n_per_mm: !!binary aGk=,")
    with pytest.raises(SeveralInvalid) as raised:
        parsed(text)
    assert sorted(f"{error.field} = {error.value}" for error in raised.value.errors) == [
        "channels.displacement_mm.sign = {'a'}",
        "channels.displacement_mm.stiffness_n_per_mm = b'hi'",
        "channels.force_n.sensitivity = inf",
        "recording.temperature = .nan",
    ]
    with pytest.raises(InvalidInput, match=r"channels\.force_n\.sensitivity = .*must be"):
        parsed(SMALL.replace("1e-2", "123456789012345678901"))


@pytest.mark.parametrize(
    ("channel", "message"),
    [
        (
            {"channel": "amplifier", "unit": "V"},
            "its unit 'V' is one of voltage; charge_pc needs one of charge, such as pC; a signal",
        ),
        ({"channel": "amplifier"}, "has no unit in the file"),
        ({"channel": "force"}, "its unit 'mN' is one of force; charge_pc needs one of charge"),
        ({"channel": "force", "unit": "pC"}, r"is labelled 'mN', .* says 'pC': .*add labelled: mN"),
        ({"channel": "force", "unit": "pC", "labelled": "g"}, "is labelled 'mN', not 'g'"),
        (
            {"channel": "amplifier", "unit": "V", "sensitivity": 1, "sensitivity_unit": "A/pC"},
            "is not of the sensitivity's",
        ),
        (
            {"channel": "charge", "unit": "pC"},
            r"no part holds all .*: it lacks charge; it has force \[mN\], amplifier \[\?\]",
        ),
    ],
)
def test_a_channel_that_does_not_fit_is_refused(channel: dict[str, Any], message: str) -> None:
    channels = {"force_n": {"channel": "force"}, "charge_pc": channel}
    with pytest.raises(FileError, match=rf"run\.csv: .*{message}"):
        read_file(b"force [mN];amplifier\n1000;0\n1100;-0.007\n900;0.007", "run.csv", rig(channels=channels))


def test_a_property_that_the_file_does_not_state_is_refused() -> None:
    with pytest.raises(
        FileError, match=r"property 'rate': is not in the file, which states block, operator, run\.preload, preload"
    ):
        read_file(tdms(1), "run.tdms", rig(recording={**COMMON, "preload_n": {"property": "rate"}}))
    reading = read_file(tdms(1), "run.tdms", rig(recording={**COMMON, "preload_n": {"property": "run.preload"}}))
    recording = reading.campaign.recordings[0]
    assert isinstance(recording, FrfRecording)
    assert recording.preload_n == 1.0


@pytest.mark.parametrize("file", RIGS, ids=lambda file: file.stem)
def test_the_example_rig_descriptions_are_valid(file: Path) -> None:
    assert example_rig(file.stem).channels


def test_a_channel_may_be_named_without_the_unit_in_brackets_behind_it() -> None:
    described, rows = parsed(SMALL), "0;0\n100;2.5\n200;2.5"
    (recording,) = read_file(f"depth [um];load (V)\n{rows}".encode(), "a.csv", described).campaign.recordings
    assert isinstance(recording, IndentationRecording)
    assert recording.force_n == pytest.approx([0, 0.25, 0.25])
    both = rows.replace(";0", ";0;1").replace(";2.5", ";2.5;1")
    with pytest.raises(
        FileError, match=r"no part holds .*: it lacks load; it has depth \[um\], load \[V\], load \[mV\]"
    ):
        read_file(f"depth [um];load [V];load [mV]\n{both}".encode(), "a.csv", described)
    (exact,) = read_file(f"depth [um];load;load [mV]\n{both}".encode(), "a.csv", described).campaign.recordings
    assert exact.force_n == pytest.approx([0, 0.25, 0.25])
