"""The command `underskin`: sigma, frf, d33 and stress from the shipped tables, and the commands of the other packages.

Heavy modules are imported when a command needs them, so that `underskin --help` answers at once. Commands of other
packages (the server, the table generator) are added by the entry points `underskin.commands`.
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

from underskin.cli import changes, diagnose, mechanism, reading, store, stored, stress, watch
from underskin.cli.rigs import Contact, ContactOption, EstimatorOption, RigOption
from underskin.errors import TableError, UnderskinError

if TYPE_CHECKING:
    from underskin.prediction.answers import ComputedColumns
    from underskin.surrogate.sigma_table import SigmaTable
    from underskin.units import Floats


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


app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="markdown",  # in rich markup, [mm] would be a style
    help="Stress, FRF and d33 of piezoelectric electronic skin.",
)


class Body(StrEnum):
    """The body that transmits the stress to the sensor."""

    LAYER = "layer"
    HALF_SPACE = "half_space"


def _column(meaning: str) -> object:
    return typer.Option(help=meaning, metavar="NUMBER,...", show_default=False)


# Columns of a skin pressed by a sphere, in the order in which they are written.
_PRESSED_SKIN = (
    *("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio", "indenter_radius_mm", "preload_n"),
)
_Numbers = list[str] | None
ThicknessMm = Annotated[_Numbers, _column("Thickness h of the layer over the sensors [mm].")]
YoungsModulusMpa = Annotated[_Numbers, _column("Young's modulus E of the layer [MPa].")]
SensorRadiusMm = Annotated[_Numbers, _column("Radius rT of a sensor [mm].")]
PoissonRatio = Annotated[_Numbers, _column("Poisson's ratio of the layer, 0.5 if left out; others are out_of_domain.")]
IndenterRadiusMm = Annotated[_Numbers, _column("Radius R of the sphere [mm].")]
PreloadN = Annotated[_Numbers, _column("Static force F [N].")]
Input = Annotated[
    str | None,
    typer.Option(
        "--input", metavar="FILE", help="CSV file or workbook with columns named as the options (_ for -); - is stdin."
    ),
]
Sheet = Annotated[
    str | None, typer.Option(metavar="NAME", help="Of --input, where a workbook has several sheets: which of them.")
]
Csv = Annotated[bool, typer.Option("--csv", help="Write CSV (inputs, results, limit, status) instead of a table.")]
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
    a_over_h: Annotated[_Numbers, _column("Contact radius over thickness.")] = None,
    rt_over_h: Annotated[_Numbers, _column("Sensor radius over thickness; 0 is a point sensor.")] = None,
    load_parameter: Annotated[_Numbers, _column("L = F/(R² E), 0 if left out: the linear layer.")] = None,
    model: Annotated[Body, typer.Option(help="The layer on a rigid base, or the half space.")] = Body.LAYER,
    input_file: Input = None,
    sheet: Sheet = None,
    csv: Csv = False,
) -> None:
    """The stress transmission σ, from dimensionless numbers."""
    options = {"a_over_h": a_over_h, "rt_over_h": rt_over_h, "load_parameter": load_parameter}
    from underskin.prediction import answers

    defaults = {"load_parameter": 0.0}
    _answer(
        options, defaults, (input_file, sheet), csv, lambda table, columns: answers.sigma(table, columns, model.value)
    )


@app.command(no_args_is_help=True)
def frf(
    thickness_mm: ThicknessMm = None,
    youngs_modulus_mpa: YoungsModulusMpa = None,
    sensor_radius_mm: SensorRadiusMm = None,
    indenter_radius_mm: IndenterRadiusMm = None,
    preload_n: PreloadN = None,
    d33_pc_per_n: Annotated[_Numbers, _column("Piezoelectric coefficient d33 of the sensor [pC/N].")] = None,
    poisson_ratio: PoissonRatio = None,
    contact: ContactOption = Contact.PAPER,
    units_checked: UnitsChecked = False,
    input_file: Input = None,
    sheet: Sheet = None,
    csv: Csv = False,
) -> None:
    """The FRF, charge over force, that a skin should show under a sphere."""
    arguments = locals()
    options = {name: arguments[name] for name in (*_PRESSED_SKIN, "d33_pc_per_n")}
    from underskin.prediction import answers
    from underskin.surrogate.solved_contact import contact_model

    def compute(table: "SigmaTable", columns: "Mapping[str, Floats]") -> "ComputedColumns":
        return answers.frf(contact_model(table, contact.value), columns, units_checked)

    _answer(options, {"poisson_ratio": 0.5}, (input_file, sheet), csv, compute)


@app.command(no_args_is_help=True)
def d33(
    thickness_mm: ThicknessMm = None,
    youngs_modulus_mpa: YoungsModulusMpa = None,
    sensor_radius_mm: SensorRadiusMm = None,
    indenter_radius_mm: IndenterRadiusMm = None,
    preload_n: PreloadN = None,
    frf_pc_per_n: Annotated[_Numbers, _column("Measured FRF on the plateau, real part [pC/N].")] = None,
    frf_uncertainty_pc_per_n: Annotated[
        _Numbers, _column("Standard uncertainty of the measured FRF [pC/N]; without it d33 has none.")
    ] = None,
    poisson_ratio: PoissonRatio = None,
    contact: ContactOption = Contact.PAPER,
    units_checked: UnitsChecked = False,
    input_file: Input = None,
    sheet: Sheet = None,
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
    arguments = locals()
    options = {name: arguments[name] for name in (*_PRESSED_SKIN, "frf_pc_per_n", "frf_uncertainty_pc_per_n")}
    if files:
        for_columns = [f"--{name.replace('_', '-')}" for name, values in options.items() if values]
        of_columns = (("--input", input_file), ("--sheet", sheet), ("--units-checked", units_checked))
        for_columns += [name for name, used in of_columns if used]
        _refuse(for_columns, "is for columns; files say it themselves")
        from underskin.cli.invert_files import invert_files

        invert_files(files, rig, estimator, band, figures, together, csv, contact.value)
        return
    only_files = ("rig", "estimator", "band", "figures", "together")
    for_files = [f"--{name}" for name in only_files if arguments[name] is not None]
    _refuse(for_files, "goes with FILE, and none is given")

    defaults: dict[str, float | None] = {"poisson_ratio": 0.5, "frf_uncertainty_pc_per_n": None}
    from underskin.prediction import answers
    from underskin.prediction.answers import other_contact
    from underskin.surrogate.solved_contact import contact_model

    def compute(table: "SigmaTable", columns: "Mapping[str, Floats]") -> "ComputedColumns":
        answer = answers.d33(contact_model(table, contact.value), columns, units_checked)
        d33_values = answer.columns["d33_pc_per_n"]
        try:
            other = other_contact(table, contact.value, columns, d33_values, units_checked=units_checked)
            sentence = other.sentence
        except TableError as error:
            sentence = f"d33 by the other contact is not known: {error}"
        if sentence:
            typer.echo(f"underskin: {sentence}", err=True)
        return answer

    _answer(options, defaults, (input_file, sheet), csv, compute)


def _refuse(options: Sequence[str], why: str) -> None:
    """Raise UnderskinError where any options are given."""
    if options:
        raise UnderskinError(f"{', '.join(options)} {why}")


def _answer(
    options: Mapping[str, _Numbers],
    defaults: Mapping[str, float | None],
    source: tuple[str | None, str | None],
    as_csv: bool,
    compute: "Callable[[SigmaTable, Mapping[str, Floats]], ComputedColumns]",
) -> None:
    """Gather the columns, compute, and write inputs and results; `source`: a file of columns, and its sheet."""
    from underskin.cli import columns
    from underskin.prediction.columns import rows
    from underskin.surrogate.sigma_table import load_table

    input_file, sheet = source
    if input_file is None:
        _refuse(["--sheet"] if sheet is not None else [], "goes with --input, and none is given")
    gathered, labels = columns.gather(options, defaults, input_file, sheet)
    count = rows(gathered)
    table = load_table()
    answer = compute(table, gathered)
    results = {**gathered, **answer.columns}
    columns.write_findings(answer.findings)
    if as_csv:
        columns.write_csv(results, answer.inside, answer.limits, count, labels)
    else:
        columns.write_table(results, answer.inside, answer.limits, count, labels)
        if not answer.inside.all():
            typer.echo(f"The domain is {answer.domain}.")


app.command("read", no_args_is_help=True)(reading.read)
app.command("stress", no_args_is_help=True)(stress.stress)
app.command("field", no_args_is_help=True)(stress.field)
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
    changes.annotate,
    changes.discard,
    changes.changes,
    changes.undo,
    watch.watch,
):
    app.command(no_args_is_help=True)(_command)
diagnose.add_commands(app)
app.add_typer(mechanism.app, name="mechanism")


def main() -> None:
    """Run the command line; an error is one line on stderr and exit status 2."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # some terminals cannot print σ
    add_commands(app)
    try:
        sys.exit(run(app, sys.argv[1:], "underskin"))
    except (typer.TyperException, UnderskinError) as error:
        message = error.format_message() if isinstance(error, typer.TyperException) else str(error)
        if message:  # empty if the help was shown
            typer.echo(f"underskin: {message}", err=True)
        sys.exit(2)
    except typer.Abort:
        sys.exit(130)
