"""Arrays under names: MATLAB structures, plain HDF5 and NumPy files have the channels that they hold."""

import struct
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.recordings.contents_of_files import contents, the_time_series
from tests.support.instrument_files import CHARGE, FORCE, matlab_5, matlab_73, numpy_file, plain_hdf5, rig, wav
from underskin.errors import FileError
from underskin.recordings import read_file, rig_description
from underskin.recordings.campaign import FrfRecording

pytestmark = pytest.mark.slow

NAMES = ("force", "charge", "t1", "Kanal", "x")
NUMBER = st.floats(-1e6, 1e6).map(lambda number: round(number, 3))
ARRAYS = st.lists(NUMBER, min_size=2, max_size=5).map(np.array)
MATRICES = st.lists(st.lists(NUMBER, min_size=3, max_size=3), min_size=2, max_size=4).map(np.array)
COMPLEX = st.lists(st.builds(complex, NUMBER, NUMBER), min_size=2, max_size=5).map(np.array)
STRUCTURES = st.recursive(
    st.dictionaries(st.sampled_from(NAMES), ARRAYS | MATRICES | COMPLEX | NUMBER, min_size=1, max_size=4),
    lambda inner: st.dictionaries(st.sampled_from(["run", "sensor", "rig"]), inner, min_size=1, max_size=3),
    max_leaves=6,
)


def expected(held: Mapping[str, Any], path: str = "") -> dict[tuple[str, str], Any]:
    """Each vector, and each column of a matrix, by its block and name; each number by its path."""
    found: dict[tuple[str, str], Any] = {}
    for name, value in held.items():
        here = f"{path}.{name}" if path else name
        if isinstance(value, Mapping):
            found |= expected(value, here)
        elif isinstance(value, float):
            found["property", here] = value
        elif value.ndim == 1:
            found[path, name] = value.tolist()
        else:
            found |= {(path, f"{name}(:,{column})"): part.tolist() for column, part in enumerate(value.T, start=1)}
    return found


def held_by(data: bytes, name: str) -> dict[tuple[str, str], Any]:
    found = contents(data, name)
    channels = {
        (block.name, channel.name): channel.values.tolist() for block in found.blocks for channel in block.channels
    }
    return {**channels, **{("property", key): value for key, value in found.properties.items()}}


@settings(max_examples=8)
@given(STRUCTURES, st.sampled_from([(matlab_5, "run.mat"), (plain_hdf5, "run.h5")]))
def test_structures_in_structures(held: dict[str, Any], written: tuple[Callable[[Any], bytes], str]) -> None:
    """Every number is read, under its path."""
    write, name = written
    wanted = expected(held)
    if not any(path != "property" for path, _ in wanted):
        held = {**held, "more": FORCE}
        wanted["", "more"] = FORCE.tolist()
    assert held_by(write(held), name) == wanted


def test_arrays_of_numpy() -> None:
    arrays = {"force": FORCE, "both": np.stack([FORCE, CHARGE], axis=1), "fs": 1000.0, "who": "mb"}
    assert held_by(numpy_file(arrays), "run.npz") == {
        ("", "force"): FORCE.tolist(),
        ("", "both(:,1)"): FORCE.tolist(),
        ("", "both(:,2)"): CHARGE.tolist(),
        ("property", "fs"): 1000.0,
        ("property", "who"): "mb",
    }
    records = np.array(list(zip(FORCE, CHARGE, strict=True)), [("force", "f8"), ("charge", "f4")])
    assert held_by(numpy_file(records), "run.npy") == {
        ("", "force"): FORCE.tolist(),
        ("", "charge"): CHARGE.astype("f4").tolist(),
    }


def test_python_objects_are_refused() -> None:
    with pytest.raises(FileError, match=r"run\.npz: cell\.npy: holds Python objects, which are not read"):
        contents(numpy_file({"force": FORCE, "cell": np.array([{}, 1], object)}), "run.npz")


def test_plain_hdf5_has_units_and_words() -> None:
    """Datasets with an attribute of their unit, and a dataset of texts that tells recordings apart."""
    held = {
        "bench": {
            "force": np.tile(FORCE, 2) * 1000,
            "amplifier": np.tile(CHARGE, 2) * 1e-3,
            "sensor": np.array(["s01"] * 4 + ["s02"] * 4, object),
            "rate": 1000.0,
            "preload": 1.0,
        }
    }
    skin = rig().skin
    sensors = [{"id": name, "x_mm": number, "y_mm": 0} for number, name in enumerate(("s01", "s02"))]
    described = rig_description.from_dict(
        {
            "schema": "rig/1",
            "skin": {**skin, "sensors": sensors},
            "recording": {
                "sensor": {"channel": "sensor"},
                "indenter_radius_mm": 4,
                "preload_n": {"property": "preload"},
                "sample_rate_hz": {"property": "rate"},
                "dynamic_force_n": 0.1,
            },
            "channels": {"force_n": {"channel": "force"}, "charge_pc": {"channel": "amplifier"}},
        }
    )
    the_time_series(plain_hdf5(held, {"force": "mN", "amplifier": "nC"}), "run.h5", described)


