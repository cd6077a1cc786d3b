"""The command `watch`: files that an instrument saves in a folder are sent to the service once they are complete."""

import signal
import sys
import time
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from underskin.cli.rigs import EstimatorOption, RigOption, rig_description_in
from underskin.cli.store import LOCAL, KeyOption, Url, outcome
from underskin.errors import ServiceError, UnderskinError, Unreachable

if TYPE_CHECKING:
    from underskin.client.service_client import Client

_TIMEOUT_S = 120.0


def watch(
    folder: Annotated[Path, typer.Argument(help="Where the instrument saves, in this folder and those in it.")],
    skin: Annotated[str, typer.Option(help="The skin that the files are of, whatever they say.")],
    rig: RigOption = None,
    estimator: EstimatorOption = None,
    settle_s: Annotated[
        float, typer.Option(min=0.1, help="How long a file must be unchanged to be complete [s].")
    ] = 5.0,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Send what an instrument saves in a folder, each file once it is complete, until Ctrl+C or SIGTERM.

    Each content is sent once, also after a restart, a kill or a dead network. What is refused is told, and left until
    it changes.
    """
    if not folder.is_dir():
        raise UnderskinError(f"{folder} is no folder")
    if rig is not None:
        rig_description_in(rig)  # which refuses one that cannot be used, before every file is refused for it
    from underskin.client.service_client import Client
    from underskin.client.watch import Journal, WatchedFolder, Watcher

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, _end)
    journal = Journal(folder)
    with Client(url, api_key=key, timeout=_TIMEOUT_S) as client:
        _introduce(client, folder, skin)

        def on_stored(name: str, results: Sequence[Mapping[str, Any]]) -> None:
            for result in results:
                for good, line in outcome(client, result):
                    _tell(good, f"{name}: {line}")

        watcher = Watcher(
            client,
            WatchedFolder(folder, settle_s),
            journal,
            url=url,
            skin=skin,
            rig=rig,
            estimator=estimator,
            on_stored=on_stored,
            on_message=_tell,
        )
        while True:
            time.sleep(watcher.step())


def _introduce(client: "Client", folder: Path, skin: str) -> None:
    """Print what is watched; raises ServiceError where the service refuses the key."""
    new = ""
    try:
        client.skins.get(skin)
    except Unreachable:  # reported with the first file: a bench may be switched on before the server
        pass
    except ServiceError as error:
        if error.status in (HTTPStatus.UNAUTHORIZED, HTTPStatus.FORBIDDEN):
            raise
        new = ", which is new" if error.status == HTTPStatus.NOT_FOUND else ""
    _tell(True, f"watching {folder} for skin {skin}{new}")


def _tell(good: bool, words: str) -> None:
    typer.echo(words, err=not good)


def _end(*_: object) -> None:
    """Exit; a transfer in progress is not in the journal, and is repeated at the next start."""
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, signal.SIG_IGN)  # `timeout` and systemd send it more than once
    sys.exit(0)
