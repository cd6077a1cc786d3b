"""The formats that are read, each by a module of its own, and how a file is told to be of one: by its content."""

import importlib
from typing import Any, BinaryIO

from underskin.errors import FileError
from underskin.recordings.channels import Contents
from underskin.recordings.readers import csv_template, lvm_file, text

MODULES = {
    "JSON": "json_file",
    "CSV template": "csv_template",
    "CSV": "csv_file",
    "LVM": "lvm_file",
    "TDMS": "tdms_file",
    "UFF": "uff_file",
    "MATLAB": "mat_file",
    "HDF5": "hdf5_file",
}
BINARY = ("TDMS", "UFF", "MATLAB", "HDF5")
_HEAD_BYTES = 4096
_FOREIGN = {
    b"TDSh": "a TDMS index: send the .tdms file itself",
    b"PK\x03\x04": "a ZIP archive: send the files in it",
    b"\x1f\x8b": "a gzip archive: send the file in it",
    b"\xd0\xcf\x11\xe0": "an old Office document: save the table as CSV",
    b"%PDF": "a PDF",
}
_STARTS = {
    b"TDSm": "TDMS",
    b"MATLAB 5.0 MAT-file": "MATLAB",
    b"MATLAB 7.3 MAT-file": "MATLAB",
    b"\x89HDF\r\n\x1a\n": "HDF5",
}


def detect(stream: BinaryIO, file: str) -> str:
    """The format of a file, a key of MODULES; raises FileError where it is none of them."""
    stream.seek(0)
    head = stream.read(_HEAD_BYTES)
    if not head:
        raise FileError(file, "", "the file is empty (0 bytes)")
    for start, what in _FOREIGN.items():
        if head.startswith(start):
            raise FileError(file, "byte 0", f"is {what}")
    for start, name in _STARTS.items():
        if head.startswith(start):
            return name
    return "UFF" if _is_universal(head) else _text_format(head, file)


def _is_universal(head: bytes) -> bool:
    lines = head.lstrip(b"\r\n").splitlines()
    return len(lines) > 1 and lines[0].strip() == b"-1" and lines[1][:6].strip().isdigit()


def _text_format(head: bytes, file: str) -> str:
    try:
        start = text.decode(head[: len(head) // 2 * 2 or 1], file).lstrip()
    except FileError as error:
        known = "campaign JSON and HDF5, CSV, TDMS, LVM, UFF58 and MATLAB files"
        raise FileError(file, error.place, f"is of no format that is read here: {known}") from None
    if start[:1] in ("{", "["):
        return "JSON"
    if start.startswith(lvm_file.MAGIC):
        return "LVM"
    return "CSV template" if csv_template.is_template(start) else "CSV"


def parse(name: str, stream: BinaryIO, file: str) -> Contents | dict[str, Any]:
    """Read a file of the named format, in this process: its channels, or a campaign document.

    Raises FileError that names the place; MemoryError where there is not enough of it.
    """
    module = importlib.import_module(f"underskin.recordings.readers.{MODULES[name]}")
    return module.read(stream, file)
