"""Columns at the command line: from options and a CSV file to arrays, and back to CSV or a table."""

import sys
from collections.abc import Mapping, Sequence

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from underskin.errors import (
    ErrorCode,
    FileError,
    InvalidInput,
    UnderskinError,
    conflicting,
    not_unique,
    unreadable,
    wrong_type,
)
from underskin.findings.finding import Finding
from underskin.findings.formatting import significant
from underskin.prediction.columns import CsvError, from_csv, limits_and_statuses, statuses, to_csv
from underskin.prediction.pressed_skin import Words
from underskin.recordings.readers.formats import ZIP
from underskin.recordings.readers.template_columns import misspelt
from underskin.recordings.reading import sheet_text
from underskin.units import LAB, Floats, Mask

STANDARD_INPUT = "-"

# The name in a list, and the symbol over a column.
_NAMES = {
    "thickness_mm": ("thickness h", "h"),
    "youngs_modulus_mpa": ("Young's modulus E", "E"),
    "sensor_radius_mm": ("sensor radius rT", "rT"),
    "poisson_ratio": ("Poisson's ratio ν", "ν"),
    "indenter_radius_mm": ("indenter radius R", "R"),
    "preload_n": ("preload F", "F"),
    "contact_radius_mm": ("contact radius a", "a"),
    "a_over_h": ("a/h", "a/h"),
    "rt_over_h": ("rT/h", "rT/h"),
    "load_parameter": ("load parameter L", "L"),
    "sigma": ("σ", "σ"),
    "rel_error": ("relative error of σ", "error"),
    "mean_stress_mpa": ("mean stress", "stress"),
    "frf_pc_per_n": ("FRF", "FRF"),
    "frf_uncertainty_pc_per_n": ("FRF uncertainty", "FRF ±"),
    "d33_pc_per_n": ("d33", "d33"),
    "d33_uncertainty_pc_per_n": ("d33 uncertainty", "d33 ±"),
    "x_mm": ("sensor x", "x"),
    "y_mm": ("sensor y", "y"),
    "section_error": ("relative error of σzz inside", "error inside"),
    "r_mm": ("distance from the axis r", "r"),
    "sigma_zz_mpa": ("σzz on the base", "σzz on the base"),
    "charge_pc": ("charge Q", "Q"),
    "charge_error_pc": ("error of the charge", "Q ±"),
}
_NO_NAMES: Mapping[str, Sequence[str]] = {}
PIPED_WIDTH = 200  # of a table that goes into a file or a pipe


def gather(
    options: Mapping[str, Sequence[str] | None],
    defaults: Mapping[str, float | None],
    path: str | None,
    sheet: str | None = None,
) -> tuple[dict[str, Floats], dict[str, list[str]]]:
    """Every field of `options`, from its option, the CSV file at `path` (`-` is standard input), a workbook's `sheet`,
    or its default; one whose default is None may be left out. Then the file's columns of text.

    An option such as ["0.5,1", "2"] is a column of three; a single number has shape () and applies to all rows.
    Raises InvalidInput, or UnderskinError for a field without a value.
    """
    in_file, labels = ({}, {}) if path is None else _from_csv(path, sheet, list(options))
    columns = {}
    for name, values in options.items():
        if values and name in in_file:
            raise not_unique(name, ",".join(values), f"is also a column of {path}; give it once")
        if values:
            columns[name] = _numbers(name, [cell for value in values for cell in value.split(",")])
        elif name in in_file:
            columns[name] = in_file[name]
        elif name in defaults:
            if defaults[name] is not None:
                columns[name] = np.array(defaults[name])
        else:
            option = "--" + name.replace("_", "-")
            raise UnderskinError(f"{name} is missing: give {option}, or a column {name} in the CSV file of --input")
    return columns, labels


def _from_csv(path: str, sheet: str | None, allowed: Sequence[str]) -> tuple[dict[str, Floats], dict[str, list[str]]]:
    try:
        table = from_csv(_content(path, sheet), allowed)
    except OSError as error:
        raise unreadable("input", path, f"must be a readable CSV or .xlsx file ({error.strerror})") from error
    except FileError as error:
        raise error.of_field("input", path) from None
    except CsvError as error:
        raise unreadable("input", path, str(error)) from error
    for name in table.unknown:
        suggestion = misspelt(name, allowed)
        guess = f"did you mean {suggestion}? Allowed" if suggestion else "allowed"
        words = f"has the column {name!r}; {guess}, once each: {', '.join(allowed)}"
        raise InvalidInput("input", path, words, code=ErrorCode.UNKNOWN_FIELD)
    for note in table.notes:
        sys.stderr.write(f"underskin: {note}\n")
    return {name: np.array(column.numbers(name)) for name, column in table.fields.items()}, table.labels


