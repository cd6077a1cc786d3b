"""Tables that instruments write as text: lines about the measurement, a line of headings, rows of numbers.

Rows are found by table.py, names and units by headings.py. Columns of text are left out with a warning. Lines above the
headings and under the numbers with a name and a value become properties, unless the name has two values. Where the
headings are repeated, a new block starts. Cells beside the units that hold values, as oscilloscopes write their time
base, are properties, and an increment there is the step of the samples. See Also csv_template.py, the template of this
package.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import BinaryIO

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import (
    Block,
    Channel,
    Contents,
    TextColumn,
    text_left_out,
    together,
    with_distinct_names,
)
from underskin.recordings.readers import headings, text
from underskin.recordings.readers import table as tables
from underskin.recordings.readers.headings import Headings
from underskin.recordings.readers.table import BLANKS, Lines, RowReader, Section, Table
from underskin.recordings.readers.unit_labels import labelled_unit, unit
from underskin.units import Floats

_STATED = re.compile(r"(?P<name>[^\W\d_][^:=\t;]*?)\s*[:=]\s*(?P<value>[^\s:=].*)")
_WITH_UNIT = re.compile(r"(?P<value>[-+]?[\d.,]+([eE][-+]?\d+)?)\s*(?P<unit>[^\s\d].*)")
_NAME_AND_UNIT = re.compile(r"(?P<name>[^,:=]+),\s*(?P<unit>[^,:=\s]+)\s*[:=]\s*(?P<value>[^\s:=].*)")  # X, um: 25
_MOST_TABLES = 100  # of a text
_STEP = re.compile(r"increment|interval", re.IGNORECASE)
_SEPARATOR_WORDS = {"\t": "tabs", ";": "semicolons", ",": "commas", BLANKS: "blanks"}
_DECIMAL_WORDS = {".": "points", ",": "commas"}
_SHOWN = 30  # letters of a cell in a message
_HEAD, _SAMPLED = 10_000, 50  # lines of the start of a long file, and of each later block, that determine its style


class NoTable(FileError):
    """A text without a table of numbers."""


def read(stream: BinaryIO, file: str) -> Contents:
    """The channels of a text table; raises FileError that names the line, NoTable where there is no table."""
    return of_text(text.content(stream, file), file)


def of_text(written: str, file: str) -> Contents:
    """The channels of a text with one table or several, with line feeds as line ends; raises as `read`.

    Another table begins below a blank line or a line of one cell, a title, with headings of its own.
    """
    read = _tables_in(written, file, _MOST_TABLES)
    return read[0][1] if len(read) == 1 else _together(read)


def _tables_in(written: str, file: str, most: int) -> list[tuple[str, Contents]]:
    """The tables of a text, each with its title; `most`: the tables that it may have."""
    reader, head, found = _reader(written, file)
    start, error = _end_of_table_above(head, found, reader.table, file), None
    if start is None:
        try:
            return [_read(reader, written, head, found, file)]
        except FileError as refused:
            error, start = refused, reader.sections[-1].last + 1 if reader.sections else 0
    if start and most > 1:
        first, rest = _cut(written, start)
        if _begins_table(rest, reader.table, file):
            above = _tables_in(first, file, most - 1)
            return [*above, *_tables_in("\n" * start + rest, file, most - len(above))]  # each line keeps its number
    if error is not None:
        raise error
    return [_read(reader, written, head, found, file)]


def _read(reader: RowReader, written: str, head: Sequence[str], found: Headings, file: str) -> tuple[str, Contents]:
    """The only table of a text, and the title nearest above its headings; empty without one."""
    reader.take_all(written)
    _refuse_other_rows(head[: reader.table.start], reader.under, reader.table, file)
    _refuse_text_among_numbers(reader, file)
    titles = [line.strip() for line in head[: min(found.lines, default=0)] if line.strip()]
    title = titles[-1].strip(reader.table.separator) if titles and _is_title(titles[-1], reader.table) else ""
    return title, _contents(reader, head, found)


def _is_title(line: str, table: Table) -> bool:
    """Whether a line is blank, or one cell of words."""
    return len(tables.split(line, table.separator)) < 2 and text.number(line.strip(), table.decimal) is None


def _end_of_table_above(head: Sequence[str], found: Headings, table: Table, file: str) -> int | None:
    """The line below the rows of a table of numbers alone, under names, above the headings of a table; None without
    one."""
    above = head[: min(found.lines, default=table.start)]
    other = tables.find(above) if len(above) > 2 else None
    if other is None or other.columns != tuple(range(other.width)):
        return None
    names = headings.find(above, other, file).lines
    if not names or _holds_numbers(above[min(names)], other):
        return None
    rows = [index for index in range(other.start, len(above)) if other.row(above[index]) is not None]
    return rows[-1] + 1


def _holds_numbers(line: str, table: Table) -> bool:
    return any(text.number(cell, table.decimal) is not None for cell in table.cells(line))


def _cut(written: str, line: int) -> tuple[str, str]:
    """The text above a line and from it on."""
    end = 0
    for _ in range(line):
        end = written.find("\n", end) + 1 or len(written)
    return written[:end], written[end:]


def _begins_table(written: str, table: Table, file: str) -> bool:
    """Whether a text that follows the rows of a table begins with a blank line or a title, and has a table below
    names."""
    if not _is_title(written.partition("\n")[0], table):
        return False
    try:
        reader, head, found = _reader(written, file)
    except FileError:
        return False
    return bool(found.lines) and not _holds_numbers(head[min(found.lines)], reader.table)


def _together(tables_read: Sequence[tuple[str, Contents]]) -> Contents:
    """The tables of a text as one, each with its title or number as the name of its blocks."""
    titles = [title for title, _ in tables_read]
    names = [
        title if title and titles.count(title) == 1 else str(number) for number, title in enumerate(titles, start=1)
    ]
    of_first = {key: value for _, contents in reversed(tables_read) for key, value in contents.properties.items()}
    held = together(dict(zip(names, (contents for _, contents in tables_read), strict=True)), "{}", "{1}")
    return replace(held, properties={**held.properties, **of_first})


def _reader(written: str, file: str) -> tuple[RowReader, Sequence[str], Headings]:
    """A reader of the table of a text, the lines at its start, and the table's headings."""
    head, table = _table(written, file)
    found = headings.find(head, table, file)
    return RowReader(table, frozenset(head[line].strip() for line in found.lines), file), head, found


