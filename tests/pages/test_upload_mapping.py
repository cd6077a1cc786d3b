"""A rig description as a form has it: guessed, filled in, read back."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from service.pages.upload_mapping import CHANNELS, KINDS, document_of, guessed, sensors_text
from service.pages.upload_seen import ChannelSeen
from underskin import InvalidInput
from underskin.recordings import rig_description

RIGS = sorted((Path(__file__).parents[2] / "examples" / "formats" / "rigs").glob("*.yaml"))


def channel(name: str, unit: str) -> ChannelSeen:
    return ChannelSeen(name, unit, 10, 0.0, 1.0)


def form_of(document: dict[str, Any]) -> dict[str, str]:
    """What a browser sends back of a form that nobody changed, for a file that labels units as the rig says."""
    form = {"kind": document.get("kind", "frf"), "sensors": sensors_text(document)}
    form |= {name: f"{value:g}" for name, value in document["skin"].items() if isinstance(value, float | int)}
    for name, value in document.get("recording", {}).items():
        form |= {f"{name}-from": value["property"]} if isinstance(value, dict) else {name: str(value)}
    for number, (field, how) in enumerate(document["channels"].items()):
        label = how.get("labelled", "")
        told = {"channel": how["channel"], "is": field, "unit": how.get("unit", ""), "label": label}
        told |= {name: str(how.get(name, "")) for name in ("sign", "sensitivity", "sensitivity_unit")}
        form |= {f"{name}-{number}": text for name, text in told.items()}
    return form | ({"units_checked": "yes"} if document.get("units_checked") else {})


@pytest.mark.parametrize("file", RIGS, ids=lambda file: str(file.stem))
def test_a_form_that_nobody_changed_says_the_same(file: Path) -> None:
    document = yaml.safe_load(file.read_text())
    found = document_of(form_of(document), document)
    rig_description.from_dict(found)
    assert found == document | {"recording": document.get("recording", {})}


def test_every_channel_of_every_kind_can_be_chosen() -> None:
    assert {name for kind in KINDS for name in rig_description.channel_fields(kind)} == set(CHANNELS)


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


def test_a_unit_other_than_the_label_says_that_the_label_is_wrong() -> None:
    form = {"kind": "frf", "channel-0": "F", "is-0": "force_n", "label-0": "g", "unit-0": "N"}
    assert document_of(form, {})["channels"]["force_n"] == {"channel": "F", "labelled": "g", "unit": "N"}
    same = {**form, "label-0": "N"}
    assert document_of(same, {})["channels"]["force_n"] == {"channel": "F"}


def test_what_cannot_be_said_is_refused_by_name() -> None:
    with pytest.raises(InvalidInput, match=r"skin\.sensors.*line 2"):
        document_of({"sensors": "s1, 0, 0\ns2, 8"}, {})
    twice = {"channel-0": "a", "is-0": "force_n", "channel-1": "b", "is-1": "force_n"}
    with pytest.raises(InvalidInput, match="only one channel"):
        document_of(twice, {})
