"""LabVIEW measurement files (LVM), text: a header, then segments of channels.

Each acquisition is a block: a segment, or, where a segment continues after its stated number of samples, each run of
that many. Comments at the ends of rows are ignored. Source of the format: "Specification for the LabVIEW Measurement
File (.lvm)", National Instruments.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import BinaryIO

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import FIRST_YEAR, Block, Channel, Contents, with_distinct_names
from underskin.recordings.readers import text

MAGIC = "LabVIEW Measurement"
_END_OF_HEADER = "***End_of_Header***"
_CHANNEL_ROWS = ("Samples", "Delta_X", "Date", "Time", "X_Dimension")  # rows of a header that name all channels
_LEAST_STEP_S = 1e-12
_SAME_START_S = 1e-6
_LATEST_S = 1e10  # LabVIEW counts seconds from 1904
_MOST_EMPTY = 10  # parts of channels for each number that there is
_SEPARATORS = {"Tab": "\t", "Comma": ",", "Semicolon": ";"}


@dataclass
class _Segment:
    """A segment being read: its header's rows and its data rows, with their line numbers."""

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
        self.start_time = _moment(header.get("Date", ""), header.get("Time", ""))
        self.x_columns = header.get("X_Columns", "One")
        self.warnings = warnings

    def blocks(self, segment: _Segment) -> list[Block]:
        """The acquisitions of a segment."""
        count = self._count(segment)
        decimal = self.decimal or ("," if self._has_decimal_commas(segment) else ".")
        step = 2 if self.x_columns == "Multi" else 1
        if step == 2:
            segment.header = _without_gaps(segment.header)
        names = [*segment.names, *[""] * (1 + step * count)]
        starts = self._starts(segment, count)
        channels = [
            Channel(
                names[1 + step * channel] or f"channel {channel + 1}",
                _header_cell(segment, "Y_Unit_Label", channel),
                np.array(values, dtype=np.float64),
                self._rate(segment, channel),
                starts[channel],
            )
            for channel, values in enumerate(self._columns(segment, count, step, decimal))
        ]
        return self._acquisitions(segment, with_distinct_names(channels))

    def _rate(self, segment: _Segment, channel: int) -> float | None:
        """1/Delta_X of a channel over time."""
        step = self._number(_header_cell(segment, "Delta_X", channel))
        is_time = _header_cell(segment, "X_Dimension", channel) in ("Time", "")
        return 1 / step if step is not None and _LEAST_STEP_S < step < _LATEST_S and is_time else None

    def _starts(self, segment: _Segment, count: int) -> list[float]:
        """The start of each channel after the first of them [s]: by X0, the first abscissa, or by Date and Time.

        Raises FileError where both differ between channels and disagree.
        """
        channels = range(count)
        by_abscissa = _after_first([self._number(_header_cell(segment, "X0", channel)) for channel in channels])
        moments = [
            _moment(_header_cell(segment, "Date", channel), _header_cell(segment, "Time", channel))
            for channel in channels
        ]
        stamps = [
            None if moment is None else datetime.fromisoformat(moment).replace(tzinfo=UTC).timestamp()
            for moment in moments
        ]
        by_clock = _after_first(stamps)
        if any(by_abscissa) and any(by_clock) and not np.allclose(by_abscissa, by_clock, atol=_SAME_START_S):
            worst = int(np.argmax(np.abs(np.subtract(by_abscissa, by_clock))))
            by_x, by_time = by_abscissa[worst], by_clock[worst]
            reason = f"channel {worst + 1} begins {by_x:g} s after the first by X0, and {by_time:g} s by Date and Time"
            raise FileError(self.file, f"line {segment.rows[0][0]}" if segment.rows else "a segment", reason)
        return by_abscissa if any(by_abscissa) else by_clock

    def _count(self, segment: _Segment) -> int:
        stated = _header_cell(segment, "Channels", 0)
        widest = max((len(cells) for _, cells in segment.rows), default=0)
        if not stated.isascii() or not stated.isdigit() or not 0 < int(stated[:9]) < max(widest, 1):
            place = f"line {segment.rows[0][0]}" if segment.rows else "a segment"
            raise FileError(self.file, place, f"Channels = {stated!r}, but the rows hold {max(widest - 1, 0)}")
        return int(stated)

    def _has_decimal_commas(self, segment: _Segment) -> bool:
        return self.separator != "," and any("," in cell for cell in segment.rows[0][1][:-1])

    def _columns(self, segment: _Segment, count: int, step: int, decimal: str) -> list[list[float]]:
        """The channels' numbers; a channel with fewer samples ends with empty or missing cells."""
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

    def _number(self, cell: str) -> float | None:
        """A number of the header, with its own decimal mark where the header states none."""
        return text.number(cell, self.decimal or ("," if "," in cell else "."))

    def _acquisitions(self, segment: _Segment, channels: tuple[Channel, ...]) -> list[Block]:
        """The channels cut into runs of the stated number of samples."""
        rates = {channel.sample_rate_hz for channel in channels}
        rate = rates.pop() if len(rates) == 1 else None
        samples = {_header_cell(segment, "Samples", channel) for channel in range(len(channels))}
        stated = samples.pop() if len(samples) == 1 else ""
        length = max(len(channel.values) for channel in channels)
        run = int(stated) if stated.isascii() and stated.isdigit() and 0 < len(stated) < 10 and int(stated) else length
        present = sum(len(channel.values) for channel in channels)
        if run and length // run * len(channels) > _MOST_EMPTY * present:
            reason = f"Samples = {run} cuts {present} numbers of {len(channels)} channels into {length // run} parts"
            raise FileError(self.file, f"line {segment.rows[0][0]}", reason)
        if run and length % run:
            self.warnings.append(f"the last acquisition was interrupted after {length % run} of {run} samples")
        start_time = _moment(_header_cell(segment, "Date", 0), _header_cell(segment, "Time", 0)) or self.start_time
        return [
            Block(
                "",
                tuple(replace(channel, values=channel.values[start : start + run]) for channel in channels),
                rate,
                start_time,
            )
            for start in range(0, length, run or 1)
        ]


def _without_gaps(header: dict[str, list[str]]) -> dict[str, list[str]]:
    """The header of channels with a column of abscissae each, without the empty cells above these; unchanged where the
    writer left none."""
    filled = next((cells for name in _CHANNEL_ROWS if any(cells := header.get(name, [])[1:])), [])
    return header if filled and filled[0] else {name: cells[::2] for name, cells in header.items()}


def _after_first(times: Sequence[float | None]) -> list[float]:
    """Times after the earliest; 0 for an unknown one."""
    valid = [time for time in times if time is not None and abs(time) < _LATEST_S]
    return [time - min(valid) if time is not None and abs(time) < _LATEST_S else 0.0 for time in times]


def _header_cell(segment: _Segment, name: str, channel: int) -> str:
    cells_of_row = segment.header.get(name, [])
    return cells_of_row[channel] if channel < len(cells_of_row) else ""


def _moment(date: str, time: str) -> str | None:
    """A header's Date (year/month/day) and Time as ISO 8601 without a zone; None where they are invalid."""
    match = re.match(r"(\d\d:\d\d:\d\d)(?:[.,](\d{1,6}))?", time)
    if match is None:
        return None
    try:
        moment = datetime.fromisoformat(f"{date.replace('/', '-')}T{match[1]}.{(match[2] or '').ljust(6, '0')}")
    except ValueError:
        return None
    return moment.isoformat() if moment.year >= FIRST_YEAR else None
