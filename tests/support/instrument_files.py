"""Small files without a fault, in every format, by the format's own writer where there is one."""

import io
import struct
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import h5py
import numpy as np
import pyuff
import scipy.io
import scipy.io.wavfile
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

from tests.support.campaign_documents import FRF, document
from tests.support.repository import ROOT
from underskin.recordings import rig_description
from underskin.recordings.readers import hdf5_file
from underskin.recordings.rig_description import RigDescription

EXAMPLES = ROOT / "examples" / "formats"
SKIN = document(FRF)["skin"]
COMMON = {"sensor": "s01", "indenter_radius_mm": 4, "preload_n": 1, "dynamic_force_n": 0.1}
FORCE = np.array([1.0, 1.1, 0.9, 1.0])
CHARGE = np.array([0.0, 0.7, -0.7, 0.1])


def rig(**changes: Any) -> RigDescription:
    """Two channels, force in mN and an amplifier's output of 10 mV/pC in V."""
    channels = {
        "force_n": {"channel": "force", "unit": "mN"},
        "charge_pc": {"channel": "amplifier", "unit": "V", "sensitivity": 10, "sensitivity_unit": "mV/pC", "sign": -1},
    }
    return rig_description.from_dict(
        {"schema": "rig/1", "skin": SKIN, "recording": COMMON, "channels": channels, **changes}
    )


def hdf5(campaign_document: dict[str, Any]) -> bytes:
    buffer = io.BytesIO()
    hdf5_file.write_document(campaign_document, campaign_document["recordings"], buffer)
    return buffer.getvalue()


