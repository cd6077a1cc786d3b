"""What the commands share: settings, and how a command fails."""

import os
from typing import NoReturn

import typer
from pydantic import ValidationError
from sqlalchemy.exc import DBAPIError

from service.log import first_line
from service.settings import Settings
from service.store import StorageFailed, StoreError, StoreMoved
from underskin import InvalidInput
from underskin.mechanisms.declared.document import FOLDER
from underskin.recordings.readers.text import time_zone

STORE_ERRORS = (StoreError, StoreMoved, StorageFailed, DBAPIError)


def fail(reason: object) -> NoReturn:
    """Say why, in one line on standard error, and end with status 2."""
    typer.echo(f"underskin: {first_line(reason)}", err=True)
    raise typer.Exit(2)


def read_settings() -> Settings:
    """The settings; a wrong one ends the command. What the command writes from here on is its owner's alone."""
    os.umask(0o077)
    try:
        settings = Settings()
        time_zone()
        return settings
    except InvalidInput as error:
        fail(error)
    except ValidationError as error:
        first = error.errors()[0]
        reason = first["msg"].removeprefix("Value error, ")
        fail(f"UNDERSKIN_{str(first['loc'][0]).upper()} = {first['input']!r}: {reason[:1].lower()}{reason[1:]}")


def use_folder_of_lab(settings: Settings) -> None:
    """The folder of the lab's own mechanisms lies in the data folder where no other is set."""
    os.environ.setdefault(FOLDER, str(settings.data / "mechanisms"))