def _content(path: str, sheet: str | None) -> bytes:
    """The bytes of a CSV file, or of a workbook's sheet as CSV: the named one, or the only one."""
    source = sys.stdin.fileno() if path == STANDARD_INPUT else path
    with open(source, "rb", closefd=path != STANDARD_INPUT) as file:
        content = file.read()
    if content.startswith(ZIP):
        return sheet_text(content, path, sheet).encode()
    if sheet is not None:
        raise conflicting("sheet", sheet, f"must be left out: {path} is no workbook")
    return content


def write_csv(
    columns: Mapping[str, Floats],
    inside: Mask,
    limits: Words | None,
    count: int,
    names: Mapping[str, Sequence[str]] = _NO_NAMES,
) -> None:
    """All columns, `limit` and `status` as CSV on standard output, numbers in full, NaN for missing values.

    `names`: columns of text, one per row, that come first; `limits`: the limit that each row outside the domain
    exceeds.
    """
    full = {name: np.broadcast_to(values, (count,)) for name, values in columns.items()}
    sys.stdout.write(to_csv({**names, **full, **limits_and_statuses(inside, limits, count)}, "\n"))


def write_table(
    columns: Mapping[str, Floats],
    inside: Mask,
    limits: Words | None,
    count: int,
    names: Mapping[str, Sequence[str]] = _NO_NAMES,
) -> None:
    """Constant columns as a list, the others as a table, rounded; `names` come first."""
    console = Console(highlight=False, width=None if sys.stdout.isatty() else PIPED_WIDTH)
    varying = {name: values for name, values in columns.items() if values.size > 1 and np.unique(values).size > 1}
    listed = Table.grid(padding=(0, 2))
    if count == 1:
        for name, (text,) in names.items():
            listed.add_row(name, Text(text))
    for name, values in columns.items():
        if name not in varying:
            listed.add_row(_NAMES[name][0], _rounded(name, float(values.flat[0])), _unit(name))
    if count == 1:
        listed.add_row("status", *_statuses(inside.flat[:1], limits, 1))
    console.print(listed)
    if count > 1:
        console.print(_rows_table(varying, _statuses(inside, limits, count), names))


def _statuses(inside: Mask, limits: Words | None, count: int) -> list[str]:
    """The status of each row, with the limit that it exceeds."""
    pairs = zip(statuses(inside, count), limits or [None] * count, strict=True)
    return [f"{status}: {limit}" if limit else status for status, limit in pairs]


def _rows_table(columns: Mapping[str, Floats], status: Sequence[str], names: Mapping[str, Sequence[str]]) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=0)
    for name in names:
        table.add_column(name, overflow="fold")
    for name in columns:
        table.add_column(Text(f"{_NAMES[name][1]}\n{_unit(name)}"), justify="right", overflow="fold")
    table.add_column("status", overflow="fold")
    for number, row_status in enumerate(status):
        texts = (Text(labels[number]) for labels in names.values())
        rounded = (_rounded(name, values[number]) for name, values in columns.items())
        table.add_row(*texts, *rounded, row_status)
    return table


def write_findings(findings: Sequence[Finding]) -> None:
    """Write findings to standard error, a line each."""
    for finding in findings:
        sys.stderr.write(f"underskin: look at {finding.field}: {finding.statement}\n")


def _numbers(name: str, cells: Sequence[str]) -> Floats:
    """The numbers (cells,) of an option; of a single one its shape is ()."""
    numbers = np.empty(len(cells))
    for row, cell in enumerate(cells):
        try:
            numbers[row] = float(cell)
        except ValueError:
            raise wrong_type(name, cell, index=row if len(cells) > 1 else None) from None
    return numbers if numbers.size > 1 else numbers.reshape(())


def _unit(name: str) -> str:
    return LAB[name].unit if name in LAB else ""


def _rounded(name: str, value: float) -> str:
    if value != value:
        return "-"
    return format(value, ".1e") if name == "rel_error" else significant(value, 5)
