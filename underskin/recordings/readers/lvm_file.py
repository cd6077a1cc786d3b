"""LabVIEW measurement files (LVM), text: a header, then segments of channels.

Each acquisition is a block: a segment, or, where a segment goes on after its stated number of samples, each run of that
many. Comments at the ends of rows are left out. Source of the format: "Specification for the LabVIEW Measurement File
(.lvm)", National Instruments.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import BinaryIO

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import FIRST_YEAR, Block, Channel, Contents, with_distinct_names
from underskin.recordings.readers import text

MAGIC = "LabVIEW Measurement"
_END_OF_HEADER = "***End_of_Header***"
_MOST_EMPTY = 10  # parts of channels for each number that there is
_SEPARATORS = {"Tab": "\t", "Comma": ",", "Semicolon": ";"}


@dataclass
class _Segment:
    """A segment under way: its header's rows and its data rows, with their line numbers."""

    header: dict[str, list[str]] = field(default_factory=dict)
    names: list[str] = field(default_factory=list)
    rows: list[tuple[int, list[str]]] = field(default_factory=list)


def read(stream: BinaryIO, file: str) -> Contents:
    """The channels of an LVM file; raises FileError that names the line."""
    lines = text.lines(text.content(stream, file))
    if not lines[0].startswith(MAGIC):
        raise FileError(file, "line 1", f"must be {MAGIC}")
    header, start = _file_header(lines, file)
    separator = _SEPARATORS.get(header.get("Separator", "Tab"))
    if separator is None:
        raise FileError(file, "the header", f"Separator = {header['Separator']!r}: must be Tab, Comma or Semicolon")
    segments = list(_segments(lines, start, separator, file))
    if not segments:
        raise FileError(file, f"line {len(lines)}", "holds no segment with data")
    warnings: list[str] = []
    reader = _Reader(file, header, separator, warnings)
    blocks = [block for segment in segments for block in reader.blocks(segment)]
    numbered = tuple(replace(block, name=str(number)) for number, block in enumerate(blocks, start=1))
    return Contents(numbered, dict(header), tuple(warnings))


def _file_header(lines: list[str], file: str) -> tuple[dict[str, str], int]:
    header: dict[str, str] = {}
    for index, line in enumerate(lines[1:], start=1):
        if line.startswith(_END_OF_HEADER):
            return header, index + 1
        separator = next((mark for mark in _SEPARATORS.values() if mark in line), "\t")
        name, _, value = line.partition(separator)
        header[name.strip()] = value.strip().strip(separator)
    raise FileError(file, f"line {len(lines)}", f"the header has no end, {_END_OF_HEADER}")


def _segments(lines: list[str], start: int, separator: str, file: str) -> Iterator[_Segment]:
    segment = _Segment()
    for index in range(start, len(lines)):
        cells = lines[index].split(separator)
        first = cells[0].strip()
        if segment.names and not lines[index].strip():
            yield segment
            segment = _Segment()
        elif segment.names:
            segment.rows.append((index + 1, cells))
        elif first == "X_Value":
            if "Channels" not in segment.header:
                raise FileError(file, f"line {index + 1}", "the segment's header does not say how many Channels")
            segment.names = [cell.strip() for cell in cells]
        elif first and first != _END_OF_HEADER:
            segment.header[first] = [cell.strip() for cell in cells[1:]]
    if segment.names:
        yield segment


