"""The command that serves."""

import errno
import gc
import ipaddress
import socket
import tempfile
from pathlib import Path
from typing import Annotated

import typer
import uvicorn

from service.app import create_app
from service.auth.access_control import LOOPBACK_NAMES, AccessControl
from service.auth.key_requirement import KeyRequirement
from service.auth.keys import KeyStore
from service.auth.sessions import Sessions
from service.cli.shared import STORE_ERRORS, fail, read_settings, use_folder_of_lab
from service.log import configure_logging, logger
from service.middleware.http_protocol import ConnectionLimits, limited
from service.settings import make_data_folder, unknown_settings
from service.store import open_store
from underskin import ExtensionError, TableError
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.readers.formats import formats_of_other_packages
from underskin.recordings.readers.parsing_limits import ParsingLimits
from underskin.surrogate.sigma_table import SIGMA_TABLE, load_table

_COLLECTIONS = 50_000, 20, 100  # a whole one after some 10^8 objects more than were freed


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
        entries = keys.entries()  # a damaged file ends the start, not every request
        if not private and not entries:
            where = f"as {settings.hosts}" if _is_loopback(host) else f"on {host}"
            fail(f"refusing to serve {where} without API keys: make one with `underskin key create NAME`")
        table = load_table(settings.tables / SIGMA_TABLE)
        use_folder_of_lab(settings)
        CATALOGUE.load()  # errors of other packages' extensions end the start, not the first file or diagnosis
        formats_of_other_packages()
        ParsingLimits.from_environment()
        store = open_store(settings.database_url, settings.data)
        requirement = KeyRequirement(keys, store)
        requirement.look()
        sessions = Sessions(store)
        sessions.look()
        listener = _listen(host, port)
    except (TableError, ExtensionError, *STORE_ERRORS, OSError, ValueError) as error:
        fail(error)
    configure_logging()
    if unknown := unknown_settings():
        logger.warning("nothing reads %s (docs/settings.md lists what is read)", ", ".join(unknown))
    for refusal in CATALOGUE.refused:
        logger.warning("a mechanism of the lab's own cannot be used: %s", refusal)
    address = f"http://{_host_name(host)}:{listener.getsockname()[1]}"
    typer.echo(f"underskin serves on {address}, with its data in {settings.data} (Ctrl+C ends it)")
    access = AccessControl(
        host_names=settings.host_names | {_host_name(host)},
        keys=keys,
        requirement=requirement,
        sessions=sessions,
        keys_always=not private,
        max_body_bytes=settings.max_body_bytes,
        max_upload_bytes=settings.max_upload_bytes,
    )
    limits = ConnectionLimits(1000 * settings.max_header_kb, settings.idle_seconds, settings.max_connections)
    config = uvicorn.Config(
        create_app(settings, table, access, store),
        access_log=False,
        log_config=None,
        server_header=False,
        proxy_headers=False,
        http=limited(limits.within_descriptors()),
        timeout_graceful_shutdown=10,
    )
    _collect_seldom()
    uvicorn.Server(config).run(sockets=[listener])


def _collect_seldom() -> None:
    """Let no garbage collection go over all objects while a large campaign is read: it holds up all other requests for
    tenths of a second. References free nearly all; young cycles are collected as ever."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(*_COLLECTIONS)


def _require_writable(folder: Path) -> None:
    try:
        make_data_folder(folder)
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
