"""Commands that need the server: serve and key."""

import errno
import ipaddress
import socket
import tempfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Annotated, NoReturn

import typer
import uvicorn
from pydantic import ValidationError
from sqlalchemy import Connection
from sqlalchemy.exc import DBAPIError

from service import data_folder
from service.app import create_app
from service.gate import LOOPBACK_NAMES, Gate
from service.http_protocol import LimitedHttpProtocol
from service.key_requirement import KeyRequirement
from service.keys import KeyStore, Scope, keys_missing
from service.log import configure_logging
from service.settings import Settings
from service.store import StoreError, database, key_requirement, open_store
from service.store.engine import StorageFull
from service.store.errors import StoreMoved
from service.store.restore import keys_needed
from underskin import ExtensionError, TableError, UnderskinError
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.readers.formats import formats_of_other_packages
from underskin.surrogate.sigma_table import SIGMA_TABLE, load_table

_STORE_FAILED = (StoreError, StoreMoved, StorageFull, DBAPIError)

key = typer.Typer(help="API keys: create, list, revoke; open: do without.", no_args_is_help=True)


def serve(
    host: Annotated[str, typer.Option(help="Address to bind to; any but loopback needs a key.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen on.", min=0, max=65535)] = 8000,
) -> None:
    """Serve σ, FRF and d33 over HTTP."""
    settings = read_settings()
    keys = KeyStore(settings.data)
    # Other names than loopback's mean a proxy in front, which lets other machines in.
    private = _is_loopback(host) and settings.host_names <= LOOPBACK_NAMES
    try:
        _require_writable(settings.data)
        known = keys.entries()  # a damaged file ends the start, not every request
        if not private and not known:
            where = f"as {settings.hosts}" if _is_loopback(host) else f"on {host}"
            _fail(f"refusing to serve {where} without API keys: make one with `underskin key create NAME`")
        table = load_table(settings.tables / SIGMA_TABLE)
        CATALOGUE.load()  # what other packages add is refused here, not at the first file or diagnosis
        formats_of_other_packages()
        store = open_store(settings.database_url, settings.data)
        requirement = KeyRequirement(keys, store)
        requirement.look()
        listener = _listen(host, port)
    except (TableError, ExtensionError, *_STORE_FAILED, OSError, ValueError) as error:
        _fail(str(error))
    configure_logging()
    typer.echo(f"underskin serves on http://{_host_name(host)}:{listener.getsockname()[1]} (Ctrl+C ends it)")
    gate = Gate(
        host_names=settings.host_names | {_host_name(host)},
        keys=keys,
        requirement=requirement,
        keys_always=not private,
        max_body_bytes=settings.max_body_bytes,
        max_upload_bytes=settings.max_upload_bytes,
    )
    config = uvicorn.Config(
        create_app(settings, table, gate, store),
        access_log=False,
        log_config=None,
        server_header=False,
        proxy_headers=False,
        http=LimitedHttpProtocol,
        timeout_graceful_shutdown=10,
    )
    uvicorn.Server(config).run(sockets=[listener])


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
        _fail(str(error))
    try:
        _note(settings, key_requirement.require)
    except (*_STORE_FAILED, OSError) as error:
        typer.echo(f"underskin: the key is made; the store will note it when the service runs: {error}", err=True)


@key.command("list")
def list_keys() -> None:
    """Names, scopes and dates of all keys."""
    settings = read_settings()
    keys = KeyStore(settings.data)
    try:
        for entry in keys.entries():
            typer.echo(f"{entry.name}\t{entry.scope}\t{entry.created}")
        if not keys.file_exists() and _keys_needed(settings):
            typer.echo(f"underskin: {keys_missing(keys)}", err=True)
    except (*_STORE_FAILED, OSError, ValueError) as error:
        _fail(str(error))


@key.command("revoke")
def revoke_key(name: Annotated[str, typer.Argument(help="As it was created.")]) -> None:
    """Forget a key; a running server refuses it from then on."""
    try:
        _keys().revoke(name)
    except (UnderskinError, OSError, ValueError) as error:
        _fail(str(error))


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
    except (*_STORE_FAILED, OSError) as error:
        _fail(f"{done}, but the store still says that keys are needed; do it again: {error}")
    typer.echo(f"{done}; a service that listens on this machine alone answers without one")


def _note(settings: Settings, change: Callable[[Connection], None]) -> None:
    """Keep in the store whether keys are needed; where it is still to be made or upgraded, the service does so."""
    with closing(database(settings.database_url, settings.data)) as store:
        if not store.is_made():
            return
        with store.writing() as connection:
            if key_requirement.is_known(connection):
                change(connection)


def _keys_needed(settings: Settings) -> bool:
    """Whether the store says that requests need a key; one that is still to be made does not."""
    with closing(database(settings.database_url, settings.data)) as store:
        return store.is_made() and keys_needed(store)


def _fail(reason: str) -> NoReturn:
    typer.echo(f"underskin: {reason}", err=True)
    raise typer.Exit(1)


def read_settings() -> Settings:
    """The settings; a wrong one ends the command."""
    try:
        return Settings()
    except ValidationError as error:
        first = error.errors()[0]
        reason = first["msg"].removeprefix("Value error, ")
        _fail(f"UNDERSKIN_{str(first['loc'][0]).upper()} = {first['input']!r}: {reason[:1].lower()}{reason[1:]}")


def _keys() -> KeyStore:
    return KeyStore(read_settings().data)


def _require_writable(folder: Path) -> None:
    try:
        data_folder.make(folder)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(f"the data folder {folder} (UNDERSKIN_DATA) is not writable: {error.strerror}") from error


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _host_name(host: str) -> str:
    """The address as a Host header spells it."""
    return f"[{host.lower()}]" if ":" in host else host.lower()


def _listen(host: str, port: int) -> socket.socket:
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        return socket.create_server(address, family=family, backlog=2048)
    except OSError as error:
        other = "; take another: --port PORT, or make serve PORT=..." if error.errno == errno.EADDRINUSE else ""
        raise OSError(f"cannot listen on {host} port {port}: {error.strerror}{other}") from error
