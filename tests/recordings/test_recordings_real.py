"""Real instruments' files, through the example rig descriptions. Found through UNDERSKIN_RECORDINGS."""

from pathlib import Path

import numpy as np
import pytest

from tests.recordings.real_files import example_rig, read, real
from tests.support.cases import first
from tests.support.instrument_files import rig
from underskin.errors import FileError
from underskin.recordings import read_contents, read_file, rig_description
from underskin.recordings.campaign import CompressionRecording, FrfRecording, IndentationRecording
from underskin.recordings.channels import Contents

pytestmark = pytest.mark.usefixtures("understood_here")


def of_each_folder(count: int, files: list[Path]) -> list[Path]:
    """The first few files of each folder; in `make soak` all."""
    folders = sorted({file.parent for file in files})
    return [file for folder in folders for file in first(count, (one for one in files if one.parent == folder))]


def test_sphere_in_well_comes_out_positive_in_compression() -> None:
    wells = real("sphere-in-well/run_*/well_*.csv")
    for file in of_each_folder(1, wells):
        (recording,) = read(file, "sphere-in-well").campaign.recordings
        assert isinstance(recording, IndentationRecording)
        assert recording.id == file.name.split("_")[1]
        assert recording.displacement_mm[-1] > recording.displacement_mm[0] > 0
        assert recording.force_n.max() == recording.force_n[-5:].max() > 2
    (well,) = real("sphere-in-well/run_732*/well_E5_*.csv")
    (recording,) = read(well, "sphere-in-well").campaign.recordings
    assert isinstance(recording, IndentationRecording)
    assert recording.force_n.max() == 10.003  # the run stops at 10 N


def test_a_rig_that_does_not_know_the_hidden_sign_is_refused() -> None:
    (file,) = real("sphere-in-well/run_732*/well_E5_*.csv")
    channels = {
        "displacement_mm": {"channel": "Z_Position(mm)", "sign": -1},
        "force_n": {"channel": "Corrected_Force(N)"},
    }
    known = {**example_rig("sphere-in-well").document, "channels": channels}
    with pytest.raises(FileError, match="force falls as the displacement grows"):
        read_file(file, file.name, rig_description.from_dict(known))


def test_silicone_compression() -> None:
    files = real("silicone-compression/*/*.csv")
    assert len(files) == 30
    for file in of_each_folder(1, files):
        (recording,) = read(file, "silicone-compression").campaign.recordings
        assert isinstance(recording, CompressionRecording)
        assert recording.displacement_mm.max() == pytest.approx(20, abs=0.01)  # mm, as the test was set up
        strain = recording.displacement_mm / recording.sample_height_mm
        stress = recording.force_n / (np.pi / 4 * recording.sample_diameter_mm**2)
        linear = (strain > 0.02) & (strain < 0.1)
        slope_kpa = 1e3 * np.polyfit(strain[linear], stress[linear], 1)[0]
        low, high = {"EF10": (61.0, 63.6), "EF30": (110.7, 116.5), "EF50": (175.1, 188.9)}[file.name[:4]]
        assert low - 0.05 < slope_kpa < high + 0.05  # as the data's source states them, rounded


@pytest.mark.slow
def test_the_nanoindenters_depth_is_the_piezo_less_the_cantilever() -> None:
    (file,) = real("afm-hold/fmt-chiaro*.txt")
    (recording,) = read(file, "fibre-top-indenter").campaign.recordings
    assert isinstance(recording, IndentationRecording)
    contents = read_contents(file, file.name)
    assert isinstance(contents, Contents)
    piezo, cantilever = (contents.blocks[0].channel(f"{name} (nm)") for name in ("Piezo", "Cantilever"))
    assert piezo is not None
    assert cantilever is not None
    assert recording.indenter_radius_mm == pytest.approx(0.0275)
    assert recording.displacement_mm == pytest.approx((piezo.values.real - cantilever.values.real) * 1e-6, abs=1e-7)
    assert recording.force_n.max() == pytest.approx(49e-9, rel=0.01)


