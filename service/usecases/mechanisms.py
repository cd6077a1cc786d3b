"""The catalogue of mechanisms, and the lab's own in it: files (`mechanism/1`) in the folder of UNDERSKIN_MECHANISMS."""

import threading
from collections.abc import Mapping

from sqlalchemy import Connection

from service.problems import Refusal
from service.schemas.mechanisms import MechanismEntry, MechanismParameter
from service.store import diagnoses, models
from service.usecases import mechanism_files
from underskin.errors import FileError, InvalidInput
from underskin.mechanisms.base import Mechanism
from underskin.mechanisms.contract import check_numbers
from underskin.mechanisms.declared import saving
from underskin.mechanisms.declared.document import digest, in_folder, parse
from underskin.mechanisms.declared.mechanism import DeclaredMechanism
from underskin.mechanisms.registry import CATALOGUE

_lock = threading.Lock()  # of what this process has loaded
_loaded = {"digest": digest()}


def catalogue() -> Mapping[str, Mechanism]:
    """The mechanisms by name, with the lab's own as they are now: another server may have changed them.

    Raises Refusal 409 where a file of the lab's folder cannot be used: a diagnosis without it would be another one.
    """
    with _lock:
        found = digest()
        if found != _loaded["digest"]:
            try:
                in_folder()  # which refuses what cannot be used while the catalogue in use still stands
                CATALOGUE.reload()
                CATALOGUE.load()
            except FileError as error:
                raise Refusal(
                    409, f"A mechanism of the lab's own cannot be used: {error}. Mend or remove it."
                ) from None
            _loaded["digest"] = found
    return CATALOGUE


def entries() -> list[MechanismEntry]:
    """The catalogue, described."""
    return [_entry(mechanism) for mechanism in catalogue().values()]


def keep(content: bytes) -> MechanismEntry:
    """Keep a document as one more of the lab's own.

    Raises FileError or InvalidInput where it cannot be used, and Refusal 409 where its name is taken.
    """
    folder = mechanism_files.folder_of_lab()
    mechanism = parse(content, "mechanism")
    check_numbers(mechanism)
    if mechanism.name in catalogue():
        raise Refusal(409, f"The name {mechanism.name!r} is taken by another mechanism.")
    try:
        mechanism_files.write(folder / f"{mechanism.name}.yaml", content)
    except FileExistsError:
        raise Refusal(409, f"The name {mechanism.name!r} is taken by another mechanism.") from None
    return _entry(catalogue()[mechanism.name])


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
    """Take one of the lab's own out of the catalogue; its file is kept in a folder of discarded ones.

    Raises Refusal: 404 for an unknown name, 409 where it is not the lab's own or a model in force needs it.
    """
    mechanism = catalogue().get(name)
    if mechanism is None:
        raise Refusal(404, f"There is no mechanism {name!r}.")
    if not isinstance(mechanism, DeclaredMechanism):
        raise Refusal(409, f"{name!r} is not one of the lab's own mechanisms: it cannot be discarded.")
    for row in models.all_in_force(connection):
        report = diagnoses.report_of(connection, row.number)
        if report is not None and name in {entry["name"] for entry in report["mechanisms"]}:
            raise Refusal(409, f"The model in force of skin {row.model_skin_id!r} needs {name!r}: withdraw it first.")
    for file in mechanism_files.folder_of_lab().glob("*.yaml"):
        if parse(file.read_bytes(), str(file)).name == name:
            mechanism_files.set_aside(file)
    discarded = _entry(mechanism)
    catalogue()
    return discarded


def _entry(mechanism: Mechanism) -> MechanismEntry:
    stated = mechanism.parameters_stated if isinstance(mechanism, DeclaredMechanism) else None
    return MechanismEntry(
        name=mechanism.name,
        description=mechanism.plain,
        law=mechanism.law,
        kinds=list(mechanism.kinds),
        assumptions=mechanism.assumptions,
        source=mechanism.source,
        package=CATALOGUE.packages.get(mechanism.name),
        own=stated is not None,
        parameters=[
            MechanismParameter(name=entry.name, unit=entry.unit, low=entry.low, high=entry.high)
            for entry in stated or ()
        ],
    )
