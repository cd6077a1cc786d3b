"""MATLAB files: version 5 by scipy, version 7.3 (HDF5) by h5py. Only numbers and texts are read; nothing is executed.

Vectors are channels, `name`; a matrix is one channel a column, `name(:,1)`. Single numbers and texts are properties. A
structure is a block; the variables outside structures are a block without a name.
"""

from collections.abc import Iterator, Mapping
from typing import Any, BinaryIO

import h5py
import numpy as np
import scipy.io

from underskin.errors import damage_said
from underskin.recordings.channels import Block, Channel, Contents, as_values
from underskin.recordings.readers import hdf5_file

MAGIC_73 = b"MATLAB 7.3 MAT-file"
_MOST_COLUMNS = 1000


def read(stream: BinaryIO, file: str) -> Contents:
    """The numbers of a MATLAB file; raises FileError that names the variable where it can."""
    stream.seek(0)
    is_73 = stream.read(len(MAGIC_73)) == MAGIC_73
    stream.seek(0)
    with damage_said(file, "", lambda error: f"no MATLAB file: {type(error).__name__}: {error}"):
        # SciPy's stubs accept paths only
        variables = _variables_73(stream, file) if is_73 else scipy.io.loadmat(stream, simplify_cells=True)  # type: ignore[arg-type]
    return _contents({name: value for name, value in variables.items() if not name.startswith("__")})


def _contents(variables: Mapping[str, Any]) -> Contents:
    properties: dict[str, str | float] = {}
    blocks = []
    structures = {name: value for name, value in variables.items() if isinstance(value, Mapping)}
    for name, values in {"": variables, **structures}.items():
        channels: list[Channel] = []
        for variable, value in values.items():
            label = f"{name}.{variable}" if name else variable
            if isinstance(value, str):
                properties[label] = value
            elif isinstance(value, int | float | np.integer | np.floating):
                properties[label] = float(value)
            elif isinstance(value, np.ndarray) and value.dtype.kind in "iufc":
                channels += _channels(variable, value)
        if channels:
            blocks.append(Block(name, tuple(channels)))
    return Contents(tuple(blocks), properties)


def _channels(name: str, value: Any) -> Iterator[Channel]:
    values = as_values(value)
    if values.ndim == 1:
        yield Channel(name, "", values)
    elif values.ndim == 2 and values.shape[1] <= _MOST_COLUMNS:
        for column in range(values.shape[1]):
            yield Channel(f"{name}(:,{column + 1})", "", values[:, column])


def _variables_73(stream: BinaryIO, file: str) -> dict[str, Any]:
    with h5py.File(stream, "r") as source:
        hdf5_file.refuse_outside(source, file)
        return {
            name: {inner: _value(value[inner]) for inner in value} if isinstance(value, h5py.Group) else _value(value)
            for name, value in source.items()
            if not name.startswith("#")  # #refs#, #subsystem#: MATLAB's own
        }


def _value(dataset: Any) -> Any:
    """A variable as by loadmat; None where it holds neither numbers nor text (cells, references, objects)."""
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
