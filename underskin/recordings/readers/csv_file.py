"""Tables that instruments write as text: some lines about the measurement, a line of headings, rows of numbers.

The rows and the headings are found by table_rows.py and table_headings.py. Headings name the channels and, in brackets
or behind the last underscore, their units. Columns of text are left out, with a warning. Lines above the headings and
under the numbers that hold a name and a value become properties, unless the name has two values. Where the headings
come again, what follows is a part of its own. A cell in quotes may hold the separator. See Also csv_template.py, our
own table.
"""

import re
from collections.abc import Iterable, Sequence
from typing import BinaryIO

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import Block, Channel, Contents, with_distinct_names
from underskin.recordings.readers import table_headings, table_rows, text
from underskin.recordings.readers.table_headings import Headings
from underskin.recordings.readers.table_rows import BLANKS, Section, Table
from underskin.recordings.readers.unit_labels import unit

_STATED = re.compile(r"(?P<name>[^\W\d_][^:=\t;]*?)\s*[:=]\s*(?P<value>[^\s:=].*)")
_WITH_UNIT = re.compile(r"(?P<value>[-+]?[\d.,]+([eE][-+]?\d+)?)\s*(?P<unit>[^\s\d].*)")
_SEPARATOR_WORDS = {"\t": "tabs", ";": "semicolons", ",": "commas", BLANKS: "blanks"}
_DECIMAL_WORDS = {".": "points", ",": "commas"}
_SHOWN = 30  # letters of a cell in a message


def read(stream: BinaryIO, file: str) -> Contents:
    """The channels of a text table; raises FileError that names the line."""
    lines = text.lines(text.content(stream, file))
    table = table_rows.find(lines)
    if table is None:
        raise FileError(
            file,
            "",
            "holds no table of numbers alone, of at least two columns and two rows; names go into the CSV template",
        )
    headings = table_headings.find(lines, table, file)
    repeated = frozenset(lines[line].strip() for line in headings.lines)
    sections = table_rows.sections(lines, table, repeated, file)
    _refuse_other_rows(lines, table, sections[-1].lines[-1] + 1, file)
    left_out = _left_out(lines, table, headings, sections, file)
    above, *between, under = _about(lines, sections, headings)
    properties, warnings = _properties([*above, *under], table)
    blocks = []
    for number, (section, own) in enumerate(zip(sections, [above, *between], strict=True), start=1):
        name = str(number) if len(sections) > 1 else ""
        blocks.append(Block(name, _channels(table, headings, section), group_starts=section.group_starts))
        if name:
            told, _ = _properties(own, table)
            properties |= {f"{name}.{of}": value for of, value in told.items()}
    return Contents(tuple(blocks), properties, (*warnings, *left_out), _layout(table, headings, sections))


def _channels(table: Table, headings: Headings, section: Section) -> tuple[Channel, ...]:
    columns = np.array(section.rows, dtype=np.float64).T.copy()
    names = [headings.names[column] for column in table.columns]
    return with_distinct_names([Channel(*name, column) for name, column in zip(names, columns, strict=True)])


def _refuse_other_rows(lines: Sequence[str], table: Table, end: int, file: str) -> None:
    """Refuses numbers under the rows, and rows above them with thousands apart: they would be lost."""
    for index in range(end, len(lines)):
        first = lines[index].strip().partition(table.separator)[0].strip().strip('"')
        if text.number(first, table.decimal) is not None:
            raise table_rows.no_row(lines, index, table, file)
    for index in range(table.start):
        cells = [cell.replace(",", "") if text.is_grouped(cell) else cell for cell in table.cells(lines[index])]
        if len(cells) == table.width and all(text.number(cell, table.decimal) is not None for cell in cells):
            raise table_rows.no_row(lines, index, table, file)


