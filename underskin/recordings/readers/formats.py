"""The supported file formats: those of this package, detected by a file's content, and those of others, by its name.

Another package adds a format through an entry point of the group `underskin.readers`, which names a `FileFormat`.
"""

import importlib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import BinaryIO

from underskin import extensions
from underskin.errors import FileError
from underskin.recordings.channels import Contents, Document
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
    "XLSX": "xlsx_file",
    "NumPy": "numpy_file",
    "WAV": "wav_file",
}
_TABLES = ("CSV template", "CSV", "LVM")
BINARY = ("TDMS", "UFF", "MATLAB", "HDF5", "XLSX", "NumPy", "WAV")
GROUP = "underskin.readers"
_SUFFIXES = (  # of the formats of MODULES
    *(".json", ".csv", ".tdms", ".lvm", ".uff", ".unv", ".mat", ".h5", ".hdf5", ".xlsx", ".xlsm", ".npy", ".npz"),
    ".wav",
)
_HEAD_BYTES = 4096
_JSON_LIST = re.compile(r"\[(?!\s*[A-Za-z])")  # not [Header], which begins some instruments' texts
_NANOSCOPE = "a NanoScope file: in its software, export the force curves as text (.txt)"
_FOREIGN = {
    b"TDSh": "a TDMS index: send the .tdms file itself",
    b"\x1f\x8b": "a gzip archive: send the file in it",
    b"\xd0\xcf\x11\xe0": "an old Office document, or one with a password: save the table as .xlsx or CSV",
    b"%PDF": "a PDF",
    b"\\*Force file list": _NANOSCOPE,
    b"\\*File list": _NANOSCOPE,
    b"[DataSet]": "a Nanosurf file (.nid): in its software, export the curves as text (.txt or .csv)",
}
_IGOR = (".ibw", ".pxp")  # which have no mark of their own
ZIP = b"PK\x03\x04"
_STARTS = {
    b"TDSm": "TDMS",
    b"MATLAB 5.0 MAT-file": "MATLAB",
    b"MATLAB 7.3 MAT-file": "MATLAB",
    b"\x89HDF\r\n\x1a\n": "HDF5",
    ZIP: "XLSX",  # or another ZIP archive, which its reader names
    b"\x93NUMPY": "NumPy",
}
_ZIP_NAME = slice(30, 4096)  # where the name of the first part of an archive begins


@dataclass(frozen=True)
class FileFormat:
    """A file format of another package.

    `name` is its name in messages. Files whose names end with one of the `suffixes` (such as ".dat") are read by
    `read`, which gets the open file and its name, and returns its channels or raises FileError. It runs in a separate
    process with limits on memory and time.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[[BinaryIO, str], Contents]


@cache
def formats_of_other_packages() -> Mapping[str, FileFormat]:
    """The formats of other packages by name.

    Raises
    ------
    ExtensionError
        For an invalid format: names its package, the format and the field.
    """
    formats: dict[str, FileFormat] = {}
    for extension in extensions.load(GROUP):
        _check(extension, formats)
        formats[extension.value.name] = extension.value
    return formats


def _check(extension: extensions.Extension, others: Mapping[str, FileFormat]) -> None:
    new = extension.value
    if not isinstance(new, FileFormat):
        raise extension.refused("the entry point", f"must name a {FileFormat.__module__}.FileFormat")
    if not isinstance(new.name, str) or not new.name.strip():
        raise extension.refused("name", f"{new.name!r}: must be a text")
    if new.name in (*MODULES, *others):
        raise extension.refused("name", f"{new.name!r}: is taken", new.name)
    if not isinstance(new.suffixes, tuple) or not new.suffixes:
        raise extension.refused("suffixes", f"{new.suffixes!r}: must be a tuple of at least one", new.name)
    taken = {*_SUFFIXES, *(suffix for other in others.values() for suffix in other.suffixes)}
    for suffix in new.suffixes:
        if not isinstance(suffix, str) or not suffix.startswith(".") or suffix != suffix.lower() or len(suffix) < 2:
            raise extension.refused("suffixes", f"{suffix!r}: must be lower case and begin with a point", new.name)
        if suffix in taken:
            raise extension.refused("suffixes", f"{suffix!r}: is taken by another format", new.name)
    if not callable(new.read):
        raise extension.refused("read", f"{new.read!r}: must be a function", new.name)


def is_parsed_apart(name: str) -> bool:
    """Whether files of a format are parsed in a separate process, whatever their size."""
    return name in BINARY or name not in MODULES


def detect(stream: BinaryIO, file: str) -> str:
    """The format of a file: one of another package by the name's end, else a key of MODULES by the content.

    Raises FileError where it is none of them.
    """
    for other in formats_of_other_packages().values():
        if file.lower().endswith(other.suffixes):
            return other.name
    stream.seek(0)
    head = stream.read(_HEAD_BYTES)
    if not head:
        raise FileError(file, "", "the file is empty (0 bytes)")
    for start, what in _FOREIGN.items():
        if head.startswith(start):
            raise FileError(file, "byte 0", f"is {what}")
    if head.startswith(ZIP) and head[_ZIP_NAME][: int.from_bytes(head[26:28], "little")].endswith(b".npy"):
        return "NumPy"
    if head.startswith(b"RIFF") and head[8:12] == b"WAVE":
        return "WAV"
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
        if file.lower().endswith(_IGOR):
            how = "in Igor or the microscope's software, export the waves as text (.txt)"
            raise FileError(file, error.place, f"is an Igor binary wave: {how}") from None
        supported = "campaign JSON, CSV, XLSX, TDMS, LVM, UFF58, MATLAB, HDF5, NumPy and WAV files"
        raise FileError(file, error.place, f"is of no format that is read here: {supported}") from None
    if start[:1] == "{" or _JSON_LIST.match(start):
        return "JSON"
    if start.startswith(lvm_file.MAGIC):
        return "LVM"
    return "CSV template" if csv_template.is_template(start) else "CSV"


def parse(name: str, stream: BinaryIO, file: str) -> Contents | Document:
    """Read a file of the named format, in this process: its channels, or a campaign document.

    Raises FileError that names the place; MemoryError where there is not enough of it.
    """
    if name in MODULES:
        module = importlib.import_module(f"underskin.recordings.readers.{MODULES[name]}")
        content = module.read(stream, file)
        content = content if isinstance(content, Contents | Document) else Document(content)
        cut = text.warning(stream) if name in _TABLES else ""
        return replace(content, warnings=(*content.warnings, cut)) if cut else content
    stream.seek(0)
    contents = formats_of_other_packages()[name].read(stream, file)
    if not isinstance(contents, Contents):
        raise FileError(file, "", f"the reader of {name} must answer with Contents")
    for channel in (channel for block in contents.blocks for channel in block.channels):
        if getattr(channel.values, "ndim", None) != 1 or channel.values.dtype.kind not in "iufc":
            raise FileError(file, f"channel {channel.name}", "its values must be an array of numbers with one axis")
    return contents
