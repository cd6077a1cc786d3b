"""Text as instruments write it: byte order marks, old code pages, cells in quotes, decimal commas, truncated ends; and
times: the lab's time zone, and dates as spreadsheets write them, 24.12.2025 09:30, 24/12/2025 9:30:15.
"""

import csv
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, date, datetime, tzinfo
from itertools import chain
from typing import BinaryIO
from unicodedata import combining, normalize
from zoneinfo import ZoneInfo

from underskin.errors import FileError, InvalidInput

_LINE_END = re.compile(r"\r\n|\r|\n")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_LOOKED_AT, _MOSTLY = 4096, 0.8  # bytes of a text without a mark, and how many of a half must be zero
BLOCK = 1 << 20
MINUS = "\N{MINUS SIGN}"
_BOMS = {b"\xef\xbb\xbf": "utf-8", b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


def content(stream: BinaryIO, file: str) -> str:
    """The text of an open file, with line feeds as line ends."""
    stream.seek(0)
    written = decode(stream.read(), file)
    return written.replace("\r\n", "\n").replace("\r", "\n") if "\r" in written else written


def blocks(written: str) -> Iterator[tuple[int, list[str]]]:
    """The lines of a text, some BLOCK characters at a time, each time with the number of lines before them."""
    start = first = 0
    while start <= len(written):
        end = written.find("\n", start + BLOCK)
        end = len(written) if end < 0 else end
        block = written[start:end].split("\n")
        yield first, block
        first += len(block)
        start = end + 1


def _line(data: bytes, byte: int) -> str:
    """The line that a byte is in."""
    return f"line {data.count(bytes([10]), 0, byte) + 1}"


def decode(data: bytes, file: str) -> str:
    """The text of a file: UTF-8, UTF-16 by a byte order mark or zero bytes, else Latin-1, which older instruments
    write.

    Raises FileError where the bytes are no text.
    """
    mark = next((mark for mark in _BOMS if data.startswith(mark)), b"")
    encoding = _BOMS.get(mark, _unmarked(data) if data.find(0) in (0, 1) else "")
    if encoding:
        try:
            return str(memoryview(data)[len(mark) :], encoding)
        except UnicodeDecodeError as error:
            raise FileError(file, _line(data, error.start), f"is no {encoding.upper()} text: {error.reason}") from None
    zero = data.find(0)
    if zero >= 0:
        raise FileError(file, _line(data, zero), "is no text: it holds a zero byte")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _unmarked(data: bytes) -> str:
    """The encoding of UTF-16 without a byte order mark, in which every second byte of mostly ASCII text is zero; empty
    otherwise."""
    first, second = (data[start:_LOOKED_AT:2].count(0) for start in (0, 1))
    half = len(data[:_LOOKED_AT]) // 2
    if max(first, second) < _MOSTLY * half or min(first, second):
        return ""
    return "utf-16-be" if first > second else "utf-16-le"


def lines(text: str) -> list[str]:
    """The lines, however they end."""
    return _LINE_END.split(text)


def cells(line: str, separator: str, fewest: int = 1) -> list[str]:
    """The cells of a line, without quotes and without the empty ones at its end beyond the `fewest`; at least one.

    A cell in quotes may hold the separator, and quotes, doubled; it ends on its line. Raises ValueError where it does
    not.
    """
    split = [cell.strip() for cell in (_quoted(line, separator) if '"' in line else line.split(separator))]
    while len(split) > fewest and not split[-1]:
        split.pop()
    return split


def _quoted(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True))
    except csv.Error:
        raise ValueError(
            "a cell in quotes must end on its line, before the next separator, with the quotes inside it doubled"
        ) from None


def decimal_mark(rows: Iterable[Sequence[str]], separator: str) -> str:
    """The decimal mark of a table, by its cells.

    A comma where a cell is a number only that way, and not possibly one with separated thousands. With semicolons, used
    where commas are decimal marks, any such cell suffices; with commas as separators none does where others have
    points.
    """
    has_comma = False
    for cell in chain.from_iterable(rows):
        if separator == "," and "." in cell and number(cell, ".") is not None:
            return "."
        if "," in cell and not has_comma:
            has_comma = number(cell, ",") is not None and (separator == ";" or not is_grouped(cell))
            if has_comma and separator != ",":
                return ","
    return "," if has_comma else "."


def is_grouped(cell: str) -> bool:
    """Whether a cell such as 16,000 may be an integer with separated thousands or a number with a decimal comma."""
    return _GROUPED.fullmatch(cell) is not None


def ungrouped(cell: str) -> str:
    """The request to rewrite an ambiguous cell."""
    return f"can be {cell.replace(',', '')} or {cell.replace(',', '.', 1)}: write it without a comma"