def _left_out(
    lines: Sequence[str], table: Table, headings: Headings, sections: Sequence[Section], file: str
) -> list[str]:
    """In words, the columns that hold text; raises FileError where one holds numbers in most rows."""
    if len(table.columns) == table.width:
        return []
    rows = [line for section in sections for line in section.lines]
    texts: dict[int, list[tuple[int, str]]] = {
        column: [] for column in range(table.width) if column not in table.columns
    }
    for line in rows:
        cells = table.cells(lines[line])
        for column, found in texts.items():
            cell = cells[column] if column < len(cells) else ""
            if text.number(cell, table.decimal) is None:
                found.append((line, cell))
    warnings = []
    for column, found in texts.items():
        if len(found) < len(rows) / 2:
            raise table_rows.no_row(lines, found[0][0], table, file)
        example = next((cell for _, cell in found if cell), "")
        if example:
            name = headings.names[column][0]
            warnings.append(f"column {name!r} holds text, such as {example[:_SHOWN]!r}, and is left out")
    return warnings


def _about(lines: Sequence[str], sections: Sequence[Section], headings: Headings) -> list[list[str]]:
    """The lines above the first section, between each and the next, and under the last, without the headings."""
    repeated = {lines[line].strip() for line in headings.lines}
    starts = [section.lines[0] for section in sections]
    ends = [section.lines[-1] + 1 for section in sections]
    edges = zip([0, *ends], [*starts, len(lines)], strict=True)
    return [[line for line in lines[start:end] if line.strip() not in repeated] for start, end in edges]


def _layout(table: Table, headings: Headings, sections: Sequence[Section]) -> str:
    """How the file was read, in words."""
    first, last = sections[0].lines[0] + 1, sections[-1].lines[-1] + 1
    numbers = f"rows of {len(table.columns)} numbers from line {first} to {last}"
    written = f"separated by {_SEPARATOR_WORDS[table.separator]}, with decimal {_DECIMAL_WORDS[table.decimal]}"
    if not headings.lines:
        return f"{numbers}, {written}; no names above them"
    names, *units = [line + 1 for line in headings.lines]
    return f"{numbers}, {written}; names from line {names}" + "".join(f", units from line {line}" for line in units)


def _properties(lines: Iterable[str], table: Table) -> tuple[dict[str, str | float], list[str]]:
    """What lines that hold a name and a value say, a number as text, as written; and which have two values."""
    values: dict[str, list[str]] = {}
    for line in lines:
        stated = _stated(table_rows.uncommented(line).strip(), table)
        if stated is not None:
            values.setdefault(stated[0], []).append(stated[1])
    twice = {name: different for name, said in values.items() if len(different := list(dict.fromkeys(said))) > 1}
    doubts = [
        f"{name!r} is given as {one!r} and as {other!r}: neither is used" for name, (one, other, *_) in twice.items()
    ]
    return {name: said[0] for name, said in values.items() if name not in twice}, doubts


def _stated(line: str, table: Table) -> tuple[str, str] | None:
    """The name and the value that a line holds, as cells or with a colon or = between them; a unit behind the value
    goes to the name."""
    for separator in dict.fromkeys([table.separator, "\t", ";", *([","] if table.decimal == "." else [])]):
        cells = table_rows.split(line, separator) if separator != BLANKS else []
        match [cell for cell in cells if cell]:
            case [name, value] if cells[0] == name:
                return _with_its_unit(name.rstrip(":= "), value)
            case [name, value, label] if cells[0] == name and unit(label) is not None:
                return _with_its_unit(name.rstrip(":= "), f"{value} {label}")
            case [_, _, *_]:
                return None
    told = _STATED.fullmatch(line)
    return None if told is None else _with_its_unit(told["name"], told["value"].strip('"'))


def _with_its_unit(name: str, value: str) -> tuple[str, str]:
    told = _WITH_UNIT.fullmatch(value)
    if told is None or unit(told["unit"]) is None:
        return name, value
    return f"{name} ({told['unit']})", told["value"]
