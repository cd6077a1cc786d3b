"""Columns at the command line: from options and a CSV file into arrays, and back as CSV or as a table to read."""

import csv
import sys
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from underskin.errors import InvalidInput, UnderskinError
from underskin.findings.finding import Finding
from underskin.formatting import significant
from underskin.units import LAB, Floats

STANDARD_INPUT = "-"

# In words where there is room, as a symbol over a column.
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
    "charge_pc": ("charge Q", "Q"),
    "charge_error_pc": ("error of the charge", "Q ±"),
}
_NO_NAMES: Mapping[str, Sequence[str]] = {}
PIPED_WIDTH = 200  # of a table that goes into a file or a pipe


def gather(
    options: Mapping[str, Sequence[str] | None], defaults: Mapping[str, float], path: str | None
) -> dict[str, Floats]:
    """Every field of `options`, from its option, the CSV file at `path` (`-` is standard input) or its default.

    An option such as ["0.5,1", "2"] is a column of three; a single number has shape () and holds for all rows. Raises
    InvalidInput, or UnderskinError for a field that has no value.
    """
    in_file = {} if path is None else _from_csv(path, list(options))
    columns = {}
    for name, values in options.items():
        if values and name in in_file:
            raise InvalidInput(name, ",".join(values), f"is also a column of {path}; give it once")
        if values:
            columns[name] = _from_option(name, values)
        elif name in in_file:
            columns[name] = in_file[name]
        elif name in defaults:
            columns[name] = np.array(defaults[name])
        else:
            option = "--" + name.replace("_", "-")
            raise UnderskinError(f"{name} is missing: give {option}, or a column {name} in the CSV file of --input")
    return columns


def _from_option(name: str, values: Sequence[str]) -> Floats:
    numbers = _numbers(name, [cell for value in values for cell in value.split(",")])
    return numbers if numbers.size > 1 else numbers.reshape(())


def _from_csv(path: str, allowed: Sequence[str]) -> dict[str, Floats]:
    try:
        source = sys.stdin.fileno() if path == STANDARD_INPUT else path
        with open(source, encoding="utf-8-sig", newline="", closefd=path != STANDARD_INPUT) as file:
            lines = [line for line in csv.reader(file, strict=True) if line]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise InvalidInput("input", path, f"must be a readable CSV file ({reason})") from error
    if len(lines) < 2:
        raise InvalidInput("input", path, "must have a header of field names and at least one row")
    header = [name.strip() for name in lines[0]]
    if len(header) == 1 and any(separator in header[0] for separator in ";\t"):
        raise InvalidInput("input", path, "must separate cells by commas and write numbers with a point")
    for name in header:
        if name not in allowed or header.count(name) > 1:
            raise InvalidInput("input", path, f"has the column {name!r}; allowed, once each: {', '.join(allowed)}")
    for number, line in enumerate(lines[1:]):
        if len(line) != len(header):
            raise InvalidInput("input", path, f"has {len(line)} cells in row {number}, but {len(header)} in the header")
    return {name: _numbers(name, cells) for name, cells in zip(header, zip(*lines[1:], strict=True), strict=True)}


def rows(columns: Mapping[str, Floats]) -> int:
    """How many rows the columns have; raises InvalidInput that names two of different length."""
    long = {name: len(values) for name, values in columns.items() if values.ndim}
    first = next(iter(long), None)
    for name, count in long.items():
        if first is not None and count != long[first]:
            allowed = f"must have as many rows as {first} ({long[first]}), or be a single number"
            raise InvalidInput(name, f"{count} rows", allowed)
    return 1 if first is None else long[first]


def write_csv(
    columns: Mapping[str, Floats], inside: NDArray[np.bool_], count: int, names: Mapping[str, Sequence[str]] = _NO_NAMES
) -> None:
    """All columns and `status` as CSV on standard output, numbers in full, NaN where there is no value.

    `names`: columns of text, one a row, that go first.
    """
    full = [np.broadcast_to(values, (count,)).tolist() for values in columns.values()]
    cells = [["NaN" if number != number else repr(number) for number in numbers] for numbers in full]
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow([*names, *columns, "status"])
    writer.writerows(zip(*names.values(), *cells, map(status, np.broadcast_to(inside, (count,)).tolist()), strict=True))


def write_table(
    columns: Mapping[str, Floats], inside: NDArray[np.bool_], count: int, names: Mapping[str, Sequence[str]] = _NO_NAMES
) -> None:
    """What is the same in all rows as a list, the rest as a table, rounded to be read; `names` go first."""
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
        listed.add_row("status", status(bool(inside.flat[0])))
    console.print(listed)
    if count > 1:
        console.print(_rows_table(varying, np.broadcast_to(inside, (count,)), names))


def _rows_table(columns: Mapping[str, Floats], inside: NDArray[np.bool_], names: Mapping[str, Sequence[str]]) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=0)
    for name in names:
        table.add_column(name, overflow="fold")
    for name in columns:
        table.add_column(Text(f"{_NAMES[name][1]}\n{_unit(name)}"), justify="right", overflow="fold")
    table.add_column("status", overflow="fold")
    for number, row_inside in enumerate(inside.tolist()):
        texts = (Text(each[number]) for each in names.values())
        rounded = (_rounded(name, values[number]) for name, values in columns.items())
        table.add_row(*texts, *rounded, status(row_inside))
    return table


def say(findings: Sequence[Finding]) -> None:
    """What looks wrong and is used all the same, a line each on standard error."""
    for finding in findings:
        sys.stderr.write(f"underskin: look at {finding.field}: {finding.statement}\n")


def status(inside: bool) -> str:
    """The word for a row."""
    return "ok" if inside else "out_of_domain"


def _numbers(name: str, cells: Sequence[str]) -> Floats:
    numbers = np.empty(len(cells))
    for row, cell in enumerate(cells):
        try:
            numbers[row] = float(cell)
        except ValueError:
            raise InvalidInput(name, cell, "must be a number", index=row if len(cells) > 1 else None) from None
    return numbers


def _unit(name: str) -> str:
    return LAB[name].unit if name in LAB else ""


def _rounded(name: str, value: float) -> str:
    if value != value:
        return "-"
    return format(value, ".1e") if name == "rel_error" else significant(value, 5)
