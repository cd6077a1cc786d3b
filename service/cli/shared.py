"""What the commands share: settings, and how a command fails."""

import os
from typing import NoReturn

import typer
from pydantic import ValidationError
from sqlalchemy.exc import DBAPIError

from service.settings import Settings
from service.store import StorageFull, StoreError, StoreMoved
from underskin.mechanisms.declared.document import FOLDER

STORE_ERRORS = (StoreError, StoreMoved, StorageFull, DBAPIError)


def fail(reason: str) -> NoReturn:
    """Say why on standard error, and end with status 1."""
    typer.echo(f"underskin: {reason}", err=True)
    raise typer.Exit(1)


def read_settings() -> Settings:
    """The settings; a wrong one ends the command. What the command writes from here on is its owner's alone."""
    os.umask(0o077)
    try:
        return Settings()
    except ValidationError as error:
        first = error.errors()[0]
        reason = first["msg"].removeprefix("Value error, ")
        fail(f"UNDERSKIN_{str(first['loc'][0]).upper()} = {first['input']!r}: {reason[:1].lower()}{reason[1:]}")


def use_folder_of_lab(settings: Settings) -> None:
    """The folder of the lab's own mechanisms lies in the data folder where no other is set."""
    os.environ.setdefault(FOLDER, str(settings.data / "mechanisms"))