def test_hdf5_without_numbers_is_refused() -> None:
    with pytest.raises(FileError, match="holds no numbers of one or two axes; a campaign has the attribute schema"):
        contents(plain_hdf5({"run": {"who": "mb", "cube": np.zeros((2, 2, 2))}}), "run.h5")


def signal(values: Any, unit: str, name: str, step: float, axis: str) -> dict[str, Any]:
    """As Siemens Testlab exports a signal to MATLAB."""
    abscissa = {"start_value": 0.0, "increment": step, "number_of_values": float(len(values))}
    return {
        "x_values": {**abscissa, "quantity": {"label": axis}},
        "y_values": {"values": values, "quantity": {"label": unit}},
        "function_record": {"name": name},
    }


def test_signals_of_testlab() -> None:
    """Signals on one time base are channels of one block, spectra have their frequencies."""
    data = matlab_5(
        {
            "Signal_0": signal(FORCE * 1000, "mN", "Force", 1e-3, "s"),
            "Signal_1": signal(CHARGE, "pC", "Charge", 1e-3, "s"),
            "Signal_2": signal(np.array([7 - 1j, 7.1 - 2j]), "pC/N", "H", 2.5, "Hz"),
        }
    )
    mapped = {"force_n": {"channel": "Force"}, "charge_pc": {"channel": "Charge"}}
    assert the_time_series(data, "run.mat", rig(channels=mapped)) == ["1 parts without the rig's channels are left out"]
    spectrum = contents(data, "run.mat").blocks[1]
    assert [(channel.name, channel.unit) for channel in spectrum.channels] == [("frequency", "Hz"), ("H", "pC/N")]
    assert spectrum.channels[0].values.tolist() == [0.0, 2.5]
    assert spectrum.channels[1].values.tolist() == [7 - 1j, 7.1 - 2j]


def timetable(name: str) -> bytes:
    """A variable of a class of MATLAB in version 5: an opaque array, which holds numbers in a form of its own."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)

    texts = b"".join(element(1, part) for part in (name.encode(), b"MCOS", b"timetable"))
    numbers = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 1, 1)) + element(1, b"")
    opaque = element(6, struct.pack("<II", 17, 0)) + texts + element(14, numbers + element(6, struct.pack("<I", 7)))
    return element(14, opaque)


def with_class(variables: dict[str, Any], of_class: str) -> bytes:
    """Version 7.3 with a variable `data` of a class of MATLAB."""
    import io

    import h5py

    written = matlab_73({**variables, "data": np.arange(6.0)})
    buffer = io.BytesIO(written)
    with h5py.File(buffer, "r+") as target:
        target["data"].attrs["MATLAB_class"] = np.bytes_(of_class)
        target["data"].attrs["MATLAB_object_decode"] = 3
    return written[:512] + buffer.getvalue()[512:]


@pytest.mark.parametrize(
    ("data", "export"),
    [
        (matlab_5({})[:128] + timetable("data"), r"timetable, .* writetimetable\(data, 'data\.csv'\)"),
        (with_class({}, "timetable"), r"timetable, .* writetimetable\(data, 'data\.csv'\)"),
        (with_class({}, "table"), r"table, .* writetable\(data, 'data\.csv'\)"),
        (with_class({}, "datetime"), r"datetime, .* save its numbers as vectors or structures"),
    ],
)
def test_objects_of_matlab_are_refused_with_what_exports_them(data: bytes, export: str) -> None:
    with pytest.raises(FileError, match=rf"run\.mat: 'data' is a MATLAB {export}"):
        contents(data, "run.mat")


@pytest.mark.parametrize("kind", [np.int16, np.int32, np.uint8, np.float32])
def test_sound_files(kind: Any) -> None:
    """A recorder's channels are parts of its full scale, which the rig description makes quantities."""
    samples = np.stack([FORCE / 4, CHARGE / 4], axis=1)
    data = wav(samples + (1 if kind is np.uint8 else 0), kind)
    described = rig(
        derived={"force": "4 [N] * 'channel 1' [1]", "charge": "4 [pC] * 'channel 2' [1]"},
        channels={"force_n": {"channel": "force"}, "charge_pc": {"channel": "charge"}},
    )
    (recording,) = read_file(data, "run.wav", described).campaign.recordings
    assert isinstance(recording, FrfRecording)
    assert recording.sample_rate_hz == 1000
    precision = {np.uint8: 4 / 100, np.int16: 1e-3}.get(kind, 1e-6)
    assert recording.force_n == pytest.approx(FORCE, abs=precision)
    assert recording.charge_pc == pytest.approx(CHARGE, abs=precision)


@pytest.mark.parametrize(
    ("data", "name", "how"),
    [
        (
            b"\\*Force file list\r\n\\Version: 0x1\x00",
            "curve.001",
            "NanoScope file: .* export the force curves as text",
        ),
        (b"[DataSet]\r\nVersion=2\r\n#!\x00\x01", "curve.nid", "Nanosurf file .* export the curves as text"),
        (b"\x05\x00\x12\x34" + bytes(range(64)), "curve.ibw", "Igor binary wave: .* export the waves as text"),
        (
            b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600),
            "table.xls",
            r"old Office document, .* save the table as \.xlsx",
        ),
    ],
)
def test_files_that_need_an_export_are_refused_with_it(data: bytes, name: str, how: str) -> None:
    with pytest.raises(FileError, match=how):
        contents(data, name)
