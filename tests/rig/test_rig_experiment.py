"""What an experiment's description may hold, and what is said of one that cannot be used."""

import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from rig.commands import rig as command
from rig.description import parse
from rig.effects import ALL_EFFECTS
from rig.errors import RigError
from rig.experiment import CurveDesign, DeclaredSkin, Drive, LineGrid, Noise, RecordingDesign
from rig.reading import document
from rig.recorded import record_lines
from tests.support.repository import ROOT
from tests.support.rig_experiments import PARAMETERS, described

DOCUMENTATION = ROOT / "docs" / "rig.md"


def refused(*changes: Any) -> str:
    """What is said of the experiment with these changes."""
    document = described()
    for change in changes:
        document = change(document)
    with pytest.raises(RigError) as error:
        record_lines(parse(document))
    return str(error.value)


def put(path: str, value: Any) -> Any:
    """A change of a description that sets one field."""

    def change(document: dict[str, Any]) -> dict[str, Any]:
        *parts, last = path.split(".")
        place = document
        for part in parts:
            place = place.setdefault(part, {})
        place[last] = value
        return document

    return change


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("schema", "rig/1", "schema = 'rig/1': must be one of experiment/1"),
        ("colour", "red", "experiment.colour = 'red': unknown; known: schema, name"),
        ("kind", "shear", "kind = 'shear': must be one of frf, indentation, compression"),
        ("seed", -1, "seed = -1: must be a whole number, 0 to"),
        ("skin.thickness_mm", 0, "skin.thickness_mm = 0: must be 0.001 to 100 mm"),
        ("skin.thickness_mm", float("nan"), "skin.thickness_mm = nan: must be 0.001 to 100 mm"),
        ("skin.d33_pc_per_n", 1.4e-11, "1.4e-11: must be at least 0.05 pC/N in size; 1.4e-11 C/N would be 14 pC/N"),
        ("skin.d33_pc_per_n", 0, "skin.d33_pc_per_n = 0.0: must be at least 0.05 pC/N in size"),
        ("skin.d33_pc_per_n", 9000, "skin.d33_pc_per_n = 9000: must be -5000 to 5000 pC/N"),
        ("skin.array", {"columns": 2, "pitch_mm": 2.9}, "'s01 and s02, 2.9 mm apart': must be at least 3 mm apart"),
        ("skin.d33_pc_per_n", None, "skin.d33_pc_per_n = None: required"),
        ("skin.array", {"columns": 2.5}, "skin.array.columns = 2.5: must be a whole number, 1 to 64"),
        ("design.preloads_n", [1.0, "two"], "design.preloads_n[1] = 'two': must be a number"),
        ("design.preloads_n", [0.0], "design.preloads_n[0] = 0.0: must be 1e-06 to 10000 N"),
        ("design.dynamic_forces_n", [0.1, 0.5], "dynamic_forces_n[1] = 0.5: must be below the lowest preload, 0.5 N"),
        ("design.offsets_mm", [[0, 18.6]], "offsets_mm[0] = [0.0, 18.6]: must be 0 to 18.5 mm from the sensor's"),
        ("design.offsets_mm", [[0, -9]], "sphere of s01 at y = -9 mm: must be -8 to 12 mm, on the skin (skin.width"),
        ("design.sensors", ["s09"], "design.sensors[0] = 's09': must be one of s01, s02, s03, s04"),
        ("design.offsets_mm", [[1.0]], "design.offsets_mm[0] = [1.0]: must be two numbers, x and y"),
        ("design.repeats", 999, "design = '31968 recordings': must make at most 5000"),
        ("design.start", "monday", "design.start = 'monday': must be a date and time like"),
        ("lines.high_hz", 0.5, "lines.high_hz = 0.5: must be above low_hz, 1 Hz"),
        ("drive", {}, "give either lines (FRF) or drive (time series)"),
        ("noise.coherence", "yes", "noise.coherence = 'yes': must be true or false"),
        ("effects", {"gremlins": {}}, "effects.gremlins = {}: unknown; known: moving_contact_edge"),
        ("effects", {"ageing": {"rate": 0.1}}, "effects.ageing.cycles = None: required, 1 to 1e+09"),
        ("effects", {"ageing": {"rate": 2, "cycles": 5}}, "effects.ageing.rate = 2: must be 0 to 1"),
        ("effects", {"ageing": {"rate": 1, "cycles": 1}}, "effects.ageing.rate = 1.0: must be below 0.3"),
        ("effects", {"sensor_relaxation": {"law": "step"}}, "sensor_relaxation.step = None: required by the law step"),
        ("effects", {"platen_friction": {"friction": 1}}, "acts on recordings of kind compression"),
        ("curves", {}, "curves = {}: not for recordings of kind frf"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_named(path: str, value: Any, message: str) -> None:
    assert message in refused(put(path, value))


@pytest.mark.parametrize(
    ("missing", "effect", "message"),
    [
        ("cycles_per_recording", "ageing", "design.cycles_per_recording = None: required by the effect ageing"),
        ("start", "temperature_drift", "design.start = None: required by the effect temperature_drift"),
        ("dwells_s", "contact_creep", "design.dwells_s = None: required by the effect contact_creep"),
    ],
)
def test_an_effect_names_what_it_needs_of_the_experiment(missing: str, effect: str, message: str) -> None:
    assert message in refused(put(f"design.{missing}", None), put("effects", {effect: PARAMETERS[effect]}))


def test_the_command_says_what_is_wrong_on_one_line(tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    for text, message in (
        ("schema: experiment/1\nname: x\nkind: [", "bad.yaml"),
        ("name: x", "schema = None"),
        ("{", ""),
    ):
        file.write_text(text)
        answer = CliRunner().invoke(command, ["run", str(file), "--output-dir", str(tmp_path / "out")])
        assert answer.exit_code == 2
        (line,) = answer.stderr.splitlines()
        assert line.startswith("underskin rig: ")
        assert message in line
        assert not (tmp_path / "out").exists()
    answer = CliRunner().invoke(command, ["draw", "--output-dir", str(tmp_path), "--what", "magic"])
    assert answer.exit_code == 2


def test_everything_is_documented() -> None:
    text = DOCUMENTATION.read_text(encoding="utf-8")
    for name, effect in ALL_EFFECTS.items():
        (row,) = [line for line in text.splitlines() if line.startswith(f"| `{name}` |")]
        assert effect.law in row
        assert all(f"`{word}`" in row for word in (*effect.parameters, *effect.laws))
        assert ", ".join(effect.kinds) in row
    for part in (DeclaredSkin, RecordingDesign, LineGrid, Drive, Noise, CurveDesign):
        for entry in fields(part):
            assert re.search(rf"\b{entry.name}\b", text), f"{part.__name__}.{entry.name}"


def test_the_documented_description_is_accepted(tmp_path: Path) -> None:
    documents = []
    for number, block in enumerate(re.findall(r"```yaml\n(.*?)```", DOCUMENTATION.read_text("utf-8"), re.DOTALL)):
        file = tmp_path / f"{number}.yaml"
        file.write_text(block, encoding="utf-8")
        documents.append(document(file))
    whole, drive, curves = documents
    assert parse(whole).name == "prototype, a heavy tip"
    parse({name: value for name, value in {**whole, **drive}.items() if name != "lines"})
    parse({"schema": whole["schema"], "name": "x", "kind": "indentation", "skin": whole["skin"], **curves})
    assert set(whole) >= {"skin", "design", "lines", "noise", "effects"}
    assert set(drive["drive"]) == {entry.name for entry in fields(Drive)}
    assert set(curves["curves"]) == {entry.name for entry in fields(CurveDesign)}
    assert set(whole["design"]) == {entry.name for entry in fields(RecordingDesign)}
    assert set(whole["noise"]) == {entry.name for entry in fields(Noise)}
