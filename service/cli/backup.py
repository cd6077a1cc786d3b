"""Commands on the store as a whole: backup and restore, while servers run."""

import os
from pathlib import Path
from typing import Annotated

import typer

from service.auth.keys import KeyStore, keys_missing
from service.cli.shared import STORE_ERRORS, read_settings, use_folder_of_lab
from service.log import first_line
from service.settings import make_data_folder
from service.store import Database, StorageFailed, database, key_requirement, migrate
from service.store import backup as backups
from service.usecases import mechanisms
from underskin import UnderskinError
from underskin.cli.store import byte_steps
from underskin.mechanisms.declared.document import FOLDER


def backup(file: Annotated[Path, typer.Argument(help="Where to write it; a file of that name is replaced.")]) -> None:
    """Write all that the store keeps into one file, read back to be sure, while servers run."""
    settings = read_settings()
    use_folder_of_lab(settings)
    try:
        store = database(settings.database_url, settings.data)
        if store.is_sqlite and not Path(str(store.url.database)).exists():
            raise UnderskinError(f"there is no store in {settings.data}: set UNDERSKIN_DATA to the server's folder")
        _remember_mechanisms(store)
        with byte_steps() as progress:
            backups.make(store, file, progress)
    except (*STORE_ERRORS, OSError) as error:
        raise UnderskinError(first_line(error)) from error
    typer.echo(f"{file}: {file.stat().st_size / 1e6:.3g} MB, read back and whole")


def restore(file: Annotated[Path, typer.Argument(help="A file that `underskin backup` wrote.")]) -> None:
    """Put a backup in place of the store, while servers run; what was there is backed up first."""
    settings = read_settings()
    use_folder_of_lab(settings)
    try:
        make_data_folder(settings.data)
        store = database(settings.database_url, settings.data)
        before = backups.path_for(store, settings.data, "before-restore")
        store.make()
        if migrate.version(store) is not None:
            _remember_mechanisms(store)
        with byte_steps() as progress:
            migrate.restore(store, file, before, progress)
        needed = store.read(key_requirement.is_needed)
    except (*STORE_ERRORS, OSError) as error:
        raise UnderskinError(first_line(error)) from error
    typer.echo(f"restored {file}" + (f"; what was there before is in {before}" if before.exists() else ""))
    try:
        _report_mechanisms(store.read(mechanisms.put_back_files))
    except OSError as error:
        raise UnderskinError(f"the store is restored, but the mechanisms of the lab's own are not: {error}") from error
    if needed:
        typer.echo(_of_keys(KeyStore(settings.data)))


def _remember_mechanisms(store: Database) -> None:
    """A disk that takes nothing keeps nobody from a backup elsewhere."""
    try:
        store.write(mechanisms.remember_files)
    except StorageFailed as error:
        typer.echo(f"mechanisms of the lab's own are in the backup as they were at the last one: {error}", err=True)


def _report_mechanisms(outcome: mechanisms.PutBack) -> None:
    for names, became in (
        (outcome.written, "put back"),
        (outcome.replaced, "put back; what the folder has in their place is set aside in discarded"),
    ):
        if names:
            typer.echo(f"mechanisms of the lab's own in {os.environ[FOLDER]} {became}: {', '.join(names)}")


def _of_keys(keys: KeyStore) -> str:
    """Where the keys are, after a store that needs them was restored."""
    if keys.file_exists():
        return f"keys are needed: those in {keys.path}"
    return keys_missing(keys)
