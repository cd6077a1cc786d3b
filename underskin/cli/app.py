"""The command `underskin`: sigma, frf, d33 and stress from the shipped tables, and the commands of the other packages.

Heavy modules are imported when a command needs them, so that `underskin --help` answers at once.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from underskin.cli import annotations, changes, diagnose, field, mechanism, other_packages, store, stored, stress, watch
from underskin.cli.contact_option import Contact, ContactOption
from underskin.cli.rigs import EstimatorOption, RigOption
from underskin.errors import TableError, UnderskinError

if TYPE_CHECKING:
    from underskin.prediction.answers import ComputedColumns
    from underskin.surrogate.sigma_table import SigmaTable
    from underskin.units import Floats

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


app.command("stress", no_args_is_help=True)(stress.stress)
app.command("field", no_args_is_help=True)(field.field)
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
    annotations.annotate,
    annotations.discard,
    annotations.changes,
    annotations.undo,
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
    other_packages.add_commands(app)
    try:
        sys.exit(other_packages.run(app, sys.argv[1:], "underskin"))
    except (typer.TyperException, UnderskinError) as error:
        message = error.format_message() if isinstance(error, typer.TyperException) else str(error)
        if message:  # empty if the help was shown
            typer.echo(f"underskin: {message}", err=True)
        sys.exit(2)
    except typer.Abort:
        sys.exit(130)
