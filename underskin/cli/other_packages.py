"""Commands that other packages (the server, the table generator) hand in by the entry points `underskin.commands`."""

import ast
import importlib.util
from collections.abc import Callable, Sequence
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

import typer

from underskin.errors import UnderskinError

_GROUP = "underskin.commands"
_NOT_IN_IMAGE = ("prove",)
# The packages of the checkout that have commands, and the extra that each needs.
_EXTRAS = {"service": "server", "tablegen": "fem", "rig": None, "proof": "docs"}


def add_commands(app: typer.Typer) -> None:
    """Add to `app` a command for each, which loads the real one when called and hands over all its arguments."""
    raw = {
        "ignore_unknown_options": True,
        "allow_extra_args": True,
        "allow_interspersed_args": False,
        "help_option_names": [],
    }
    for entry in sorted(entry_points(group=_GROUP), key=lambda entry: entry.name):
        app.command(entry.name, help=_summary(entry), context_settings=raw)(_forward(entry))


def _forward(entry: EntryPoint) -> Callable[[typer.Context], None]:
    def command(context: typer.Context) -> None:
        try:
            loaded = entry.load()
        except ImportError as error:
            raise UnderskinError(f"this command {_unavailable(entry, error)}") from error
        if not isinstance(loaded, typer.Typer):
            function, loaded = loaded, typer.Typer(add_completion=False)
            loaded.command(entry.name)(function)
        raise typer.Exit(run(loaded, context.args, context.command_path))

    return command


def _elsewhere(entry: EntryPoint) -> str:
    """Where a command runs whose package is not installed."""
    if _package(entry) not in _EXTRAS:
        return f"is not available: its module {entry.module} is missing"
    return "runs from a checkout" + ("" if entry.name in _NOT_IN_IMAGE else " or the image")


def _unavailable(entry: EntryPoint, error: ImportError) -> str:
    """Why a command cannot be loaded, and what to install."""
    if _package(entry) not in _EXTRAS:
        return f"is not available: its module {entry.module} cannot be imported ({error})"
    extra = _EXTRAS[_package(entry)]
    install = f"; in a checkout, pip install -e '.[{extra}]' installs what it needs" if extra else ""
    return f"{_elsewhere(entry)} ({error}){install}"


def _package(entry: EntryPoint) -> str:
    return entry.module.partition(".")[0]


def _summary(entry: EntryPoint) -> str:
    """First line of a command's help, read from its source, since to import a server takes a second."""
    try:
        specification = importlib.util.find_spec(entry.module)
    except ModuleNotFoundError:
        specification = None
    if specification is None or specification.origin is None:
        return f"({_elsewhere(entry)})"
    for node in ast.parse(Path(specification.origin).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef) and node.name == entry.attr:
            return (ast.get_docstring(node) or "").partition("\n")[0]
        if (
            isinstance(node, ast.Assign)
            and isinstance(node.value, ast.Call)
            and ast.unparse(node.targets[0]) == entry.attr
        ):
            return next((ast.literal_eval(word.value) for word in node.value.keywords if word.arg == "help"), "")
    return ""


def run(command: typer.Typer, arguments: Sequence[str], name: str) -> int:
    """Exit status; what goes wrong in the usage is raised."""
    return typer.main.get_command(command).main(list(arguments), prog_name=name, standalone_mode=False) or 0