class _Reader:
    def __init__(self, file: str, header: dict[str, str], separator: str, warnings: list[str]) -> None:
        self.file = file
        self.separator = separator
        self.decimal = header.get("Decimal_Separator")
        self.began = _moment(header.get("Date", ""), header.get("Time", ""))
        self.x_columns = header.get("X_Columns", "One")
        self.warnings = warnings

    def blocks(self, segment: _Segment) -> list[Block]:
        """The acquisitions of a segment."""
        count = self._count(segment)
        decimal = self.decimal or ("," if self._has_decimal_commas(segment) else ".")
        step = 2 if self.x_columns == "Multi" else 1
        names = [*segment.names, *[""] * (1 + step * count)]
        channels = [
            Channel(
                names[1 + step * channel] or f"channel {channel + 1}",
                _entry(segment, "Y_Unit_Label", channel),
                np.array(values, dtype=np.float64),
            )
            for channel, values in enumerate(self._columns(segment, count, step, decimal))
        ]
        return self._acquisitions(segment, with_distinct_names(channels))

    def _count(self, segment: _Segment) -> int:
        stated = _entry(segment, "Channels", 0)
        widest = max((len(cells) for _, cells in segment.rows), default=0)
        if not stated.isascii() or not stated.isdigit() or not 0 < int(stated[:9]) < max(widest, 1):
            place = f"line {segment.rows[0][0]}" if segment.rows else "a segment"
            raise FileError(self.file, place, f"Channels = {stated!r}, but the rows hold {max(widest - 1, 0)}")
        return int(stated)

    def _has_decimal_commas(self, segment: _Segment) -> bool:
        return self.separator != "," and any("," in cell for cell in segment.rows[0][1][:-1])

    def _columns(self, segment: _Segment, count: int, step: int, decimal: str) -> list[list[float]]:
        """The channels' numbers: a channel with fewer samples has empty cells, or none, at its end."""
        columns: list[list[float]] = [[] for _ in range(count)]
        for index, (line, cells) in enumerate(segment.rows):
            for channel, written in enumerate(cells[1 : 1 + step * count : step]):
                cell, values = written.strip(), columns[channel]
                value = text.number(cell, decimal)
                if value is not None and len(values) == index:
                    values.append(value)
                elif cell:
                    place = f"line {line}, column {2 + step * channel}"
                    raise FileError(self.file, place, f"{cell[:40]!r} is no number here")
        return columns

    def _step(self, cell: str) -> float | None:
        """A step of the abscissa: the decimal mark is its own where the header names none."""
        return text.number(cell, self.decimal or ("," if "," in cell else "."))

    def _acquisitions(self, segment: _Segment, channels: tuple[Channel, ...]) -> list[Block]:
        """The channels cut into runs of the stated number of samples."""
        steps = {_entry(segment, "Delta_X", channel) for channel in range(len(channels))}
        step = self._step(steps.pop()) if len(steps) == 1 else None
        is_time = _entry(segment, "X_Dimension", 0) in ("Time", "")
        rate = 1 / step if step is not None and step > 1e-12 and is_time else None
        samples = {_entry(segment, "Samples", channel) for channel in range(len(channels))}
        stated = samples.pop() if len(samples) == 1 else ""
        length = max(len(channel.values) for channel in channels)
        run = int(stated) if stated.isascii() and stated.isdigit() and 0 < len(stated) < 10 and int(stated) else length
        present = sum(len(channel.values) for channel in channels)
        if run and length // run * len(channels) > _MOST_EMPTY * present:
            reason = f"Samples = {run} cuts {present} numbers of {len(channels)} channels into {length // run} parts"
            raise FileError(self.file, f"line {segment.rows[0][0]}", reason)
        if run and length % run:
            self.warnings.append(f"the last acquisition was interrupted after {length % run} of {run} samples")
        began = _moment(_entry(segment, "Date", 0), _entry(segment, "Time", 0)) or self.began
        return [
            Block("", tuple(Channel(c.name, c.unit, c.values[start : start + run]) for c in channels), rate, began)
            for start in range(0, length, run or 1)
        ]


def _entry(segment: _Segment, name: str, channel: int) -> str:
    entries = segment.header.get(name, [])
    return entries[channel] if channel < len(entries) else ""


def _moment(date: str, time: str) -> str | None:
    """A header's Date (year/month/day) and Time, without a zone as it is written; None where they are none."""
    match = re.match(r"(\d\d:\d\d:\d\d)(?:[.,](\d{1,6}))?", time)
    if match is None:
        return None
    try:
        moment = datetime.fromisoformat(f"{date.replace('/', '-')}T{match[1]}.{(match[2] or '').ljust(6, '0')}")
    except ValueError:
        return None
    return moment.isoformat() if moment.year >= FIRST_YEAR else None
