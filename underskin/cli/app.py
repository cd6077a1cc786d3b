"""The command `underskin`: sigma, frf, d33 and stress from the shipped tables, and the commands of the other packages.

The other packages (the server, the table generator) hand in theirs through the entry-point group
`underskin.commands`. Nothing heavy is imported before a command needs it, so that `underskin --help` answers at once.
"""

import ast
import importlib.util
import sys
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from importlib.metadata import EntryPoint, entry_points
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from underskin.cli import changes, diagnose, mechanism, store, stored, stress, watch
from underskin.cli.rigs import EstimatorOption, RigOption
from underskin.errors import UnderskinError

if TYPE_CHECKING:
    from underskin.prediction.answers import ComputedColumns
    from underskin.surrogate.sigma_table import SigmaTable
    from underskin.units import Floats

COMMAND_GROUP = "underskin.commands"
_NOT_IN_IMAGE = ("prove",)
# The packages of the checkout that have commands, and the extra that each needs.
_EXTRAS = {"service": "server", "tablegen": "fem", "rig": None, "proof": "docs"}

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="markdown",  # in rich markup, [mm] would be a style
    help="Stress, FRF and d33 of piezoelectric electronic skin.",
)


class Body(StrEnum):
    """Which body carries the stress to the sensor."""

    LAYER = "layer"
    HALF_SPACE = "half_space"


def _column(meaning: str) -> object:
    return typer.Option(help=meaning, metavar="NUMBER,...", show_default=False)


# Columns of a skin pressed by a sphere, in the order in which they are written.
_PRESSED_SKIN = (
    *("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio", "indenter_radius_mm", "preload_n"),
)
_Given = list[str] | None
ThicknessMm = Annotated[_Given, _column("Thickness h of the layer over the sensors [mm].")]
YoungsModulusMpa = Annotated[_Given, _column("Young's modulus E of the layer [MPa].")]
SensorRadiusMm = Annotated[_Given, _column("Radius rT of a sensor [mm].")]
PoissonRatio = Annotated[_Given, _column("Poisson's ratio of the layer, 0.5 if left out; others are out_of_domain.")]
IndenterRadiusMm = Annotated[_Given, _column("Radius R of the sphere [mm].")]
PreloadN = Annotated[_Given, _column("Static force F [N].")]
Input = Annotated[
    str | None,
    typer.Option("--input", metavar="FILE", help="CSV file with columns named as the options (_ for -); - is stdin."),
]
Csv = Annotated[bool, typer.Option("--csv", help="Write CSV (inputs, results, status) instead of a table.")]
Files = Annotated[
    list[Path] | None, typer.Argument(help="Campaigns, or files as instruments write them; each is inverted by itself.")
]
Together = Annotated[
    str | None, typer.Option(metavar="NAME", help="Join the FILEs, all of one skin, into one campaign called NAME.")
]
Band = Annotated[
    str | None, typer.Option(metavar="LOW,HIGH", help="Average FILE from LOW to HIGH [Hz], not over its flat zone.")
]
Figures = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Write the figures of each FILE into DIR, as FILE.html.")
]
UnitsChecked = Annotated[
    bool, typer.Option("--units-checked", help="Accept magnitudes that look like a slip of units.")
]


@app.command(no_args_is_help=True)
def sigma(
    a_over_h: Annotated[_Given, _column("Contact radius over thickness.")] = None,
    rt_over_h: Annotated[_Given, _column("Sensor radius over thickness; 0 is a point sensor.")] = None,
    load_parameter: Annotated[_Given, _column("L = F/(R² E), 0 if left out: the linear layer.")] = None,
    model: Annotated[Body, typer.Option(help="The layer on a rigid base, or the half space.")] = Body.LAYER,
    input_file: Input = None,
    csv: Csv = False,
) -> None:
    """The stress transmission σ, from dimensionless numbers."""
    options = {"a_over_h": a_over_h, "rt_over_h": rt_over_h, "load_parameter": load_parameter}
    from underskin.prediction import answers

    defaults = {"load_parameter": 0.0}
    _answer(options, defaults, input_file, csv, lambda table, columns: answers.sigma(table, columns, model.value))


@app.command(no_args_is_help=True)
def frf(
    thickness_mm: ThicknessMm = None,
    youngs_modulus_mpa: YoungsModulusMpa = None,
    sensor_radius_mm: SensorRadiusMm = None,
    indenter_radius_mm: IndenterRadiusMm = None,
    preload_n: PreloadN = None,
    d33_pc_per_n: Annotated[_Given, _column("Piezoelectric coefficient d33 of the sensor [pC/N].")] = None,
    poisson_ratio: PoissonRatio = None,
    units_checked: UnitsChecked = False,
    input_file: Input = None,
    csv: Csv = False,
) -> None:
    """The FRF, charge over force, that a skin should show under a sphere."""
    given = locals()
    options = {name: given[name] for name in (*_PRESSED_SKIN, "d33_pc_per_n")}
    from underskin.prediction import answers

    defaults = {"poisson_ratio": 0.5}
    _answer(options, defaults, input_file, csv, lambda table, columns: answers.frf(table, columns, units_checked))


