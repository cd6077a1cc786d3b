"""MATLAB files: version 5 by scipy, version 7.3 (HDF5) by h5py. Only numbers and texts are read; nothing is executed.

Variables and structures become channels and blocks as variables.py describes. Tables, timetables and other objects are
stored in a form that only MATLAB reads: a file without anything else is rejected, with the command that exports them.
"""

from collections.abc import Mapping
from typing import Any, BinaryIO

import h5py
import numpy as np
import scipy.io

from underskin.errors import FileError, damage_said
from underskin.recordings.channels import Contents
from underskin.recordings.readers import hdf5_guard, variables

MAGIC_73 = b"MATLAB 7.3 MAT-file"
_EXPORTS = {"timetable": "writetimetable({0}, '{0}.csv')", "table": "writetable({0}, '{0}.csv')"}
_OTHERWISE = "save its numbers as vectors or structures"


def read(stream: BinaryIO, file: str) -> Contents:
    """The numbers of a MATLAB file; raises FileError that names the variable where it can."""
    stream.seek(0)
    is_73 = stream.read(len(MAGIC_73)) == MAGIC_73
    stream.seek(0)
    with damage_said(file, "", lambda error: f"no MATLAB file: {type(error).__name__}: {error}"):
        # SciPy's stubs accept paths only
        if is_73:
            with h5py.File(stream, "r") as source:
                hdf5_guard.refuse_outside(source, file)
                stored = _structure_73(source)
        else:
            stored = scipy.io.loadmat(stream, simplify_cells=True)  # type: ignore[arg-type]
    objects = dict(_objects(stored))
    numbers = {
        name: value for name, value in stored.items() if not name.startswith("__") and name not in (*objects, "None")
    }
    messages = tuple(_message(name, of_class) for name, of_class in objects.items())
    found = variables.contents(numbers, file)
    if messages and not found.blocks:
        raise FileError(file, "", "; ".join(messages))
    return Contents(found.blocks, found.properties, (*messages, *found.warnings))


def _objects(stored: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The names and classes of objects."""
    found = [(name, value.of_class) for name, value in stored.items() if isinstance(value, _Object)]
    opaque = stored.get("None")  # SciPy's name for them
    if isinstance(opaque, np.ndarray) and opaque.dtype.names and {"s0", "s2"} <= {*opaque.dtype.names}:
        found += [(_text(entry["s0"]), _text(entry["s2"])) for entry in opaque.ravel()]
    return found


def _text(given: Any) -> str:
    return given.decode("latin-1") if isinstance(given, bytes) else str(given)


def _message(name: str, of_class: str) -> str:
    how = _EXPORTS[of_class].format(name) if of_class in _EXPORTS else ""
    return f"{name!r} is a MATLAB {of_class}, which only MATLAB reads: {f'there, {how}' if how else _OTHERWISE}"


class _Object:
    """A variable of a class of MATLAB."""

    def __init__(self, of_class: str) -> None:
        self.of_class = of_class


def _structure_73(group: Any) -> dict[str, Any]:
    return {
        name: _structure_73(value) if isinstance(value, h5py.Group) and not _class_73(value) else _value(value)
        for name, value in group.items()
        if not name.startswith("#")  # #refs#, #subsystem#: MATLAB's own
    }


def _class_73(stored: Any) -> str:
    """The class of an object; empty for numbers, texts and structures."""
    return _text(stored.attrs.get("MATLAB_class", b"")) if "MATLAB_object_decode" in stored.attrs else ""


def _value(dataset: Any) -> Any:
    """A variable as by loadmat; None where it holds neither numbers nor text (cells, references)."""
    if of_class := _class_73(dataset):
        return _Object(of_class)
    if not isinstance(dataset, h5py.Dataset) or dataset.shape is None:
        return None
    if dataset.dtype.names == ("real", "imag"):
        parts = dataset[()]
        return _squeezed(parts["real"].astype(np.float64) + 1j * parts["imag"].astype(np.float64))
    if dataset.dtype.kind not in "iuf":
        return None
    if dataset.attrs.get("MATLAB_class") == b"char":
        return "".join(chr(code) for code in dataset[()].astype(np.uint16).ravel())
    return _squeezed(dataset[()])


def _squeezed(stored: Any) -> Any:
    """HDF5 holds a MATLAB array transposed."""
    value = np.asarray(stored).T.squeeze()
    return value if value.ndim else value.item()
