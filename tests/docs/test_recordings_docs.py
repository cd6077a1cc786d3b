"""docs/formats.md is true: its examples are read, and it names every format, module and field of a rig description."""

import re
from dataclasses import fields

import pytest

from tests.support.repository import ROOT
from underskin.recordings import read_contents, read_file, rig_description
from underskin.recordings.campaign import CompressionRecording, FrfRecording, IndentationRecording
from underskin.recordings.channels import Contents
from underskin.recordings.readers.formats import MODULES
from underskin.recordings.rig_description import ChannelMapping, CurveChannel, Property, Trim

TEXT = (ROOT / "docs" / "formats.md").read_text()


def examples(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


def test_the_template_as_documented() -> None:
    plain, foreign = (read_file(text.encode(), "doc.csv") for text in examples("csv"))
    assert not plain.problems + foreign.problems
    first, second = plain.campaign.recordings
    assert isinstance(first, FrfRecording)
    assert isinstance(second, FrfRecording)
    assert first.frf_re_pc_per_n == pytest.approx([7.1, 7.2])
    assert second.frf_im_pc_per_n == pytest.approx([-0.4, -0.6])
    (block,) = foreign.campaign.recordings
    assert isinstance(block, CompressionRecording)
    assert (block.sample_height_mm, block.sample_diameter_mm) == (10.0, 20.0)
    assert block.displacement_mm == pytest.approx([0.0, 0.1])
    assert block.force_n == pytest.approx([0.0, 50.0])


def test_the_rig_description_as_documented() -> None:
    text, *_ = examples("yaml")
    rig = rig_description.parse(text.encode(), "rig.yaml")
    table = "Preload [mN];1500\n\nt [ms];Load cell;Amplifier\n0;2.25;0\n1;4.5;-0.07\n"
    channels = {**rig.document["channels"], "time_s": {"channel": "t [ms]"}}
    reading = read_file(table.encode(), "a.csv", rig_description.from_dict({**rig.document, "channels": channels}))
    assert not reading.problems
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, FrfRecording)
    assert recording.preload_n == pytest.approx(1.5)
    assert recording.sample_rate_hz == pytest.approx(1000)
    assert recording.force_n == pytest.approx([1, 2])
    assert recording.charge_pc == pytest.approx([0, 7])


def test_the_spring_as_documented() -> None:
    _, text, _ = examples("yaml")
    rig = rig_description.parse(text.encode(), "rig.yaml")
    table = "Piezo;Deflection\nnm;nm\n0;0\n-1;100\n-2;300\n"
    reading = read_file(table.encode(), "a.csv", rig)
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, IndentationRecording)
    assert recording.displacement_mm == pytest.approx([0, 0.9e-3, 1.7e-3])  # 1 um less 0.1 um
    assert recording.force_n == pytest.approx([0, 0.3e-6, 0.9e-6])  # 100 nm times 3 N/m
    assert len(reading.warnings) == 1


def test_derived_channels_as_documented() -> None:
    *_, text = examples("yaml")
    rig = rig_description.parse(text.encode(), "rig.yaml")
    rows = "".join(f"{-sample};{max(0, sample - 1000) / 10}\n" for sample in range(2000))
    reading = read_file(f"Height;Deflection\nnm;nm\n{rows}".encode(), "a.csv", rig)
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, IndentationRecording)
    assert len(recording.force_n) == 1961
    assert recording.displacement_mm[[0, -1]] == pytest.approx([19e-6, (1979 - 97.9) * 1e-6])
    assert recording.force_n[[0, -1]] == pytest.approx([0, 97.9e-9 * 3])
    assert recording.stage_stiffness_n_per_mm == 0.003
    assert len(reading.warnings) == 4


def test_a_text_of_an_instrument_as_documented() -> None:
    (text,) = examples("text")
    found = read_contents(text.encode("latin-1"), "a.txt")
    assert isinstance(found, Contents)
    assert [(one.name, one.unit, one.values.tolist()) for one in found.blocks[0].channels] == [
        ("Depth", "µm", [0, 0.25, 0.5]),
        ("Force", "mN", [0, 0.031, 0.088]),
    ]
    assert found.properties == {"Operator": "mb"}
    assert found.layout in " ".join(TEXT.split())


def test_every_format_and_field_is_documented() -> None:
    for name in (
        *MODULES.values(),
        *(entry.name for model in (ChannelMapping, Property, CurveChannel, Trim) for entry in fields(model)),
    ):
        assert name in TEXT, name
