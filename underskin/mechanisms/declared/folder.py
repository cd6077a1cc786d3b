"""The lab's folder of declared mechanisms, named by a setting: the usable ones, and the errors of the others."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from underskin.errors import FileError, InvalidInput
from underskin.mechanisms.contract import check_numbers
from underskin.mechanisms.declared.document import LARGEST_BYTES, parse
from underskin.mechanisms.declared.mechanism import DeclaredMechanism

FOLDER = "UNDERSKIN_MECHANISMS"  # the setting


@dataclass(frozen=True)
class LabFolder:
    """Usable mechanisms, each with its file and the beginning of its SHA-256, and the errors of unusable files."""

    mechanisms: tuple[tuple[DeclaredMechanism, str], ...]
    refused: tuple[FileError, ...]


def in_folder() -> LabFolder:
    """The contents of the folder, by file name; empty where the setting is not set."""
    usable: list[tuple[DeclaredMechanism, str]] = []
    refused = []
    for file in _files():
        try:
            content = _content(file)
            usable.append((checked(content, _printable(file)), f"{file.name} {sha256(content).hexdigest()[:12]}"))
        except FileError as error:
            refused.append(error)
    return LabFolder(tuple(usable), tuple(refused))


def checked(content: bytes, file: str, *, in_sandbox: bool = False) -> DeclaredMechanism:
    """The mechanism of a document (see `parse`), whose law gives finite numbers; raises FileError."""
    mechanism = parse(content, file, in_sandbox=in_sandbox)
    try:
        check_numbers(mechanism)
    except InvalidInput as error:
        raise FileError(file, "law", f"{error.field}: {error.allowed}") from None
    return mechanism


def digest() -> str:
    """SHA-256 of the folder's files and their names; empty where there are none."""
    total, count = sha256(), 0
    for file in _files():
        try:
            content = _content(file)
        except FileError as error:
            content = error.reason.encode()
        total.update(os.fsencode(file.name) + b"\0" + sha256(content).digest())
        count += 1
    return total.hexdigest() if count else ""


def _files() -> Iterator[Path]:
    """The YAML files of the folder, by name."""
    path = os.environ.get(FOLDER)
    if path:
        yield from sorted(Path(path).glob("*.yaml"))


def _content(file: Path) -> bytes:
    """At most one byte more than a document may have; raises FileError where the file cannot be read."""
    if _printable(file) != str(file):
        raise FileError(_printable(file), "", "its name must be UTF-8")
    if not file.is_file():  # a pipe would be waited for
        raise FileError(str(file), "", "is no file")
    try:
        with file.open("rb") as stream:
            return stream.read(LARGEST_BYTES + 1)
    except OSError as error:
        raise FileError(str(file), "", f"cannot be read: {error.strerror}") from None


def _printable(file: Path) -> str:
    return os.fsencode(file).decode("utf-8", "replace")
