"""LabVIEW measurement files (LVM), text: a header, then segments of channels.

Each acquisition is a block: a segment, or, where a segment continues after its stated number of samples, each run of
that many. Comments at the ends of rows are ignored. Source of the format: "Specification for the LabVIEW Measurement
File (.lvm)", National Instruments.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
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


@dataclass
class _Segment:
    """The rows of a segment's header by their names, the headings, and the rows of data with their lines."""

    file: str
    header: dict[str, list[str]] = field(default_factory=dict)
    names: list[str] = field(default_factory=list)
    rows: list[tuple[int, list[str]]] = field(default_factory=list)

    def cells(self, name: str, count: int) -> list[str]:
        """The cells of a row of the header, one a channel."""
        return [*self.header.get(name, []), *[""] * count][:count]

    def error(self, reason: str) -> FileError:
        """What is wrong with the segment, at its first row."""
        return FileError(self.file, f"line {self.rows[0][0]}" if self.rows else "a segment", reason)


def read(stream: BinaryIO, file: str) -> Contents:
    """The channels of an LVM file; raises FileError that names the line."""
    lines = text.content(stream, file).split("\n")
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
    blocks = [block for segment in segments for block in _acquisitions(segment, header, separator, warnings)]
    numbered = tuple(replace(block, name=str(number)) for number, block in enumerate(blocks, start=1))
    return Contents(numbered, dict(header), tuple(warnings))


def _file_header(lines: Sequence[str], file: str) -> tuple[dict[str, str], int]:
    header: dict[str, str] = {}
    for index, line in enumerate(lines[1:], start=1):
        if line.startswith(_END_OF_HEADER):
            return header, index + 1
        separator = next((mark for mark in _SEPARATORS.values() if mark in line), "\t")
        name, _, value = line.partition(separator)
        header[name.strip()] = value.strip().strip(separator)
    raise FileError(file, f"line {len(lines)}", f"the header has no end, {_END_OF_HEADER}")


def _segments(lines: Sequence[str], start: int, separator: str, file: str) -> Iterator[_Segment]:
    segment = _Segment(file)
    for index in range(start, len(lines)):
        cells = [cell.strip() for cell in lines[index].split(separator)]
        if segment.names and not lines[index].strip():
            yield segment
            segment = _Segment(file)
        elif segment.names:
            segment.rows.append((index + 1, cells))
        elif cells[0] == "X_Value":
            if "Channels" not in segment.header:
                raise FileError(file, f"line {index + 1}", "the segment's header does not say how many Channels")
            segment.names = cells
        elif cells[0] not in ("", _END_OF_HEADER):
            segment.header[cells[0]] = cells[1:]
    if segment.names:
        yield segment


def _acquisitions(segment: _Segment, header: Mapping[str, str], separator: str, warnings: list[str]) -> Iterator[Block]:
    """The channels of a segment, cut into runs of the stated number of samples; adds a warning on the last of them."""
    channels = _channels(segment, header, separator)
    samples, date, time = (segment.cells(name, len(channels)) for name in ("Samples", "Date", "Time"))
    length = max(len(channel.values) for channel in channels)
    run = int(samples[0]) if len({*samples}) == 1 and _COUNT.fullmatch(samples[0]) else 0
    run = run or length
    present = sum(len(channel.values) for channel in channels)
    if run and length // run * len(channels) > _MOST_EMPTY * present:
        parts = f"{present} numbers of {len(channels)} channels into {length // run} parts"
        raise segment.error(f"Samples = {run} cuts {parts}")
    if run and length % run:
        warnings.append(f"the last acquisition was interrupted after {length % run} of {run} samples")
    rates = {channel.sample_rate_hz for channel in channels}
    rate = rates.pop() if len(rates) == 1 else None
    when = _moment(date[0], time[0]) or _moment(header.get("Date", ""), header.get("Time", ""))
    for start in range(0, length, run or 1):
        parts_of_run = (replace(channel, values=channel.values[start : start + run]) for channel in channels)
        yield Block("", tuple(parts_of_run), rate, when)