def _contents(reader: RowReader, head: Sequence[str], found: Headings) -> Contents:
    """What a reader has read."""
    table, repeated = reader.table, reader.headings
    column_warnings = [*_text_column_warnings(reader, found), *_overload_warnings(reader, found)]
    above, *between, under = (
        [line for line in lines if line.strip() not in repeated]
        for lines in (
            head[: table.start],
            *([line for _, line in section.between] for section in reader.sections[1:]),
            [line for _, line in reader.under],
        )
    )
    properties, warnings = _properties([*above, *under], table)
    properties |= found.beside
    blocks = []
    first_row = 0
    for number, (section, section_lines) in enumerate(zip(reader.sections, [above, *between], strict=True), start=1):
        name = str(number) if len(reader.sections) > 1 else ""
        texts = _texts(reader, found, slice(first_row, first_row + section.count))
        first_row += section.count
        clocks = [clock for column in texts if (clock := _seconds_of(column)) is not None]
        channels = with_distinct_names([*_channels(table, found, section), *clocks])
        rate = _rate(found, table)
        blocks.append(Block(name, channels, rate, group_starts=section.group_starts, texts=texts))
        if name:
            section_properties, _ = _properties(section_lines, table)
            properties |= {f"{name}.{name_in_section}": value for name_in_section, value in section_properties.items()}
    return Contents(tuple(blocks), properties, (*warnings, *column_warnings), _layout(table, found, reader.sections))


def _table(written: str, file: str) -> tuple[Sequence[str], Table]:
    """The lines at the start, and the table whose rows start among them; the style of a long file follows from sampled
    lines."""
    blocks = text.blocks(written)
    _, first = next(blocks)
    head = first[:_HEAD]
    sample = [*first[_HEAD:][-_SAMPLED:], *(line for _, block in blocks for line in block[:_SAMPLED])]
    table = tables.find([*head, *sample])
    if sample and (table is None or table.start >= len(head)):
        head = written.split("\n")
        table = tables.find(head)
    if table is None:
        raise NoTable(file, "", _no_table(head))
    return head, table


