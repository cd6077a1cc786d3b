"""The commands that send campaigns to the service and fetch skins from it: import and export."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from underskin.errors import UnderskinError

if TYPE_CHECKING:
    from underskin.client import Client

_HDF5 = b"\x89HDF\r\n\x1a\n"

Url = Annotated[str, typer.Option(envvar="UNDERSKIN_URL", help="Where the service is.")]
Key = Annotated[
    str | None, typer.Option(envvar="UNDERSKIN_API_KEY", help="API key of scope write, where keys are needed.")
]
LOCAL = "http://127.0.0.1:8000"
_LONGEST_WAIT_S = 600.0


def import_files(
    files: Annotated[list[Path], typer.Argument(help="Campaigns, instrument files, or what `export` wrote.")],
    skin: Annotated[str | None, typer.Option(help="The skin that they are of, whatever they say.")] = None,
    rig: Annotated[Path | None, typer.Option(help="Rig description, for files that hold channels.")] = None,
    all_or_nothing: Annotated[
        bool, typer.Option("--all-or-nothing", help="Keep nothing of a file in which any recording is refused.")
    ] = False,
    url: Url = LOCAL,
    key: Key = None,
) -> None:
    """Send files to the service, one after the other; exit status 2 where anything was refused."""
    from rich.console import Console
    from rich.progress import Progress

    refused = 0
    with connect(url, key) as client, Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task("importing", total=len(files))
        for file in files:
            lines = _sent(client, file, skin, rig, all_or_nothing)
            refused += sum(not good for good, _ in lines)
            for _, line in lines:
                progress.console.print(f"{file}: {line}", markup=False, highlight=False)
            progress.advance(task)
    if refused:
        raise typer.Exit(2)


def export_skin(
    skin: Annotated[str, typer.Argument(help="The skin.")],
    file: Annotated[Path, typer.Argument(help="The HDF5 file to write.")],
    url: Url = LOCAL,
    key: Key = None,
) -> None:
    """Write all that the service keeps of a skin into one HDF5 file, for `underskin import` elsewhere."""
    from rich.console import Console
    from rich.progress import DownloadColumn, Progress, TextColumn

    columns = (TextColumn("exporting"), DownloadColumn())
    with connect(url, key) as client, Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task("", total=None)
        client.skins.export(skin, file, lambda count: progress.advance(task, count))
    typer.echo(f"{file}: {file.stat().st_size / 1e6:.1f} MB")


def connect(url: str, key: str | None) -> "Client":
    """A client that waits long enough for what the service does with a big file."""
    from underskin.client import Client

    return Client(url, api_key=key, timeout=_LONGEST_WAIT_S)


def _sent(
    client: "Client", file: Path, skin: str | None, rig: Path | None, all_or_nothing: bool
) -> list[tuple[bool, str]]:
    """What became of a file: whether it is good, and a line a campaign or refused recording."""
    try:
        if _is_export(file):
            brought = client.skins.load(file)
            return [(True, f"skin {brought['skin_id']}: {brought['kept']} campaigns, {brought['present']} were there")]
        results = client.campaigns.post_files([file], skin=skin, rig=rig, all_or_nothing=all_or_nothing)
    except (UnderskinError, OSError) as error:
        return [(False, str(error))]
    return [line for result in results for line in _told(result)]


def _is_export(file: Path) -> bool:
    """Whether a file is what `export` writes, by its content."""
    with file.open("rb") as opened:
        if opened.read(len(_HDF5)) != _HDF5:
            return False
    import h5py

    from underskin.recordings.skin_export import SCHEMA

    with h5py.File(file, "r") as source:
        return bool(source.attrs.get("schema") == SCHEMA)


def _told(result: dict[str, Any]) -> list[tuple[bool, str]]:
    kept = [entry for entry in result["recordings"] if entry["status"] == "ok"]
    lines = [(False, f"{error['field']} = {error['value']!r}: {error['allowed']}") for error in result["errors"]]
    lines += [
        (False, f"{entry['id']} {error['field']} = {error['value']!r}: {error['allowed']}")
        for entry in result["recordings"]
        for error in entry["errors"]
    ]
    lines += [(True, note) for note in result["notes"]]
    if result["status"] == "ok":
        lines.insert(0, (True, f"campaign {result['id']} of skin {result['skin_id']}, {len(kept)} recordings"))
    return lines