_THOUSANDS = {
    ",": re.compile(rf"\s*[-+{MINUS}]?[1-9]\d{{0,2}}(?:\.\d{{3}})+,\d+\s*"),
    ".": re.compile(rf"\s*[-+{MINUS}]?[1-9]\d{{0,2}}(?:,\d{{3}})+\.\d+\s*"),
}


def number(cell: str, decimal: str) -> float | None:
    """The number in a cell, or None where it holds something else; thousands may be separated where a decimal mark
    behind them leaves no doubt."""
    mark = "." if decimal == "," else ","
    if mark in cell:
        if not _THOUSANDS[decimal].fullmatch(cell):
            return None
        cell = cell.replace(mark, "")
    if decimal == ",":
        cell = cell.replace(",", ".")
    if not cell.isascii():
        cell = cell.strip().replace(MINUS, "-")
    if not cell.isascii() or "_" in cell:  # digits of other scripts, and 1_000
        return None
    try:
        return float(cell)
    except ValueError:
        return None


_END = 1 << 16  # bytes at the end
_FEWEST, _MOST = 3, 50  # lines above that determine the number of digits
_SEPARATORS = "\t;, "
_CUT_NUMBER = re.compile(r"[+-]?\d*(?:[.,](?P<decimals>\d*))?(?:[eE][+-]?(?P<exponent>\d*))?")


def warning(stream: BinaryIO) -> str:
    """A warning that the file may be truncated: the last line has no end, and its last number fewer decimals or digits
    of the exponent than each above it; else empty."""
    size = stream.seek(0, 2)
    stream.seek(max(size - _END, 0))
    *above, last = lines(stream.read().replace(b"\0", b"").decode("latin-1"))
    separator = next((mark for mark in _SEPARATORS if mark in last), "")
    if not separator:
        return ""
    cell = last.rpartition(separator)[2]
    last_digits = _digits(cell)
    rows = [line.rstrip() for line in above[-_MOST:] if line.count(separator) == last.count(separator)]
    others = [digits_of_row for row in rows if (digits_of_row := _digits(row.rpartition(separator)[2])) is not None]
    if last_digits is None or len(others) < _FEWEST:
        return ""
    fewest = [min(digits) for digits in zip(*others, strict=True)]
    if all(actual >= least for actual, least in zip(last_digits, fewest, strict=True)):
        return ""
    ends = f"the file ends without the end of a line, in {cell!r}"
    return f"{ends}, which has fewer digits than the numbers above it: it may be cut there"


def _digits(cell: str) -> tuple[int, int] | None:
    """The numbers of decimals and of digits of the exponent; None where the cell is no number."""
    parts = _CUT_NUMBER.fullmatch(cell)
    return None if not cell or parts is None else (len(parts["decimals"] or ""), len(parts["exponent"] or ""))


TIME_ZONE = "UNDERSKIN_TIME_ZONE"  # the setting; UTC where it is not set


def time_zone() -> tzinfo:
    """The time zone of the setting; raises InvalidInput for an unknown one."""
    name = os.environ.get(TIME_ZONE) or "UTC"
    if name == "UTC":
        return UTC
    try:
        return ZoneInfo(name)
    except (KeyError, ValueError, OSError):
        raise InvalidInput(TIME_ZONE, name, "must be a time zone such as Europe/Rome") from None


def in_lab(moment: datetime) -> datetime:
    """A moment in the lab's zone, assumed in UTC where it states none; unchanged where it overflows the calendar."""
    zoned = moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
    try:
        return zoned.astimezone(time_zone())
    except OverflowError:
        return zoned


_CLOCK = (
    r"(?:[ ,T]+(?:um |à )?(?P<hour>\d{1,2})[:h](?P<minute>\d{2})(?:[:m](?P<second>\d{2})(?:[.,]\d+)?)?"
    r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?)?"
)
_WORD = r"(?P<word>[^\W\d_]{3,})\.?"
_WRITTEN = [
    re.compile(form + _CLOCK)
    for form in (
        r"(?P<day>\d{1,2})(?P<mark>[./])(?P<month>\d{1,2})(?P=mark)(?P<year>\d{4})",
        r"(?P<year>\d{4})(?P<mark>[./])(?P<month>\d{1,2})(?P=mark)(?P<day>\d{1,2})",
        rf"(?:[^\W\d_]+[., ]+)?(?P<day>\d{{1,2}})(?:\.|er|º|°)?[ -]?(?:de )?{_WORD}[ -]?(?:del? )?(?P<year>\d{{4}})",
        rf"(?:[^\W\d_]+[., ]+)?{_WORD} (?P<day>\d{{1,2}})(?:st|nd|rd|th)?,? (?P<year>\d{{4}})",
    )
]
_SLASHED = re.compile(r"(\d{1,2})/(\d{1,2})/(\d{4})(?!\d)")
_MONTHS = (  # their names without accents, in English, French, German, Italian and Spanish
    "january janvier januar janner gennaio enero",
    "february fevrier februar febbraio febrero",
    "march mars marz maerz mrz marzo",
    "april avril aprile abril",
    "may mai maggio mayo",
    "june juin juni giugno junio",
    "july juillet juli luglio julio",
    "august aout agosto",
    "september septembre settembre septiembre setiembre",
    "october octobre oktober ottobre octubre",
    "november novembre noviembre",
    "december decembre dezember dicembre diciembre",
)
_ISO_DATE = re.compile(r"(\d{4})-(\d{2})-(\d{2})")


