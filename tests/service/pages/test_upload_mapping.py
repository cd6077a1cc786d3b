"""A rig description as a form has it: guessed, filled in, read back."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import yaml

from service.pages.upload.error_words import field_words
from service.pages.upload.file_summary import ChannelSummary
from service.pages.upload.mapping import document_of, sensors_text, time_shown
from tests.support.repository import ROOT
from underskin.recordings import rig_description
from underskin.recordings.rig_guess import guessed

RIGS = sorted((ROOT / "examples" / "formats" / "rigs").glob("*.yaml"))


def channel(name: str, unit: str, *, is_complex: bool = False) -> ChannelSummary:
    return ChannelSummary(name, unit, 10, 0.0, 1.0, is_complex)


def form_of(document: dict[str, Any]) -> dict[str, str]:
    """What a browser sends back of a form that nobody changed, for a file that labels units as the rig says."""
    form = {"kind": document.get("kind", "frf"), "sensors": sensors_text(document)}
    form |= {name: f"{value:g}" for name, value in document["skin"].items() if isinstance(value, float | int)}
    for name, value in document.get("recording", {}).items():
        if isinstance(value, dict):
            form[f"{name}-from"] = value.get("property") or f"column:{value['channel']}"
        else:
            form[name] = str(value)
    for number, (field, how) in enumerate(document["channels"].items()):
        label = how.get("labelled", "")
        told = {"channel": how["channel"], "is": field, "unit": how.get("unit", ""), "label": label}
        told |= {name: str(how.get(name, "")) for name in ("sign", "sensitivity", "sensitivity_unit")}
        form |= {f"{name}-{number}": text for name, text in told.items()}
    return form | ({"units_checked": "yes"} if document.get("units_checked") else {})


@pytest.mark.parametrize("file", RIGS, ids=lambda file: str(file.stem))
def test_a_form_that_nobody_changed_says_the_same(file: Path) -> None:
    document = yaml.safe_load(file.read_text())
    found, wrong = document_of(form_of(document), document)
    rig_description.from_dict(found)
    assert wrong == []
    assert found == document | {"recording": document.get("recording", {})}


def test_columns_of_a_long_table() -> None:
    """A table with a row a line is guessed whole, and a form that nobody changed says the same of its columns."""
    columns = [
        channel("Sphere diameter [mm]", "mm"),
        channel("Preload [N]", "N"),
        channel("Dynamic force [N]", "N"),
        channel("f [Hz]", "Hz"),
        channel("|H| [pC/N]", "pC/N"),
        channel("Phase [deg]", "deg"),
    ]
    found = guessed(columns, {}, {}, ["Sensor", "Time"])
    assert found["recording"] == {
        "sensor": {"channel": "Sensor"},
        "recorded_at": {"channel": "Time"},
        "indenter_radius_mm": {"channel": "radius"},
        "preload_n": {"channel": "Preload [N]"},
        "dynamic_force_n": {"channel": "Dynamic force [N]"},
    }
    assert found["derived"] == {"radius": "'Sphere diameter [mm]' / 2"}
    assert set(found["channels"]) == {"frequency_hz", "frf_magnitude_pc_per_n", "frf_phase_deg"}
    found["recording"]["preload_n"]["unit"] = "N"
    said, wrong = document_of(form_of(found), found)
    assert (said["recording"], wrong) == (found["recording"], [])
    rig_description.from_dict(said)


def test_channels_and_what_a_file_states_are_guessed_by_unit_and_name() -> None:
    channels = [channel("Kraftmessdose", "mN"), channel("Charge amplifier", "V"), channel("temperature", "V")]
    found = guessed(channels, {"preload [mN]": 500.0, "sensor": "s01", "operator": "me"}, {"thickness_mm": 2.5})
    assert found["kind"] == "frf"
    assert found["channels"] == {
        "force_n": {"channel": "Kraftmessdose"},
        "charge_pc": {"channel": "Charge amplifier"},
    }
    assert found["recording"] == {"preload_n": {"property": "preload [mN]"}, "sensor": {"property": "sensor"}}
    assert found["skin"] == {"poisson_ratio": 0.5, "thickness_mm": 2.5}
    curve = guessed([channel("z", "um"), channel("F", "uN"), channel("t", "s")], {}, {})
    assert curve["kind"] == "indentation"
    assert set(curve["channels"]) == {"displacement_mm", "force_n", "time_s"}


def test_a_time_is_typed_in_the_labs_zone_and_shown_as_it_was_typed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("UNDERSKIN_TIME_ZONE", "Europe/Rome")
    for typed in ("2026-05-03 14:30", "3.5.2026 14:30", "2026-05-03T12:30Z"):
        found, wrong = document_of({"recorded_at": typed}, {})
        assert wrong == []
        assert time_shown(found["recording"]["recorded_at"]) == "2026-05-03 14:30"
        moment = datetime.fromisoformat(found["recording"]["recorded_at"])
        assert moment == datetime(2026, 5, 3, 12, 30, tzinfo=UTC)
    found, (wrong_time,) = document_of({"recorded_at": "May"}, {})
    assert (wrong_time.field, time_shown(found["recording"]["recorded_at"])) == (
        "recording.recorded_at",
        "May",
    )
    (ambiguous,) = document_of({"recorded_at": "3/5/2026"}, {})[1]
    assert "two days, 3 May 2026 or 5 March 2026: write it as 2026-05-03 or 2026-03-05" in ambiguous.allowed


def test_a_file_that_states_its_time_is_taken_at_its_word() -> None:
    channels = [channel("force", "N"), channel("charge", "pC")]
    for name, value in (("Date/Time", "03.05.2026 14:30"), ("recorded_at", "2026-05-03T14:30")):
        assert guessed(channels, {name: value}, {})["recording"] == {"recorded_at": {"property": name}}
    assert guessed(channels, {"Date": "2026-05-03"}, {}, dated=True)["recording"] == {}
    assert guessed(channels, {"Date": "Monday", "recorded_at": "noon"}, {})["recording"] == {}


@pytest.mark.parametrize("line", ["s1, 0.5, 8", "s1; 0,5; 8", "s1\t0,5\t8", "s1 0.5 8", "s1   0,5 8"])
def test_a_layout_is_written_as_people_write_it(line: str) -> None:
    found, wrong = document_of({"sensors": line}, {})
    assert wrong == []
    assert found["skin"]["sensors"] == [{"id": "s1", "x_mm": 0.5, "y_mm": 8.0}]


SPRUNG = {
    "displacement_mm": {"channel": "z", "sign": -1, "deflection": {"channel": "d", "unit": "nm"}},
    "force_n": {"channel": "d", "unit": "nm", "spring_constant_n_per_m": 3.0},
}


def test_a_deflection_in_the_form_makes_force_and_depth() -> None:
    form = {"kind": "indentation", "channel-0": "z", "is-0": "displacement_mm", "sign-0": "-1"}
    form |= {"channel-1": "d", "is-1": "deflection", "unit-1": "nm", "spring_constant_n_per_m": "3"}
    assert document_of({**form, "travel": "yes"}, {})[0]["channels"] == SPRUNG
    as_depth = document_of({**form, "travel": ""}, {})[0]["channels"]
    assert as_depth == {"displacement_mm": {"channel": "z", "sign": -1}, "force_n": SPRUNG["force_n"]}
    measured = {"channel-1": "F", "is-1": "force_n", "unit-1": "mN", "travel": "yes"}
    stiff = document_of({**form, **measured}, {})[0]["channels"]["displacement_mm"]
    assert stiff == {"channel": "z", "sign": -1, "stiffness_n_per_mm": 0.003}
    _, (wrong,) = document_of({**form, **measured, "spring_constant_n_per_m": ""}, {})
    assert "say which channel is the deflection" in wrong.allowed
    assert field_words("spring_constant_n_per_m") == "spring constant [N/m]"
