"""LabVIEW measurement files (LVM), text: a header, then segments of channels.

Each acquisition is a block: a segment, or, where a segment continues after its stated number of samples, each run of
that many. Comments at the ends of rows are ignored. Source of the format: "Specification for the LabVIEW Measurement
File (.lvm)", National Instruments.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
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
_COUNT = re.compile(r"\d{1,9}", re.ASCII)


class _Segment:
    """A segment of a file with the `header` given: the cells of the rows of its own header by their names, the
    headings, and the rows of data with their lines."""

    def __init__(self, file: str, header: Mapping[str, str]) -> None:
        self.file = file
        self.of_file = header
        self.header: dict[str, list[str]] = {}
        self.names: list[str] = []
        self.rows: list[tuple[int, list[str]]] = []

    def cells(self, name: str, count: int) -> list[str]:
        """The cells of a row of the header, one a channel."""
        return [*self.header.get(name, []), *[""] * count][:count]

    def numbers(self, name: str, count: int) -> list[float | None]:
        """Numbers of a header, each with its own decimal mark where the file states none."""
        stated = self.of_file.get("Decimal_Separator")
        return [text.number(cell, stated or ("," if "," in cell else ".")) for cell in self.cells(name, count)]

    def error(self, reason: str) -> FileError:
        """What is wrong with the segment, at its first row."""
        return FileError(self.file, f"line {self.rows[0][0]}" if self.rows else "a segment", reason)


def read(stream: BinaryIO, file: str) -> Contents:
    """The channels of an LVM file; raises FileError that names the line."""
    lines = text.content(stream, file).split("\n")
    if not lines[0].startswith(MAGIC):
        raise FileError(file, "line 1", f"must be {MAGIC}")
    end = next((index for index, line in enumerate(lines) if index and line.startswith(_END_OF_HEADER)), None)
    if end is None:
        raise FileError(file, f"line {len(lines)}", f"the header has no end, {_END_OF_HEADER}")
    header: dict[str, str] = {}
    for line in lines[1:end]:
        mark = next((mark for mark in _SEPARATORS.values() if mark in line), "\t")
        name, _, value = line.partition(mark)
        header[name.strip()] = value.strip().strip(mark)
    separator = _SEPARATORS.get(header.get("Separator", "Tab"))
    if separator is None:
        raise FileError(file, "the header", f"Separator = {header['Separator']!r}: must be Tab, Comma or Semicolon")
    warnings: list[str] = []
    segments = _segments(lines, end + 1, separator, _Segment(file, header))
    blocks = [block for segment in segments for block in _acquisitions(segment, separator, warnings)]
    if not blocks:
        raise FileError(file, f"line {len(lines)}", "holds no segment with data")
    numbered = tuple(replace(block, name=str(number)) for number, block in enumerate(blocks, start=1))
    return Contents(numbered, header, tuple(warnings))


def _segments(lines: Sequence[str], start: int, separator: str, segment: _Segment) -> Iterator[_Segment]:
    for index in range(start, len(lines)):
        cells = [cell.strip() for cell in lines[index].split(separator)]
        if segment.names and not lines[index].strip():
            yield segment
            segment = _Segment(segment.file, segment.of_file)
        elif segment.names:
            segment.rows.append((index + 1, cells))
        elif cells[0] == "X_Value":
            if "Channels" not in segment.header:
                reason = "the segment's header does not say how many Channels"
                raise FileError(segment.file, f"line {index + 1}", reason)
            segment.names = cells
        elif cells[0] not in ("", _END_OF_HEADER):
            segment.header[cells[0]] = cells[1:]
    if segment.names:
        yield segment


def _acquisitions(segment: _Segment, separator: str, warnings: list[str]) -> Iterator[Block]:
    """The channels of a segment, cut into runs of the stated number of samples; adds a warning on the last of them."""
    channels = _channels(segment, separator)
    samples, date, time = (segment.cells(name, len(channels)) for name in ("Samples", "Date", "Time"))
    length = max(len(channel.values) for channel in channels)
    run = (int(samples[0]) if len({*samples}) == 1 and _COUNT.fullmatch(samples[0]) else 0) or length
    present = sum(len(channel.values) for channel in channels)
    if run and length // run * len(channels) > _MOST_EMPTY * present:
        parts = f"{present} numbers of {len(channels)} channels into {length // run} parts"
        raise segment.error(f"Samples = {run} cuts {parts}")
    if run and length % run:
        warnings.append(f"the last acquisition was interrupted after {length % run} of {run} samples")
    rates = {channel.sample_rate_hz for channel in channels}
    rate = rates.pop() if len(rates) == 1 else None
    stated = segment.of_file
    when = _moment(date[0], time[0]) or _moment(stated.get("Date", ""), stated.get("Time", ""))
    for start in range(0, length, run or 1):
        parts_of_run = (replace(channel, values=channel.values[start : start + run]) for channel in channels)
        yield Block("", tuple(parts_of_run), rate, None if when is None else when.isoformat())


def _channels(segment: _Segment, separator: str) -> tuple[Channel, ...]:
    """The channels of all rows; a channel with fewer samples ends with empty or missing cells."""
    stated = segment.cells("Channels", 1)[0]
    widest = max((len(cells) for _, cells in segment.rows), default=0)
    if not _COUNT.fullmatch(stated) or not 0 < int(stated) < max(widest, 1):
        raise segment.error(f"Channels = {stated!r}, but the rows hold {max(widest - 1, 0)}")
    count, step = int(stated), 1
    if segment.of_file.get("X_Columns") == "Multi":  # a column of abscissae each, which most writers leave out above
        filled = next((cells for name in _CHANNEL_ROWS if any(cells := segment.header.get(name, [])[1:])), [""])
        step = 2
        if not filled[0]:
            segment.header = {name: cells[::2] for name, cells in segment.header.items()}
    has_commas = separator != "," and any("," in cell for cell in segment.rows[0][1][:-1])
    decimal = segment.of_file.get("Decimal_Separator") or ("," if has_commas else ".")
    columns: list[list[float]] = [[] for _ in range(count)]
    for index, (line, cells) in enumerate(segment.rows):
        for channel, cell in enumerate(cells[1 : 1 + step * count : step]):
            value, values = text.number(cell, decimal), columns[channel]
            if value is not None and len(values) == index:
                values.append(value)
            elif cell:
                place = f"line {line}, column {2 + step * channel}"
                raise FileError(segment.file, place, f"{cell[:40]!r} is no number here")
    names = [*segment.names, *[""] * (1 + step * count)][1::step]
    labels, axes = (segment.cells(name, count) for name in ("Y_Unit_Label", "X_Dimension"))
    rates = [
        1 / delta if delta is not None and _LEAST_STEP_S < delta < _LATEST_S and axis in ("Time", "") else None
        for delta, axis in zip(segment.numbers("Delta_X", count), axes, strict=True)
    ]
    starts = _starts(segment, count)
    return with_distinct_names(
        [
            Channel(names[number] or f"channel {number + 1}", labels[number], np.array(values, float), rate, start)
            for number, (values, rate, start) in enumerate(zip(columns, rates, starts, strict=True))
        ]
    )


def _starts(segment: _Segment, count: int) -> list[float]:
    """The start of each channel after the first of them [s]: by X0, the first abscissa, or by Date and Time; raises
    FileError where both differ between channels and disagree."""
    moments = map(_moment, segment.cells("Date", count), segment.cells("Time", count))
    stamps = [None if when is None else when.replace(tzinfo=UTC).timestamp() for when in moments]
    by_x, by_clock = _after_first(segment.numbers("X0", count)), _after_first(stamps)
    if any(by_x) and any(by_clock) and not np.allclose(by_x, by_clock, atol=_SAME_START_S):
        worst = int(np.argmax(np.abs(np.subtract(by_x, by_clock))))
        both = f"{by_x[worst]:g} s after the first by X0, and {by_clock[worst]:g} s by Date and Time"
        raise segment.error(f"channel {worst + 1} begins {both}")
    return by_x if any(by_x) else by_clock


def _after_first(times: Sequence[float | None]) -> list[float]:
    """Times after the earliest; 0 for an unknown one."""
    known = [time if time is not None and abs(time) < _LATEST_S else None for time in times]
    first = min((time for time in known if time is not None), default=0.0)
    return [0.0 if time is None else time - first for time in known]


def _moment(date: str, time: str) -> datetime | None:
    """A header's Date (year/month/day) and Time, without a zone; None where they are invalid."""
    clock, _, part = re.sub("[.,]", ".", time, count=1).partition(".")
    try:
        moment = datetime.fromisoformat(f"{date.replace('/', '-')}T{clock}.{re.sub('[^0-9].*', '', part):0<6.6}")
    except ValueError:
        return None
    return moment if moment.year >= FIRST_YEAR else None
