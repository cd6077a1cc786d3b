"""The commands `mechanism list`, `save` and `check`: mechanisms declared by the lab (`mechanism/1`)."""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from underskin.errors import InvalidInput, UnderskinError

if TYPE_CHECKING:
    from underskin.mechanisms.declared.mechanism import DeclaredMechanism

app = typer.Typer(add_completion=False, no_args_is_help=True, help="Mechanisms of the lab's own, kept in files.")


@app.command(name="list")
def list_() -> None:
    """All mechanisms, and where those come from that are not underskin's own; files that cannot be used, and why."""
    from underskin.mechanisms.registry import CATALOGUE

    for name, mechanism in CATALOGUE.items():
        source = CATALOGUE.packages.get(name, "")
        typer.echo(f"{name}{f' ({source})' if source else ''}: {mechanism.plain}")
    for error in CATALOGUE.refused:
        typer.echo(f"underskin: {error}", err=True)
    if CATALOGUE.refused:
        raise typer.Exit(2)


@app.command()
def check(files: Annotated[list[Path], typer.Argument(help="Files of mechanisms (mechanism/1, YAML).")]) -> None:
    """Whether files can be used; each that cannot is refused with its line and the reason."""
    failed = False
    for file in files:
        try:
            mechanism = _load(file)
        except UnderskinError as error:
            failed = True
            typer.echo(f"underskin: {error}", err=True)
        else:
            typer.echo(f"{file}: {mechanism.name} can be used {_on(mechanism)}")
    if failed:
        raise typer.Exit(2)


@app.command()
def save(
    report: Annotated[Path, typer.Argument(help="A report (report/1) that holds a law which nobody listed.")],
    name: Annotated[str, typer.Argument(help="What to call it: lower case letters, digits and _.")],
    description: Annotated[str | None, typer.Option(help="One sentence on what it is.")] = None,
    folder: Annotated[Path | None, typer.Option(help="Where to; that of UNDERSKIN_MECHANISMS if left out.")] = None,
) -> None:
    """Keep the law of a report as a mechanism, recognised by name in later campaigns."""
    from underskin.mechanisms.declared import saving
    from underskin.mechanisms.declared.document import FOLDER, parse
    from underskin.mechanisms.registry import CATALOGUE

    target = folder or (Path(os.environ[FOLDER]) if os.environ.get(FOLDER) else None)
    if target is None:
        raise UnderskinError(f"give --folder, or set {FOLDER}")
    if name in CATALOGUE:
        raise InvalidInput("name", name, "is taken by another mechanism")
    try:
        document = json.loads(report.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UnderskinError(f"{report}: cannot be read as a report: {error}") from error
    file = target / f"{name}.yaml"
    text = saving.document(document, name, description)
    parse(text.encode(), str(file))  # rejects an invalid name or text
    target.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    typer.echo(str(file))


def _on(mechanism: "DeclaredMechanism") -> str:
    """The recordings it acts on, with the columns of `conditions` that it reads, so that a misspelt name shows."""
    from underskin.mechanisms.unlisted.vocabulary import AXES

    column_names = [name for name in mechanism.axes if name not in AXES]
    columns = f", by {' and '.join(column_names)} of their conditions" if column_names else ""
    return ("on FRFs" if mechanism.acts_on_frfs else "on indentation curves") + columns


def _load(file: Path) -> "DeclaredMechanism":
    from underskin.mechanisms.declared.document import checked

    try:
        data = file.read_bytes()
    except OSError as error:
        raise UnderskinError(f"{file}: cannot be opened: {error.strerror}") from error
    return checked(data, str(file))