def tdms(segments: int, **stamps: dict[str, Any]) -> bytes:
    """The file; `stamps` are properties more, of `root`, `group` and `channel`."""
    buffer = io.BytesIO()
    properties = {"wf_increment": 0.001, "wf_start_offset": 0.0, **stamps.get("channel", {})}
    for start in range(segments):
        part = slice(start * len(FORCE) // segments, (start + 1) * len(FORCE) // segments)
        with TdmsWriter(buffer) as writer:
            force = ChannelObject("run", "force", FORCE[part] * 1000, {**properties, "unit_string": "mN"})
            amplifier = ChannelObject("run", "amplifier", -CHARGE[part] * 0.01, properties)
            writer.write_segment(
                [
                    RootObject({"operator": "me", **stamps.get("root", {})}),
                    GroupObject("run", {"preload": 1.0, **stamps.get("group", {})}),
                    force,
                    amplifier,
                ]
            )
    return buffer.getvalue()


def lvm(separator: str = "\t", decimal: str = ".", repeats: int = 2) -> str:
    head = ["LabVIEW Measurement", "Writer_Version|2", "Separator|" + {"\t": "Tab", ",": "Comma"}[separator]]
    head += [f"Decimal_Separator|{decimal}", "X_Columns|No", "***End_of_Header***", ""]
    head += ["Channels|2", "Samples|4|4", "Y_Unit_Label|mN|V", "X_Dimension|Time|Time", "Delta_X|0.001|0.001"]
    head += ["***End_of_Header***", "X_Value|force|amplifier|Comment"]
    rows = [f"|{f * 1000:.4f}|{-q * 0.01:.6f}".replace(".", decimal) for f, q in zip(FORCE, CHARGE, strict=True)]
    rows[0] += "|begin"
    return "\n".join(line.replace("|", separator) for line in [*head, *rows * repeats]) + "\n"


UFF_HEAD = {
    "func_type": 1, "rsp_node": 1, "rsp_dir": 1, "ref_node": 1, "ref_dir": 1, "abscissa_spacing": 1,
    "ordinate_spec_data_type": 0, "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0,
}  # fmt: skip


def uff(binary: int, datasets: list[dict[str, Any]]) -> bytes:
    with tempfile.NamedTemporaryFile(suffix=".uff") as file:
        writer = pyuff.UFF(file.name)
        for dataset in datasets:
            writer.write_sets(pyuff.prepare_58(binary=binary, **{**UFF_HEAD, **dataset}), "add")
        return Path(file.name).read_bytes()


def time_datasets() -> list[dict[str, Any]]:
    common: dict[str, Any] = {"abscissa_spec_data_type": 17, "ord_data_type": 4, "abscissa_inc": 0.001, "num_pts": 4}
    common |= {"x": np.arange(4) / 1000}
    force = {"id1": "force", "data": FORCE * 1000, "ordinate_axis_units_lab": "mN"}
    return [{**common, **force}, {**common, "id1": "amplifier", "data": -CHARGE * 0.01, "ordinate_axis_units_lab": "V"}]


def frf_datasets(names: Sequence[str], unit: str = "pC") -> list[dict[str, Any]]:
    """FRFs on one axis, of the responses 1, 2, ...; after them the coherence of each."""
    common: dict[str, Any] = {"abscissa_spec_data_type": 18, "abscissa_inc": 10.0, "num_pts": 3}
    common |= {"x": np.array([10.0, 20.0, 30.0]), "abscissa_axis_units_lab": "Hz"}
    made = []
    for number, name in enumerate(names, start=1):
        frf = {"func_type": 4, "ord_data_type": 6, "rsp_node": number, "id1": name, "orddenom_axis_units_lab": "N"}
        made.append({**common, **frf, "ordinate_axis_units_lab": unit, "data": number * np.array([7 - 1j, 7.1, 7.2])})
    for number in range(1, len(names) + 1):
        coherence = {"func_type": 6, "ord_data_type": 4, "rsp_node": number, "id1": "coherence"}
        made.append({**common, **coherence, "data": 1 - 0.01 * number * np.ones(3)})
    return made


def matlab_variables() -> dict[str, Any]:
    return {"force": FORCE * 1000, "amplifier": -CHARGE * 0.01, "fs": 1000.0, "operator": "me"}


def matlab_73(variables: dict[str, Any]) -> bytes:
    """As MATLAB writes version 7.3: its own 512 bytes, then HDF5."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=512) as target:
        for name, value in variables.items():
            stored = np.array([[ord(letter)] for letter in value], np.uint16) if isinstance(value, str) else value
            target[name] = np.atleast_2d(stored).reshape(1, -1)
            target[name].attrs["MATLAB_class"] = np.bytes_("char" if isinstance(value, str) else "double")
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + struct.pack("<H2s", 0x0200, b"IM")
    return head.ljust(512, b"\0") + buffer.getvalue()[512:]


def matlab_5(variables: dict[str, Any], compressed: bool = True) -> bytes:
    buffer = io.BytesIO()
    scipy.io.savemat(cast("Any", buffer), variables, do_compression=compressed)
    return buffer.getvalue()


def plain_hdf5(groups: dict[str, Any], units: dict[str, str] | None = None) -> bytes:
    """Nested groups of datasets, with the attribute `unit` where one is given; numbers and texts are attributes."""
    buffer = io.BytesIO()

    def write(group: Any, held: dict[str, Any]) -> None:
        for name, value in held.items():
            if isinstance(value, dict):
                write(group.create_group(name), value)
            elif isinstance(value, str | float | int):
                group.attrs[name] = value
            else:
                group[name] = value
                if name in (units or {}):
                    group[name].attrs["unit"] = (units or {})[name]

    with h5py.File(buffer, "w") as target:
        write(target, groups)
    return buffer.getvalue()


def numpy_file(arrays: Any) -> bytes:
    """An array as .npy, named ones as .npz."""
    buffer = io.BytesIO()
    if isinstance(arrays, dict):
        np.savez_compressed(buffer, **arrays)
    else:
        np.save(buffer, arrays)
    return buffer.getvalue()


def wav(samples: Any, kind: Any, rate: int = 1000) -> bytes:
    """Samples, as parts of the full scale, as a sound file."""
    buffer = io.BytesIO()
    scale = 1.0 if np.issubdtype(kind, np.floating) else 2.0 ** (8 * np.dtype(kind).itemsize - 1)
    scipy.io.wavfile.write(buffer, rate, np.asarray(np.asarray(samples) * scale).astype(kind))
    return buffer.getvalue()