def _no_table(lines: Sequence[str]) -> str:
    """The message that there is no table, and what the text holds instead."""
    most, index = tables.most_numbers(lines)
    line = next(number for number, line in enumerate(lines) if line.strip() or number == len(lines) - 1)
    example = (
        f"line {index + 1} holds most, {most}: {lines[index][:_SHOWN]!r}"
        if most
        else f"no line holds any; line {line + 1} is {lines[line][:_SHOWN]!r}"
    )
    return f"holds no table, two rows of at least two numbers each: {example}; names go into the CSV template"


def _channels(table: Table, found: Headings, section: Section) -> list[Channel]:
    names = [found.names[column] for column in table.columns]
    columns = section.columns(table)
    return [Channel(*name, column) for name, column in zip(names, columns, strict=True)]


def _rate(found: Headings, table: Table) -> float | None:
    """Samples a second by the increment that is stated beside the names."""
    for name, value in found.beside.items():
        step, label = text.number(value, table.decimal), unit(labelled_unit(name) or "s")
        if _STEP.search(name) and step and step > 0 and label is not None and label.dimension == "time":
            return 1 / (step * label.to_si)
    return None


def _refuse_other_rows(above: Sequence[str], under: Lines, table: Table, file: str) -> None:
    """Reject numbers under the rows, and rows above them with separated thousands: they would be lost."""
    for index, line in under:
        first = line.strip().partition(table.separator)[0].strip().strip('"')
        if text.number(first, table.decimal) is not None:
            raise tables.no_row(index, line, table, file)
    for index, line in enumerate(above):
        cells = [cell.replace(",", "") if text.is_grouped(cell) else cell for cell in table.cells(line)]
        if len(cells) > max(table.columns) and all(text.number(cell, table.decimal) is not None for cell in cells):
            raise tables.no_row(index, line, table, file)


def _refuse_text_among_numbers(reader: RowReader, file: str) -> None:
    """Raise FileError where a column of text holds numbers in most rows."""
    for seen in reader.texts.values():
        if seen.first is not None and seen.count < reader.count / 2:
            raise tables.no_row(*seen.first, reader.table, file)


def _text_column_warnings(reader: RowReader, found: Headings) -> Iterator[str]:
    """Messages on columns of too many texts, and of numbers with blank cells."""
    for column, seen in reader.texts.items():
        name, numbers = found.names[column][0], reader.count - seen.count
        if seen.example and not seen.kept:
            yield text_left_out(name, seen.example)
        elif not seen.example and numbers and name != f"column {column + 1}":
            of_rows = f"{numbers} of {reader.count} rows"
            advice = "fill its blank cells (those at its end may be empty)"
            yield f"column {name!r} has a number in {of_rows}, and is left out: {advice}"


def _texts(reader: RowReader, found: Headings, rows: slice) -> tuple[TextColumn, ...]:
    """The columns of words in these of all rows."""
    return tuple(
        TextColumn(
            found.names[column][0],
            tuple(text.with_day_first(words.texts, reader.table.decimal)),
            np.array(words.codes[rows], dtype=np.intp),
        )
        for column, words in reader.texts.items()
        if words.kept and words.example
    )


def _overload_warnings(reader: RowReader, found: Headings) -> Iterator[str]:
    """Messages on values that an instrument marked as beyond its range."""
    for column, seen in reader.overloads.items():
        assert seen.first is not None
        cells = f"{seen.count} cells of column {found.names[column][0]!r} hold {seen.example[:_SHOWN]!r}"
        first = f"the first on line {seen.first[0] + 1}"
        yield f"{cells}, {first}: overloads, which are no numbers and are left out"


def _layout(table: Table, found: Headings, sections: Sequence[Section]) -> str:
    """How the file was read, in words."""
    first, last = sections[0].first + 1, sections[-1].last + 1
    numbers = f"rows of {len(table.columns)} numbers from line {first} to {last}"
    written = f"separated by {_SEPARATOR_WORDS[table.separator]}, with decimal {_DECIMAL_WORDS[table.decimal]}"
    if not found.lines:
        return f"{numbers}, {written}; no names above them"
    names, *units = [line + 1 for line in found.lines]
    return f"{numbers}, {written}; names from line {names}" + "".join(f", units from line {line}" for line in units)