def _channels(segment: _Segment, header: Mapping[str, str], separator: str) -> tuple[Channel, ...]:
    """The channels of all rows; a channel with fewer samples ends with empty or missing cells."""
    stated = segment.cells("Channels", 1)[0]
    widest = max((len(cells) for _, cells in segment.rows), default=0)
    if not _COUNT.fullmatch(stated) or not 0 < int(stated) < max(widest, 1):
        raise segment.error(f"Channels = {stated!r}, but the rows hold {max(widest - 1, 0)}")
    count, step = int(stated), 1
    if header.get("X_Columns") == "Multi":
        step, segment.header = 2, _without_gaps(segment.header)
    has_commas = separator != "," and any("," in cell for cell in segment.rows[0][1][:-1])
    decimal = header.get("Decimal_Separator") or ("," if has_commas else ".")
    columns: list[list[float]] = [[] for _ in range(count)]
    for index, (line, cells) in enumerate(segment.rows):
        for channel, cell in enumerate(cells[1 : 1 + step * count : step]):
            value, values = text.number(cell, decimal), columns[channel]
            if value is not None and len(values) == index:
                values.append(value)
            elif cell:
                raise FileError(
                    segment.file, f"line {line}, column {2 + step * channel}", f"{cell[:40]!r} is no number here"
                )
    names = [*segment.names, *[""] * (1 + step * count)][1::step]
    steps, starts = (_numbers(segment.cells(name, count), header) for name in ("Delta_X", "X0"))
    of_channels = zip(
        segment.cells("Y_Unit_Label", count), segment.cells("X_Dimension", count), steps, _starts(segment, starts),
        columns, strict=True,
    )  # fmt: skip
    return with_distinct_names(
        [
            Channel(names[number] or f"channel {number + 1}", label, np.array(values, float), _rate(delta, axis), start)
            for number, (label, axis, delta, start, values) in enumerate(of_channels)
        ]
    )


def _numbers(cells: Sequence[str], header: Mapping[str, str]) -> list[float | None]:
    """Numbers of a header, each with its own decimal mark where the header states none."""
    return [text.number(cell, header.get("Decimal_Separator") or ("," if "," in cell else ".")) for cell in cells]


def _rate(step: float | None, dimension: str) -> float | None:
    """The samples a second of a channel over time."""
    return 1 / step if step is not None and _LEAST_STEP_S < step < _LATEST_S and dimension in ("Time", "") else None


def _starts(segment: _Segment, abscissae: Sequence[float | None]) -> list[float]:
    """The start of each channel after the first of them [s]: by X0, the first abscissa, or by Date and Time; raises
    FileError where both differ between channels and disagree."""
    dates, times = (segment.cells(name, len(abscissae)) for name in ("Date", "Time"))
    moments = [_moment(date, time) for date, time in zip(dates, times, strict=True)]
    stamps = [when if when is None else datetime.fromisoformat(f"{when}+00:00").timestamp() for when in moments]
    by_x, by_clock = _after_first(abscissae), _after_first(stamps)
    if any(by_x) and any(by_clock) and not np.allclose(by_x, by_clock, atol=_SAME_START_S):
        worst = int(np.argmax(np.abs(np.subtract(by_x, by_clock))))
        both = f"{by_x[worst]:g} s after the first by X0, and {by_clock[worst]:g} s by Date and Time"
        raise segment.error(f"channel {worst + 1} begins {both}")
    return by_x if any(by_x) else by_clock


def _without_gaps(header: dict[str, list[str]]) -> dict[str, list[str]]:
    """The header of channels with a column of abscissae each, without the empty cells above these; unchanged where the
    writer left none."""
    filled = next((cells for name in _CHANNEL_ROWS if any(cells := header.get(name, [])[1:])), [])
    return header if filled and filled[0] else {name: cells[::2] for name, cells in header.items()}


def _after_first(times: Sequence[float | None]) -> list[float]:
    """Times after the earliest; 0 for an unknown one."""
    valid = [time for time in times if time is not None and abs(time) < _LATEST_S]
    return [time - min(valid) if time is not None and abs(time) < _LATEST_S else 0.0 for time in times]


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