def test_a_tip_radius_that_is_not_known_is_asked_for() -> None:
    (file,) = real("afm-hold/polymergel_creep.csv")
    reading = read_file(file, file.name, example_rig("afm-cantilever"))
    assert [(problem.field, problem.allowed) for problem in reading.problems] == [("indenter_radius_mm", "required")]
    given = {**example_rig("afm-cantilever").document, "recording": {"indenter_radius_mm": 0.005}}
    (recording,) = read_file(file, file.name, rig_description.from_dict(given)).campaign.recordings
    assert isinstance(recording, IndentationRecording)
    hold = (recording.force_n > 10e-9) & (recording.force_n < 11.5e-9)
    assert np.ptp(recording.displacement_mm[hold]) > 1e-4  # creeps by more than 0.1 um at constant force


def test_other_afm_files_are_refused_by_what_they_are() -> None:
    for file in first(1, real("afm-hold/*.jpk-force")):
        with pytest.raises(FileError, match=r"is a JPK force file: .* export the curves as text"):
            read_file(file, file.name, example_rig("afm-cantilever"))


def test_the_hammers_wrong_label_is_not_accepted_silently() -> None:
    (file,) = real("impact-hammer-lvm/*.lvm")
    reading = read(file, "impact-hammer")
    assert reading.warnings == ["channel 'F' is labelled 'g'; the rig description says 'N'"]
    first, second = reading.campaign.recordings
    assert isinstance(first, FrfRecording)
    assert isinstance(second, FrfRecording)
    assert first.force_n is not None
    assert second.force_n is not None
    assert len(first.force_n) == 8192
    assert np.argmax(first.force_n) == pytest.approx(85, abs=3)
    assert (first.force_n.max(), second.force_n.max()) == (pytest.approx(18.0, abs=0.1), pytest.approx(17.3, abs=0.1))
    assert first.sample_rate_hz == pytest.approx(1 / 0.000977)
    document = example_rig("impact-hammer").document
    for trusting, message in (
        (
            {"channel": "F"},
            "'g' is one of acceleration; force_n needs one of force.*for gram-force, which balances print.*, write gf",
        ),
        ({"channel": "F", "unit": "N"}, "add labelled: g"),
    ):
        channels = {**document["channels"], "force_n": trusting}
        with pytest.raises(FileError, match=message):
            read_file(file, file.name, rig_description.from_dict({**document, "channels": channels}))


@pytest.mark.slow
def test_the_same_sound_as_text_and_as_binary() -> None:
    (text,), (binary,) = real("uff-files/Sample_UFF58_ascii.uff"), real("uff-files/Sample_UFF58b_bin.uff")
    sounds = []
    for file in (text, binary):
        contents = read_contents(file, file.name)
        assert isinstance(contents, Contents)
        ((channel,),) = (block.channels for block in contents.blocks)
        assert (channel.name, channel.unit) == ("Mic 01.0Scalar", "Pa")
        assert contents.blocks[0].sample_rate_hz == pytest.approx(65536, rel=1e-5)
        sounds.append(channel.values)
    assert len(sounds[0]) == 79292
    assert sounds[0] == pytest.approx(sounds[1], rel=1e-5)


def test_other_universal_files() -> None:
    (four,), (spectrum,) = real("uff-files/MPSTD*.uff"), real("uff-files/sample_dataset58_psd.uff")
    contents = read_contents(four, four.name)
    assert isinstance(contents, Contents)
    assert [(channel.unit, len(channel.values)) for channel in contents.blocks[0].channels] == [("m/s2", 222400)] * 4
    contents = read_contents(spectrum, spectrum.name)
    assert isinstance(contents, Contents)
    frequency, density = contents.blocks[0].channels
    assert (frequency.unit, len(density.values)) == ("Hz", 3201)
    assert frequency.values == pytest.approx(np.arange(3201.0))
    with pytest.raises(
        FileError,
        match=r"no part holds all channels that .* names: it lacks force, amplifier; it has .*Pressure|Mic|Hz",
    ):
        read_file(spectrum, spectrum.name, rig())
