"""Commands on API keys: create, list, revoke, the sessions of browsers that logged in with them, and do without."""

from collections.abc import Callable
from contextlib import closing
from typing import Annotated

import typer
from sqlalchemy import Connection

from service.auth.keys import KeyStore, Scope, keys_missing
from service.cli.shared import STORE_ERRORS, fail, read_settings
from service.log import first_line
from service.settings import Settings
from service.store import Missing, StoreError, database, key_requirement, sessions
from underskin import UnderskinError

key = typer.Typer(help="API keys: create, list, revoke; their sessions; open: do without.", no_args_is_help=True)


@key.command("create")
def create_key(
    name: Annotated[str, typer.Argument(help="Who or what will use it.")],
    scope: Annotated[Scope, typer.Option(help="read computes and reads; write changes what is kept.")] = "read",
) -> None:
    """Make a key and print it: it is shown this once. From the first one on, the service asks for a key."""
    settings = read_settings()
    try:
        typer.echo(KeyStore(settings.data).create(name, scope))
    except (UnderskinError, OSError, ValueError) as error:
        fail(error)
    try:
        _note(settings, key_requirement.require)
    except (*STORE_ERRORS, OSError) as error:
        typer.echo(
            f"underskin: the key is made; the store will note it when the service runs: {first_line(error)}", err=True
        )


@key.command("list")
def list_keys() -> None:
    """Names, scopes and dates of all keys."""
    settings = read_settings()
    keys = KeyStore(settings.data)
    try:
        for stored_key in keys.entries():
            typer.echo(f"{stored_key.name}\t{stored_key.scope}\t{stored_key.created}")
        if not keys.file_exists() and _keys_needed(settings):
            typer.echo(f"underskin: {keys_missing(keys)}", err=True)
    except (*STORE_ERRORS, OSError, ValueError) as error:
        fail(error)


@key.command("revoke")
def revoke_key(name: Annotated[str, typer.Argument(help="As it was created.")]) -> None:
    """Forget a key; a running server refuses it from then on."""
    try:
        KeyStore(read_settings().data).revoke(name)
    except (UnderskinError, OSError, ValueError) as error:
        fail(error)


@key.command("sessions")
def list_sessions() -> None:
    """Browsers that are logged in: id, key, since when, until when, address, browser."""
    settings = read_settings()
    try:
        with closing(database(settings.database_url, settings.data)) as store:
            has_sessions = store.is_made() and store.read(sessions.has_table)
            for row in store.read(sessions.listed) if has_sessions else ():
                cells = (row.id, row.key_name, row.started_at, row.expires_at, row.address, row.browser)
                typer.echo("\t".join(cells))
    except (*STORE_ERRORS, OSError) as error:
        fail(error)


@key.command("end-session")
def end_session(session_id: Annotated[str, typer.Argument(help="As `underskin key sessions` lists it.")]) -> None:
    """End one; a running server asks that browser for a key within a second."""
    settings = read_settings()
    try:
        with closing(database(settings.database_url, settings.data)) as store:
            if not store.is_made() or not store.read(sessions.has_table):
                raise StoreError("the store has no sessions yet")
            store.write(sessions.end, session_id)
    except (*STORE_ERRORS, Missing, OSError) as error:
        fail(error)


@key.command("open")
def open_to_all(
    yes: Annotated[bool, typer.Option("--yes", help="Do it; without this nothing changes.")] = False,
) -> None:
    """Revoke all keys, and let requests in without one again.

    For a service that listens on this machine alone: whoever reaches it may then read and change all that it keeps. One
    that other machines reach (--host, UNDERSKIN_HOSTS) asks for a key all the same, and does not start without one;
    this command cannot know how the service is run.
    """
    settings = read_settings()
    keys = KeyStore(settings.data)
    there = keys.file_exists()
    if not yes:
        does = f"this revokes all keys in {keys.path} and" if there else f"there is no {keys.path}; this"
        typer.echo(
            f"underskin: {does} lets whoever reaches the service in without a key; to do it: underskin key open --yes",
            err=True,
        )
        raise typer.Exit(2)
    done = "all keys are revoked" if there else f"there is no {keys.path}, so that no key is known"
    try:
        keys.remove()
        _note(settings, key_requirement.lift)
    except (*STORE_ERRORS, OSError) as error:
        fail(f"{done}, but the store still says that keys are needed; do it again: {error}")
    typer.echo(f"{done}; a service that listens on this machine alone answers without one")


def _note(settings: Settings, change: Callable[[Connection], None]) -> None:
    """Keep in the store whether keys are needed; where it is still to be made or upgraded, the service does so."""
    with closing(database(settings.database_url, settings.data)) as store:
        if not store.is_made():
            return
        with store.writing() as connection:
            if key_requirement.has_table(connection):
                change(connection)


def _keys_needed(settings: Settings) -> bool:
    """Whether the store says that requests need a key; one that is still to be made does not."""
    with closing(database(settings.database_url, settings.data)) as store:
        return store.is_made() and store.read(key_requirement.is_needed)
