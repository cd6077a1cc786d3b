"""The files of the lab's own mechanisms (`mechanism/1`) in the folder of UNDERSKIN_MECHANISMS."""

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import Connection

from service import durable
from service.problems import Refusal
from service.store import own_mechanisms
from service.store.times import now
from underskin.errors import FileError
from underskin.mechanisms.declared.document import FOLDER, parse

_SET_ASIDE = "discarded"  # a folder next to the files that is not read


@dataclass(frozen=True)
class PutBack:
    """Names of a backup's files that the folder lacked, and of those that replaced others, which were set aside."""

    written: tuple[str, ...]
    replaced: tuple[str, ...]


def folder_of_lab() -> Path:
    """The folder; raises Refusal 409 where the server has none."""
    if not os.environ.get(FOLDER):
        raise Refusal(409, f"This server has no folder for a lab's own mechanisms: set {FOLDER} and start it again.")
    return Path(os.environ[FOLDER])


def write(file: Path, content: bytes) -> None:
    """Write a file atomically; raises FileExistsError if it exists."""
    durable.make_folder(file.parent)
    with tempfile.NamedTemporaryFile(dir=file.parent, prefix=".new-") as new:
        new.write(content)
        new.flush()
        os.fsync(new.fileno())
        os.link(new.name, file)
    durable.keep_entries(file.parent)


def set_aside(file: Path) -> None:
    """Move a file to a folder that is not read."""
    aside = file.parent / _SET_ASIDE
    aside.mkdir(exist_ok=True)
    file.rename(aside / f"{file.stem} {now().replace(':', '')}.yaml")
    durable.keep_entries(aside)
    durable.keep_entries(file.parent)


def of_mechanism(name: str) -> list[Path]:
    """The files that declare a mechanism of this name."""
    return [file for file, content in _present().items() if _mechanism(content) == name]


def remember(connection: Connection) -> None:
    """Store the present files in the store, so that backups contain them."""
    folder = folder_of_lab()
    if folder.is_dir():  # else those of the last backup stay
        own_mechanisms.replace(connection, {file.name: content for file, content in _present().items()})


def put_back(connection: Connection) -> PutBack:
    """Restore the stored files to the folder; a file that differs, or declares the same mechanism, is set aside."""
    stored, folder = own_mechanisms.found(connection), folder_of_lab()
    written: list[str] = []
    replaced: list[str] = []
    for name, content in stored.items():
        if Path(name).name != name or not name.endswith(".yaml"):  # in no backup that this service made
            continue
        present = _present()
        if present.get(folder / name) == content:
            continue
        rivals = [
            file for file, other in present.items() if file.name == name or _mechanism(other) == _mechanism(content)
        ]
        for file in rivals:
            set_aside(file)
        write(folder / name, content)
        (replaced if rivals else written).append(name)
    return PutBack(tuple(written), tuple(replaced))


def _present() -> dict[Path, bytes]:
    """The files of the folder, in the order of their names."""
    return {file: file.read_bytes() for file in sorted(folder_of_lab().glob("*.yaml")) if file.is_file()}


def _mechanism(content: bytes) -> str | bytes:
    """Its name; of what cannot be read its content, which is that of no other."""
    try:
        return parse(content, "").name
    except FileError:
        return content