def _properties(lines: Iterable[str], table: Table) -> tuple[dict[str, str | float], list[str]]:
    """The properties in lines that hold a name and a value, as written; and messages on names with two values."""
    values: dict[str, list[str]] = {}
    for line in lines:
        stated = _stated(tables.uncommented(line).strip(), table)
        if stated is not None:
            values.setdefault(stated[0], []).extend(text.with_day_first(stated[1:], table.decimal))
    different = {name: list(dict.fromkeys(given)) for name, given in values.items()}
    doubts = [
        f"{name!r} is given as {given[0]!r} and as {given[1]!r}: neither is used"
        for name, given in different.items()
        if len(given) > 1
    ]
    return {name: given[0] for name, given in different.items() if len(given) == 1}, doubts


def _stated(line: str, table: Table) -> tuple[str, str] | None:
    """The name and the value in a line, as cells or separated by a colon or =; a unit after the value is moved to the
    name. A comma may stand in a name before its unit: `Force constant, nN/nm: 1.0`."""
    pair = _NAME_AND_UNIT.fullmatch(line)
    if pair is not None and unit(pair["unit"]) is not None:
        return f"{pair['name'].strip()}, {pair['unit']}", pair["value"].strip().strip('"')
    separators = (table.separator, "\t", ";", *([","] if table.decimal == "." else []))
    for separator in dict.fromkeys(separators):
        cells = tables.split(line, separator) if separator != BLANKS else []
        match [cell for cell in cells if cell]:
            case [name, value] if cells[0] == name:
                return _with_its_unit(name.rstrip(":= "), value)
            case [name, value, label] if cells[0] == name and unit(label) is not None:
                return _with_its_unit(name.rstrip(":= "), f"{value} {label}")
            case [_, _, *_]:
                return None
    pair = _STATED.fullmatch(line)
    return None if pair is None else _with_its_unit(pair["name"], pair["value"].strip('"'))


def _with_its_unit(name: str, value: str) -> tuple[str, str]:
    parts = _WITH_UNIT.fullmatch(value)
    if parts is None or unit(parts["unit"]) is None:
        return name, value
    return f"{name} ({parts['unit']})", parts["value"]


_CLOCK = re.compile(
    r"(?P<day>\D*\d[^:]*[ T])?(?P<hour>\d{1,3}):(?P<minute>[0-5]?\d):(?P<second>[0-5]?\d(?:[.,]\d+)?)"
    r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?(?:Z|[+-]\d\d:?\d\d)?"
)
_DAY_S, _HALF_DAY_H = 86_400.0, 12
_TICKING = 0.5  # least share of rows with a time of their own, unlike that of a recording


def _seconds_of(column: TextColumn) -> Channel | None:
    """The clock times of a column, such as `00:01:05.250` or `2026-05-03 09:00:01.2`, after its first row [s]; None
    where a cell holds something else, where most times repeat, or where they do not rise. A day begins where the clock
    falls; where dates stand beside it, they must change there and only there.
    """
    if len(column.texts) < max(2, _TICKING * len(column.codes)):
        return None
    matches = [_CLOCK.fullmatch(text.strip()) for text in column.texts]
    if not all(matches):
        return None
    found = [match for match in matches if match is not None]
    clock = np.array([_seconds(match) for match in found])[column.codes]
    days: dict[str, int] = {}
    day = np.array([days.setdefault((match["day"] or "").strip(" T"), len(days)) for match in found])[column.codes]
    falls = np.diff(clock) < 0
    if days.keys() != {""} and not np.array_equal(falls, np.diff(day) != 0):
        return None
    time: Floats = clock + _DAY_S * np.concatenate([[0], np.cumsum(falls)]) - clock[0]
    is_midnight = (-np.diff(clock)[falls] > _DAY_S / 2).all()
    return Channel(column.name, "s", time) if is_midnight else None


def _seconds(match: re.Match[str]) -> float:
    hour, half = int(match["hour"]), (match["half"] or "").lower()
    if half:
        hour = hour % _HALF_DAY_H + (_HALF_DAY_H if half == "p" else 0)
    return 3600.0 * hour + 60.0 * int(match["minute"]) + float(match["second"].replace(",", "."))
