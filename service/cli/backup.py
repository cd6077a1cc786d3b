"""Commands on the store as a whole: backup and restore, while servers run."""

from pathlib import Path
from typing import Annotated

import typer

from service.auth.keys import KeyStore, keys_missing
from service.cli.shared import read_settings
from service.settings import make_data_folder
from service.store import StoreError, database, key_requirement, migrate
from service.store import backup as backups
from underskin import UnderskinError


def backup(file: Annotated[Path, typer.Argument(help="Where to write it; a file of that name is replaced.")]) -> None:
    """Write all that the store keeps into one file, read back to be sure, while servers run."""
    settings = read_settings()
    try:
        backups.make(database(settings.database_url, settings.data), file)
    except (StoreError, OSError) as error:
        raise UnderskinError(str(error)) from error
    typer.echo(f"{file}: {file.stat().st_size / 1e6:.1f} MB, read back and whole")


def restore(file: Annotated[Path, typer.Argument(help="A file that `underskin backup` wrote.")]) -> None:
    """Put a backup in place of the store, while servers run; what was there is backed up first."""
    settings = read_settings()
    try:
        make_data_folder(settings.data)
        store = database(settings.database_url, settings.data)
        before = backups.place(store, settings.data, "before-restore")
        migrate.restore(store, file, before)
        needed = store.read(key_requirement.is_needed)
    except (StoreError, OSError) as error:
        raise UnderskinError(str(error)) from error
    typer.echo(f"restored {file}" + (f"; what was there before is in {before}" if before.exists() else ""))
    if needed:
        typer.echo(_of_keys(KeyStore(settings.data)))


def _of_keys(keys: KeyStore) -> str:
    """Where the keys are, after a store that needs them was restored."""
    if keys.file_exists():
        return f"keys are needed: those in {keys.path}"
    return keys_missing(keys)
