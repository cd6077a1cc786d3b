"""The commands that send campaigns to the service and fetch skins from it: import and export."""

import hashlib
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from underskin.errors import UnderskinError
from underskin.findings.formatting import significant

if TYPE_CHECKING:
    from underskin.client.campaigns import SentFile
    from underskin.client.documents.campaigns import Refused
    from underskin.client.service_client import Client

Url = Annotated[str, typer.Option(envvar="UNDERSKIN_URL", help="Where the service is.")]
KeyOption = Annotated[
    str | None, typer.Option(envvar="UNDERSKIN_API_KEY", help="API key of scope write, where keys are needed.")
]
LOCAL = "http://127.0.0.1:8000"
_LONGEST_WAIT_S = 600.0


def import_files(
    files: Annotated[list[Path], typer.Argument(help="Campaigns, instrument files, or what `export` wrote.")],
    skin: Annotated[str | None, typer.Option(help="The skin that they are of, whatever they say.")] = None,
    rig: Annotated[Path | None, typer.Option(help="Rig description, for files that hold channels.")] = None,
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
    from rich.console import Console
    from rich.progress import Progress

    refused = 0
    batches = [(str(file), [file]) for file in files] if together is None else [(together, files)]
    terms = {"skin": skin, "rig": rig, "all_or_nothing": all_or_nothing, "together": together}
    console = Console(stderr=True)
    # In a terminal, the bar redirects the output to stay below it; a pipe must get the output itself.
    bar = Progress(console=console, disable=not console.is_terminal, redirect_stdout=sys.stdout.isatty())
    with connect(url, key) as client, bar:
        for name, batch in bar.track(batches, description="importing"):
            for good, line in _sent(client, batch, terms):
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
    from rich.console import Console
    from rich.progress import DownloadColumn, Progress, TextColumn

    console = Console(stderr=True)
    bar = Progress(TextColumn("exporting"), DownloadColumn(), console=console, disable=not console.is_terminal)
    with connect(url, key) as client, bar:
        task = bar.add_task("", total=None)
        client.skins.export(skin, file, lambda count: bar.advance(task, count))
    typer.echo(f"{file}: {file.stat().st_size / 1e6:.1f} MB")


def connect(url: str, key: str | None) -> "Client":
    """A client whose timeout allows for large files."""
    from underskin.client.service_client import Client

    return Client(url, api_key=key, timeout=_LONGEST_WAIT_S)


def _sent(client: "Client", files: Sequence[Path], terms: Mapping[str, Any]) -> list[tuple[bool, str]]:
    """The outcome of files sent at once: whether it succeeded, and a line for each campaign or refused recording."""
    try:
        if terms["together"] is None and _is_export(files[0]):
            brought = client.skins.load(files[0])
            return [(True, f"skin {brought.skin_id}: {brought.kept} campaigns, {brought.present} were there")]
        results = client.campaigns.post_files(files, **terms, idempotency_key=_content_key(files, terms))
    except UnderskinError as error:
        return [(False, str(error))]
    except OSError as error:
        place = f"{error.filename} " if len(files) > 1 else ""
        return [(False, f"{place}cannot be opened: {error.strerror}")]
    return [line for result in results for line in _lines(client, result)]


def _content_key(files: Sequence[Path], terms: Mapping[str, Any]) -> str:
    """A key that is the same for the same files and options, so that what is imported twice is stored once."""
    inputs = [*files] if terms["rig"] is None else [*files, terms["rig"]]
    digests = []
    for file in inputs:
        with file.open("rb") as opened:
            digests.append((file.name, hashlib.file_digest(opened, "sha256").hexdigest()))
    options = [terms["skin"], terms["all_or_nothing"], terms["together"], terms["rig"] is None]
    return f"content {hashlib.sha256(repr([options, digests]).encode()).hexdigest()}"


def _is_export(file: Path) -> bool:
    """Whether a file is what `export` writes, by its content."""
    from underskin.recordings.skin_export import is_export

    with file.open("rb") as opened:
        return is_export(opened, str(file))


def _lines(client: "Client", result: "SentFile") -> list[tuple[bool, str]]:
    accepted = [entry for entry in result.recordings if entry.status == "ok"]
    lines = [(False, _refused(error)) for error in result.errors]
    lines += [(False, f"{entry.id} {_refused(error)}") for entry in result.recordings for error in entry.errors]
    lines += [(True, note) for note in result.notes]
    if result.id is not None:
        count = f"{len(accepted)} recording{'s' if len(accepted) != 1 else ''}"
        figures, remarks = _figures(client, result.id)
        before = ", was there" if result.repeated else ""
        lines.insert(0, (True, f"campaign {result.id} of skin {result.skin_id}{before}, {count}: {figures}"))
        lines += [(True, remark) for remark in remarks]
    return lines


def _refused(error: "Refused") -> str:
    """A refused value in words; without the value where none was sent."""
    value = "" if error.value is None else f" = {error.value!r}"
    return f"{error.field}{value}: {error.allowed}"


def _figures(client: "Client", campaign_id: str) -> tuple[str, list[str]]:
    """d33 and moduli of a campaign in one line, and a line for each finding and for each thing left out."""
    try:
        answer = client.campaigns.d33(campaign_id)
    except UnderskinError as error:  # the campaign is stored nevertheless
        return f"no d33: {error}", []
    moduli = [
        f"E {significant(one.youngs_modulus_mpa, 4)} ± {significant(one.youngs_modulus_uncertainty_mpa, 2)} MPa"
        for one in answer.moduli
    ]
    array = answer.array
    if array is not None and array.d33_pc_per_n is not None and array.d33_uncertainty_pc_per_n is not None:
        d33 = f"d33 {significant(array.d33_pc_per_n, 3)} ± {significant(array.d33_uncertainty_pc_per_n, 2)} pC/N"
    else:
        d33 = f"no d33: {answer.reason or 'every sensor stands out'}"
    results = moduli if moduli and answer.status == "none" else [d33, *moduli]
    remarks = [f"look at: {finding}" for finding in answer.findings]
    for left in answer.left_out:
        of = "" if left.recording is None else f"recording {left.recording}: "
        remarks.append(f"left out: {of}{left.reason}")
    return ", ".join(results), remarks