def iso_time(cell: str, zone: tzinfo) -> str:
    """A date and time in a zone as ISO 8601; other texts are unchanged.

    With points the day comes first; with slashes it may be the month, which may be a word of one of five languages.
    Raises ValueError where that is ambiguous, or where there is no such day or time.
    """
    match = next((found for form in _WRITTEN if (found := form.fullmatch(cell.strip()))), None)
    if match is None:
        return cell
    written = match.groupdict()
    day, month = int(match["day"]), _month(written["word"]) if "word" in written else int(match["month"])
    if month is None:
        return cell
    if written.get("mark") == "/" and match.start("year") and day != month:
        if max(day, month) <= len(_MONTHS):
            raise ValueError(_two_days(match))
        day, month = (day, month) if month <= len(_MONTHS) else (month, day)
    hour, minute, second = (int(match[part] or 0) for part in ("hour", "minute", "second"))
    if match["half"]:
        hour = hour % 12 + 12 * (match["half"] in "pP")
    try:
        time = f"{match['year']}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}"
        return datetime.fromisoformat(time).replace(tzinfo=zone).isoformat()
    except ValueError as error:
        raise ValueError(f"is no date and time: {error}") from None


def _month(name: str) -> int | None:
    """The number of a month by its name, or by the beginning of it as an abbreviation; None for another word, and for
    the beginning of two months."""
    plain = "".join(letter for letter in normalize("NFKD", name.lower()) if not combining(letter))
    months = [number for number, words in enumerate(_MONTHS, 1) if f" {plain}" in f" {words}"]
    return months[0] if len(months) == 1 else None


def with_day_first(cells: Iterable[str], decimal: str) -> list[str]:
    """The cells of a column, dates with slashes written with points where the day comes first in them: where one of
    them has no other reading, and in files with decimal commas, which no country writes that puts the month first."""
    written = list(cells)
    dates = [(int(date[1]), int(date[2])) for cell in written if (date := _SLASHED.match(cell.strip()))]
    leads = max((first for first, _ in dates), default=0) > len(_MONTHS)
    trails = max((second for _, second in dates), default=0) > len(_MONTHS)
    if trails or not (leads or decimal == ","):
        return written
    return [_SLASHED.sub(r"\1.\2.\3", cell) for cell in written]


def _two_days(match: re.Match[str]) -> str:
    """The message that a date is ambiguous, with both days and their ISO forms."""
    numbers = int(match["day"]), int(match["month"])
    clock = f"T{int(match['hour']):02}:{match['minute']}" if match["hour"] else ""
    days = [date(int(match["year"]), month, day) for day, month in (numbers, numbers[::-1])]
    named = " or ".join(f"{day.day} {day:%B %Y}" for day in days)
    return f"can be two days, {named}: write it as {' or '.join(f'{day}{clock}' for day in days)}"


def with_zone(text: str, zone: tzinfo) -> str:
    """A date, or a date and time, in ISO 8601 or as for `iso_time`, with its zone: `zone` where it states none.

    Raises ValueError for other texts.
    """
    text_with_zone = iso_time(text.strip(), zone)
    moment = datetime.fromisoformat(text_with_zone)
    return text_with_zone if moment.tzinfo is not None else moment.replace(tzinfo=zone).isoformat()


def no_time(error: ValueError) -> str:
    """The end of a note that a time is not used."""
    known = str(error).startswith(("can be", "is no date"))
    return f"{error if known else 'is no date and time that can be read here'}; it, and others like it, are left out"


def of_two_cells(day: str, clock: str) -> str:
    """A date, or the date of an ISO time, and a time of day in separate cells, as one text for `iso_time`; an ISO time
    without another time of day is unchanged."""
    day, clock = day.strip(), clock.strip()
    iso = _ISO_DATE.match(day)
    if iso is None or not (clock or iso.end() == len(day)):
        return f"{day} {clock}".strip()
    return f"{'.'.join(reversed(iso.groups()))} {clock}".strip()
