"""The commands that send campaigns to the service and fetch skins from it: import and export."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from underskin.cli.progress import byte_progress
from underskin.cli.rigs import EstimatorOption, RigOption
from underskin.cli.sending import sent
from underskin.errors import UnderskinError

if TYPE_CHECKING:
    from underskin.client.service_client import Client

Url = Annotated[str, typer.Option(envvar="UNDERSKIN_URL", help="Where the service is.")]
KeyOption = Annotated[
    str | None,
    typer.Option(
        envvar="UNDERSKIN_API_KEY", help="API key, where keys are needed; of scope write for what changes something."
    ),
]
LOCAL = "http://127.0.0.1:8000"
_LONGEST_WAIT_S = 600.0


def import_files(
    files: Annotated[list[Path], typer.Argument(help="Campaigns, instrument files, or what `export` wrote.")],
    skin: Annotated[str | None, typer.Option(help="The skin that they are of, whatever they say.")] = None,
    rig: RigOption = None,
    estimator: EstimatorOption = None,
    together: Annotated[
        str | None, typer.Option(metavar="NAME", help="Join the files, all of one skin, into one campaign called NAME.")
    ] = None,
    all_or_nothing: Annotated[
        bool,
        typer.Option("--all-or-nothing", help="Keep nothing of a file, or of a campaign, with a refused recording."),
    ] = False,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Send files to the service, one after the other or together; exit status 2 where anything was refused."""
    refused = 0
    batches = [(str(file), [file]) for file in files] if together is None else [(together, files)]
    terms = {
        "skin": skin,
        "rig": rig,
        "estimator": estimator,
        "all_or_nothing": all_or_nothing,
        "together": together,
    }
    with connect(url, key) as client, byte_progress() as bar:
        task = bar.add_task("importing", total=sum(_size(file) for _, batch in batches for file in batch))
        for name, batch in batches:
            for good, line in sent(client, batch, terms, lambda count: bar.advance(task, count)):
                refused += not good
                typer.echo(f"{name}: {line}", err=not good)
    if refused:
        raise typer.Exit(2)


def export_skin(
    skin: Annotated[str, typer.Argument(help="The skin.")],
    file: Annotated[Path, typer.Argument(help="The HDF5 file to write.")],
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Write all that the service keeps of a skin into one HDF5 file, for `underskin import` elsewhere."""
    if not file.parent.is_dir():
        raise UnderskinError(f"{file}: the folder {file.parent} does not exist")
    with connect(url, key) as client, byte_progress() as bar:
        task = bar.add_task("exporting", total=None)
        client.skins.export(skin, file, lambda count: bar.advance(task, count))
    typer.echo(f"{file}: {file.stat().st_size / 1e6:.1f} MB")


def _size(file: Path) -> int:
    """Size in bytes; 0 for an unreadable file, whose error is reported when it is sent."""
    try:
        return file.stat().st_size
    except OSError:
        return 0


def connect(url: str, key: str | None) -> "Client":
    """A client whose timeout allows for large files."""
    from underskin.client.service_client import Client

    return Client(url, api_key=key, timeout=_LONGEST_WAIT_S)
