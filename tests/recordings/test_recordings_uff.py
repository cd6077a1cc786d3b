"""Universal files: time series, a spectrum, and several FRFs with their coherences."""

import numpy as np
import pytest

from tests.recordings.contents_of_files import contents, the_time_series
from tests.support.instrument_files import COMMON, SKIN, frf_datasets, rig, time_datasets, uff
from underskin.errors import FileError
from underskin.recordings import read_contents, read_file
from underskin.recordings.campaign import to_dict

pytestmark = pytest.mark.usefixtures("understood_here")

# pyuff's writer of binary datasets leaves its file to the garbage collector.
leaky_writer = pytest.mark.filterwarnings(
    "ignore:unclosed file:ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
)


@leaky_writer
def test_uff58_as_text_and_as_binary() -> None:
    for binary in (0, 1):
        assert the_time_series(uff(binary, time_datasets()), "run.uff", rig()) == []


@leaky_writer
def test_a_spectrum_in_uff58_is_an_frf() -> None:
    frf = np.array([0.0, 7.0 - 0.5j, 7.1 - 0.6j])
    dataset = {
        "func_type": 4, "abscissa_spec_data_type": 18, "ord_data_type": 6, "abscissa_inc": 10.0, "num_pts": 3,
        "x": np.array([0.0, 10.0, 20.0]),
        "id1": "H1", "data": frf, "ordinate_axis_units_lab": "nC", "orddenom_axis_units_lab": "N",
        "abscissa_axis_units_lab": "Hz",
    }  # fmt: skip
    channels = {"frequency_hz": {"channel": "frequency"}, "frf_pc_per_n": {"channel": "H1"}}
    reading = read_file(uff(0, [dataset]), "run.uff", rig(channels=channels))
    (recording,) = to_dict(reading.campaign)["recordings"]
    assert recording["frequency_hz"] == [10.0, 20.0]
    assert recording["frf_re_pc_per_n"] == pytest.approx([7000.0, 7100.0])
    assert recording["frf_im_pc_per_n"] == pytest.approx([-500.0, -600.0])
    assert reading.warnings == ["the line at 0 Hz is left out"]


SEVERAL = {"frequency_hz": {"channel": "frequency"}, "frf_pc_per_n": {"channel": "FRF"}}


@leaky_writer
def test_of_several_frfs_in_uff58_each_is_a_recording() -> None:
    recording = {**COMMON, "sensor": {"property": "block"}}
    places = {"s1": 0.0, "s2": 8.0, "s3": 16.0}
    skin = {**SKIN, "sensors": [{"id": name, "x_mm": x, "y_mm": 0.0} for name, x in places.items()]}
    channels = {**SEVERAL, "coherence": {"channel": "coherence"}}
    data = uff(1, frf_datasets(["s1", "s2", "s3"]))
    reading = read_file(data, "run.uff", rig(skin=skin, recording=recording, channels=channels))
    assert not reading.problems
    found = to_dict(reading.campaign)["recordings"]
    assert [(one["id"], one["sensor"]) for one in found] == [(f"run {name}", name) for name in ("s1", "s2", "s3")]
    for number, one in enumerate(found, start=1):
        assert one["frf_re_pc_per_n"] == pytest.approx(number * np.array([7.0, 7.1, 7.2]))
        assert one["coherence"] == pytest.approx([1 - 0.01 * number] * 3)
    assert reading.warnings == ["holds 3 FRFs, each a part of its own: s1, s2, s3"]


@leaky_writer
def test_frfs_of_one_name_or_of_other_units_are_told_apart() -> None:
    responses = {"H1": "1", "H1 (dataset 2)": "2"}
    found = contents(uff(0, frf_datasets(["H1", "H1"])), "run.uff")
    assert {block.name: found.properties[f"{block.name}.response"] for block in found.blocks} == responses
    charge, *_ = frf_datasets(["charge"])
    stage, *_ = frf_datasets(["stage"], unit="m/s2")
    mixed = uff(0, [charge, stage])
    assert [block.channels[1].name for block in contents(mixed, "run.uff").blocks] == ["FRF pC/N", "FRF m/s2/N"]
    channels = {**SEVERAL, "frf_pc_per_n": {"channel": "FRF pC/N"}}
    reading = read_file(mixed, "run.uff", rig(channels=channels))
    assert [one.id for one in reading.campaign.recordings] == ["run"]
    assert "1 parts without the rig's channels are left out" in reading.warnings


def test_a_universal_file_that_is_cut_off_is_said() -> None:
    whole = uff(0, time_datasets())
    assert "no end" in contents(whole[:-30], "run.uff").warnings[0]
    lines = whole.decode().splitlines()
    lines[-2] = lines[-2][:60]
    with pytest.raises(FileError, match="dataset 2: holds 3 of the 4 points"):
        read_contents("\n".join([*lines, ""]).encode(), "run.uff")


@leaky_writer
@pytest.mark.parametrize("turned", [False, True])
def test_frfs_of_one_degree_of_freedom_on_two_axes_have_each_its_coherence(turned: bool) -> None:
    frf, coherence = ({**one, "abscissa_spacing": 0, "abscissa_inc": 0.0} for one in frf_datasets(["sweep"]))
    zoomed = {"x": np.array([20.0, 21.0, 23.0])}
    zoom_frf = {**frf, **zoomed, "id1": "zoom"}
    zoom_coherence = {**coherence, **zoomed, "data": np.array([0.9, 0.8, 0.7])}
    coherences = [zoom_coherence, coherence] if turned else [coherence, zoom_coherence]
    blocks = {block.name: block for block in contents(uff(0, [frf, zoom_frf, *coherences]), "run.uff").blocks}
    assert set(blocks) == {"sweep", "zoom"}
    assert blocks["sweep"].channels[2].values == pytest.approx([0.99] * 3)
    assert blocks["zoom"].channels[2].values == pytest.approx([0.9, 0.8, 0.7])
