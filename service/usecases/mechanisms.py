"""The catalogue of mechanisms including the lab's own: files (`mechanism/1`) in the folder of UNDERSKIN_MECHANISMS."""

import os
import tempfile
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from sqlalchemy import Connection

from service import durable
from service.problems import Refusal
from service.schemas.mechanisms import MechanismEntry, MechanismParameter, UnusableFile
from service.store import diagnoses, models, own_mechanisms
from service.store.times import now
from underskin.errors import FileError, InvalidInput
from underskin.mechanisms.base import Mechanism
from underskin.mechanisms.declared import saving
from underskin.mechanisms.declared.document import FOLDER, checked, digest, parse
from underskin.mechanisms.declared.mechanism import DeclaredMechanism
from underskin.mechanisms.registry import CATALOGUE

_SET_ASIDE = "discarded"  # a folder next to the files that is not read
_lock = threading.Lock()  # of what this process has loaded
_loaded = {"digest": digest()}


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


def write_file(file: Path, content: bytes) -> None:
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
    return [file for file, content in _present_files().items() if _name_in(content) == name]


def remember_files(connection: Connection) -> None:
    """Store the present files in the store, so that backups contain them."""
    folder = folder_of_lab()
    if folder.is_dir():  # else those of the last backup stay
        own_mechanisms.replace(connection, {file.name: content for file, content in _present_files().items()})


def put_back_files(connection: Connection) -> PutBack:
    """Restore the stored files to the folder; a file that differs, or declares the same mechanism, is set aside."""
    stored, folder = own_mechanisms.found(connection), folder_of_lab()
    written: list[str] = []
    replaced: list[str] = []
    for name, content in stored.items():
        if Path(name).name != name or not name.endswith(".yaml"):  # in no backup that this service made
            continue
        present = _present_files()
        if present.get(folder / name) == content:
            continue
        rivals = [file for file, other in present.items() if file.name == name or _name_in(other) == _name_in(content)]
        for file in rivals:
            set_aside(file)
        write_file(folder / name, content)
        (replaced if rivals else written).append(name)
    return PutBack(tuple(written), tuple(replaced))


def _present_files() -> dict[Path, bytes]:
    """The files of the folder, in the order of their names."""
    return {file: file.read_bytes() for file in sorted(folder_of_lab().glob("*.yaml")) if file.is_file()}


def _name_in(content: bytes) -> str | bytes:
    """Its name; of what cannot be read its content, which is that of no other."""
    try:
        return parse(content, "").name
    except FileError:
        return content


def catalogue() -> Mapping[str, Mechanism]:
    """The mechanisms by name, with the lab's own as they are now: another server may have changed them. Invalid
    files of the lab's folder are skipped (`unusable`)."""
    with _lock:
        files_digest = digest()
        if files_digest != _loaded["digest"]:
            CATALOGUE.reload()
            _loaded["digest"] = files_digest
    return CATALOGUE.load().mechanisms


def full_catalogue() -> Mapping[str, Mechanism]:
    """The same; raises Refusal 409 if a file of the lab's folder is invalid: a diagnosis without it would be a
    different one."""
    laws = catalogue()
    try:
        CATALOGUE.require_complete()
    except FileError as error:
        raise Refusal(409, f"A mechanism of the lab's own cannot be used: {error}. Mend or remove it.") from None
    return laws


def entries() -> list[MechanismEntry]:
    """The catalogue, described."""
    return [_entry(mechanism, CATALOGUE.packages.get(mechanism.name)) for mechanism in catalogue().values()]


def unusable() -> list[UnusableFile]:
    """The invalid files of the lab's folder, and why."""
    catalogue()
    return [
        UnusableFile(file=Path(error.file).name, reason=": ".join(filter(None, (error.place, error.reason))))
        for error in CATALOGUE.refused
    ]


def keep(content: bytes) -> MechanismEntry:
    """Store a document as a mechanism of the lab's own; its entry is made before anything is written.

    Raises FileError for an invalid document, and Refusal 409 for a name in use.
    """
    folder = folder_of_lab()
    mechanism = checked(content, "", in_sandbox=True)
    file = folder / f"{mechanism.name}.yaml"
    new_entry = _entry(mechanism, f"{file.name} {sha256(content).hexdigest()[:12]}")
    if mechanism.name in catalogue():
        raise Refusal(409, f"The name {mechanism.name!r} is taken by another mechanism.")
    try:
        write_file(file, content)
    except FileExistsError:
        raise Refusal(409, f"The name {mechanism.name!r} is taken by another mechanism.") from None
    return new_entry


def keep_found(connection: Connection, diagnosis_id: str, name: str, description: str | None) -> MechanismEntry:
    """Keep the law that a diagnosis found beside the catalogue, under a name of the lab's.

    Raises Missing, and InvalidInput where the diagnosis found none that an expression can say.
    """
    row = diagnoses.find(connection, diagnosis_id)
    report = diagnoses.report_of(connection, row.number)
    if report is None:
        raise Refusal(409, f"Diagnosis {diagnosis_id!r} has no report: its state is {row.state}.")
    try:
        return keep(saving.document(report, name, description).encode())
    except FileError as error:
        raise InvalidInput("name", name, error.reason) from None


def discard(connection: Connection, name: str) -> MechanismEntry:
    """Remove a mechanism of the lab's own from the catalogue; its file is moved to a folder of discarded ones.

    Raises Refusal: 404 for an unknown name, 409 if it is not the lab's own or a model in force needs it.
    """
    mechanism = catalogue().get(name)
    if mechanism is None:
        raise Refusal(404, f"There is no mechanism {name!r}.")
    if not isinstance(mechanism, DeclaredMechanism):
        raise Refusal(409, f"{name!r} is not one of the lab's own mechanisms: it cannot be discarded.")
    for row in models.all_in_force(connection):
        report = diagnoses.report_of(connection, row.number)
        if report is not None and name in {reported["name"] for reported in report["mechanisms"]}:
            raise Refusal(409, f"The model in force of skin {row.model_skin_id!r} needs {name!r}: withdraw it first.")
    discarded = _entry(mechanism, CATALOGUE.packages.get(name))
    for file in of_mechanism(name):
        set_aside(file)
    catalogue()
    return discarded


def _entry(mechanism: Mechanism, package: str | None) -> MechanismEntry:
    stated = mechanism.parameters_stated if isinstance(mechanism, DeclaredMechanism) else None
    return MechanismEntry(
        name=mechanism.name,
        description=mechanism.plain,
        law=mechanism.law,
        kinds=list(mechanism.kinds),
        assumptions=mechanism.assumptions,
        source=mechanism.source,
        package=package,
        own=stated is not None,
        parameters=[
            MechanismParameter(name=parameter.name, unit=parameter.unit, low=parameter.low, high=parameter.high)
            for parameter in stated or ()
        ],
    )