@app.command(no_args_is_help=True)
def d33(
    thickness_mm: ThicknessMm = None,
    youngs_modulus_mpa: YoungsModulusMpa = None,
    sensor_radius_mm: SensorRadiusMm = None,
    indenter_radius_mm: IndenterRadiusMm = None,
    preload_n: PreloadN = None,
    frf_pc_per_n: Annotated[_Given, _column("Measured FRF on the plateau, real part [pC/N].")] = None,
    frf_uncertainty_pc_per_n: Annotated[
        _Given, _column("Standard uncertainty of the measured FRF [pC/N]; without it d33 has none.")
    ] = None,
    poisson_ratio: PoissonRatio = None,
    units_checked: UnitsChecked = False,
    input_file: Input = None,
    csv: Csv = False,
    files: Files = None,
    rig: RigOption = None,
    estimator: EstimatorOption = None,
    band: Band = None,
    figures: Figures = None,
    together: Together = None,
) -> None:
    """The d33 of a sensor from its measured FRF, or of an array from files of its recordings.

    Files also tell the elastomer's modulus, where it was recorded on the same bench (compression, indentation).
    """
    given = locals()
    options = {name: given[name] for name in (*_PRESSED_SKIN, "frf_pc_per_n", "frf_uncertainty_pc_per_n")}
    if files:
        for_columns = [f"--{name.replace('_', '-')}" for name, values in options.items() if values]
        for_columns += [name for name, used in (("--input", input_file), ("--units-checked", units_checked)) if used]
        _refuse(for_columns, "is for columns; files say it themselves")
        from underskin.cli.invert_files import invert_files

        invert_files(files, rig, estimator, band, figures, together, csv)
        return
    only_files = ("rig", "estimator", "band", "figures", "together")
    for_files = [f"--{name}" for name in only_files if given[name] is not None]
    _refuse(for_files, "goes with FILE, and none is given")

    defaults: dict[str, float | None] = {"poisson_ratio": 0.5, "frf_uncertainty_pc_per_n": None}
    from underskin.prediction import answers

    _answer(options, defaults, input_file, csv, lambda table, columns: answers.d33(table, columns, units_checked))


def _refuse(options: Sequence[str], why: str) -> None:
    """Raise UnderskinError where any options are given."""
    if options:
        raise UnderskinError(f"{', '.join(options)} {why}")


def _answer(
    options: Mapping[str, _Given],
    defaults: Mapping[str, float | None],
    input_file: str | None,
    as_csv: bool,
    compute: "Callable[[SigmaTable, Mapping[str, Floats]], ComputedColumns]",
) -> None:
    """Gather the columns, compute, and write inputs and results."""
    from underskin.cli import columns
    from underskin.prediction.columns import rows
    from underskin.surrogate.sigma_table import load_table

    gathered, labels = columns.gather(options, defaults, input_file)
    count = rows(gathered)
    table = load_table()
    answer = compute(table, gathered)
    everything = {**gathered, **answer.columns}
    columns.write_findings(answer.findings)
    if as_csv:
        columns.write_csv(everything, answer.inside, count, labels)
    else:
        columns.write_table(everything, answer.inside, count, labels)
        if not answer.inside.all():
            typer.echo(f"The domain is {answer.domain}.")


app.command("stress", no_args_is_help=True)(stress.stress)
app.command("import", no_args_is_help=True)(store.import_files)
app.command("export", no_args_is_help=True)(store.export_skin)
app.command()(stored.campaigns)
app.command()(stored.skins)
for _command in (
    stored.history,
    changes.withdraw,
    changes.exclude,
    changes.correct,
    changes.join,
    changes.adopt,
    watch.watch,
):
    app.command(no_args_is_help=True)(_command)
diagnose.add_commands(app)
app.add_typer(mechanism.app, name="mechanism")


def _add_commands_of_other_packages() -> None:
    """Each becomes a command that loads the real one when called and hands over all its arguments."""
    raw = {
        "ignore_unknown_options": True,
        "allow_extra_args": True,
        "allow_interspersed_args": False,
        "help_option_names": [],
    }
    for entry in sorted(entry_points(group=COMMAND_GROUP), key=lambda entry: entry.name):
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
        raise typer.Exit(_run(loaded, context.args, context.command_path))

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


def _run(command: typer.Typer, arguments: Sequence[str], name: str) -> int:
    """Exit status; what goes wrong in the usage is raised."""
    return typer.main.get_command(command).main(list(arguments), prog_name=name, standalone_mode=False) or 0


def main() -> None:
    """Run the command line; an error is one line on stderr and exit status 2."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # some terminals cannot print σ
    _add_commands_of_other_packages()
    try:
        sys.exit(_run(app, sys.argv[1:], "underskin"))
    except (typer.TyperException, UnderskinError) as error:
        message = error.format_message() if isinstance(error, typer.TyperException) else str(error)
        if message:  # empty if the help was shown
            typer.echo(f"underskin: {message}", err=True)
        sys.exit(2)
    except typer.Abort:
        sys.exit(130)
