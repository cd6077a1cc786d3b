"""Commands of other packages (the server, the table generator), added by the entry points `underskin.commands`."""

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
    """Add a command for each entry point; it loads the real command when called and passes on all arguments."""
    raw = {
        "ignore_unknown_options": True,
        "allow_extra_args": True,
        "allow_interspersed_args": False,
        "help_option_names": [],
    }
    for entry_point in sorted(entry_points(group=_GROUP), key=lambda entry_point: entry_point.name):
        app.command(entry_point.name, help=_summary(entry_point), context_settings=raw)(_forward(entry_point))


def _forward(entry_point: EntryPoint) -> Callable[[typer.Context], None]:
    def command(context: typer.Context) -> None:
        try:
            loaded = entry_point.load()
        except ImportError as error:
            raise UnderskinError(f"this command {_unavailable(entry_point, error)}") from error
        if not isinstance(loaded, typer.Typer):
            function, loaded = loaded, typer.Typer(add_completion=False)
            loaded.command(entry_point.name)(function)
        raise typer.Exit(run(loaded, context.args, context.command_path))

    return command


def _elsewhere(entry_point: EntryPoint) -> str:
    """Where a command runs whose package is not installed."""
    if _package(entry_point) not in _EXTRAS:
        return f"is not available: its module {entry_point.module} is missing"
    return "runs from a checkout" + ("" if entry_point.name in _NOT_IN_IMAGE else " or the image")


def _unavailable(entry_point: EntryPoint, error: ImportError) -> str:
    """Why a command cannot be loaded, and what to install."""
    if _package(entry_point) not in _EXTRAS:
        return f"is not available: its module {entry_point.module} cannot be imported ({error})"
    extra = _EXTRAS[_package(entry_point)]
    install = f"; in a checkout, pip install -e '.[{extra}]' installs what it needs" if extra else ""
    return f"{_elsewhere(entry_point)} ({error}){install}"


def _package(entry_point: EntryPoint) -> str:
    return entry_point.module.partition(".")[0]


def _summary(entry_point: EntryPoint) -> str:
    """First line of a command's help, read from its source, since importing a server takes a second."""
    try:
        specification = importlib.util.find_spec(entry_point.module)
    except ModuleNotFoundError:
        specification = None
    if specification is None or specification.origin is None:
        return f"({_elsewhere(entry_point)})"
    for node in ast.parse(Path(specification.origin).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef) and node.name == entry_point.attr:
            return (ast.get_docstring(node) or "").partition("\n")[0]
        if (
            isinstance(node, ast.Assign)
            and isinstance(node.value, ast.Call)
            and ast.unparse(node.targets[0]) == entry_point.attr
        ):
            return next((ast.literal_eval(word.value) for word in node.value.keywords if word.arg == "help"), "")
    return ""


def run(command: typer.Typer, arguments: Sequence[str], name: str) -> int:
    """The exit status; usage errors are raised."""
    return typer.main.get_command(command).main(list(arguments), prog_name=name, standalone_mode=False) or 0
