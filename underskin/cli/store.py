"""The commands that send campaigns to the service and fetch skins from it: import and export.

Also what other commands share of sending: the connection, the progress, and the outcome in lines of text.
"""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from underskin.cli.rigs import EstimatorOption, RigOption
from underskin.errors import UnderskinError
from underskin.findings.formatting import grouped_by_reason, significant, why_refused

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from underskin.client.campaigns import SentFile
    from underskin.client.service_client import Client


def byte_progress() -> "Progress":
    """A progress bar on standard error: bytes done, total, rate."""
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn

    console = Console(stderr=True)
    columns = TextColumn("{task.description}"), BarColumn(), DownloadColumn(), TransferSpeedColumn()
    # In a terminal, the bar redirects the output to stay below it; a pipe must get the output itself.
    return Progress(*columns, console=console, disable=not console.is_terminal, redirect_stdout=sys.stdout.isatty())


@contextmanager
def byte_steps() -> Iterator[Callable[[str, int, int | None], None]]:
    """A bar for each step of a task; the function takes the step's name, its bytes so far and, where known, in all."""
    with byte_progress() as bar:
        tasks: dict[str, TaskID] = {}

        def advance(step: str, done: int, of: int | None) -> None:
            if step not in tasks:
                tasks[step] = bar.add_task(step, total=None)
            bar.update(tasks[step], completed=done, total=of)

        yield advance


Line = tuple[bool, str]  # whether it is good news, and the words


def sent(
    client: "Client", files: Sequence[Path], terms: Mapping[str, Any], progress: Callable[[int], object]
) -> list[Line]:
    """The outcome of files sent at once: a line for each campaign, each remark and each refused recording.

    `terms` as `client.campaigns.post_files` takes them; `progress` is called with the number of bytes sent.
    """
    try:
        if terms["together"] is None and _is_export(files[0]):
            brought = client.skins.load(files[0], progress)
            return [(True, f"skin {brought['skin_id']}: {brought['kept']} campaigns, {brought['present']} were there")]
        results = results_of(client, files, {**terms, "progress": progress})
    except UnderskinError as error:
        return [(False, str(error))]
    except OSError as error:
        prefix = f"{error.filename} " if len(files) > 1 else ""
        return [(False, f"{prefix}cannot be opened: {error.strerror}")]
    return [line for result in results for line in outcome(client, result)]


def results_of(client: "Client", files: Sequence[Path], terms: Mapping[str, Any]) -> list["SentFile"]:
    """The service's answer to files, the same however often they are sent; raises UnderskinError, OSError."""
    from underskin.client.campaigns import content_key

    return client.campaigns.post_files(files, **terms, idempotency_key=content_key(files, terms))


def _is_export(file: Path) -> bool:
    """Whether a file was written by `export`, by its content."""
    from underskin.recordings.skin_export import is_export

    with file.open("rb") as opened:
        return is_export(opened, str(file))


def outcome(client: "Client", result: Mapping[str, Any]) -> list[Line]:
    """The outcome of one campaign: its id and d33, remarks, and refused recordings."""
    accepted = [recording for recording in result["recordings"] if recording["status"] == "ok"]
    lines = [(False, why_refused(error)) for error in result["errors"]]
    refusals = (
        (recording["id"], why_refused(error)) for recording in result["recordings"] for error in recording["errors"]
    )
    lines += [(False, f"{names} {reason}") for names, reason in grouped_by_reason(refusals)]
    lines += [(True, note) for note in result["notes"]]
    if result["status"] == "ok":
        count = f"{len(accepted)} recording{'s' if len(accepted) != 1 else ''}"
        figures, remarks = _figures(client, result["id"])
        before = ", was there" if result["repeated"] else ""
        lines.insert(0, (True, f"campaign {result['id']} of skin {result['skin_id']}{before}, {count}: {figures}"))
        lines += [(True, remark) for remark in remarks]
    return lines


def _figures(client: "Client", campaign_id: str) -> tuple[str, list[str]]:
    """d33 and moduli of a campaign in one line, and a line for each finding and each omission."""
    try:
        answer = client.campaigns.d33(campaign_id)
    except UnderskinError as error:  # the campaign is stored nevertheless
        return f"no d33: {error}", []
    moduli = [
        f"E of {modulus['recording']} {significant(modulus['youngs_modulus_mpa'], 4)} "
        f"± {significant(modulus['youngs_modulus_uncertainty_mpa'], 2)} MPa by its noise alone"
        for modulus in answer["moduli"]
    ]
    array = answer["array"]
    if array is not None:
        d33 = f"d33 {significant(array['d33_pc_per_n'], 3)} ± {significant(array['d33_uncertainty_pc_per_n'], 2)} pC/N"
    else:
        d33 = f"no d33: {answer['reason'] or 'every sensor is marked'}"
    results = moduli if moduli and answer["status"] == "none" else [d33, *moduli]
    remarks = [f"look at: {finding}" for finding in answer["findings"]]
    for omission in answer["left_out"]:
        of = "" if omission["recording"] is None else f"recording {omission['recording']}: "
        remarks.append(f"left out: {of}{omission['reason']}")
    return ", ".join(results), remarks


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
