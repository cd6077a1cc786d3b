"""A table with known numbers, written in the layouts of instruments, is read right or refused, and never wrong."""

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from tests.recordings.contents_of_files import contents
from underskin.errors import FileError
from underskin.recordings.channels import Contents
from underskin.recordings.readers.unit_labels import unit

NAMES = ("Time", "Force", "Charge", "Depth", "CH1", "x-axis", "F", "h", "Kraft", "Load cell", "|H|", "Gap")
UNITS = ("s", "N", "mN", "pC", "mm", "µm", "V", "(pC)/N", "Hz")
ABOVE = (
    "Model{0}MDO3024",
    "Gating{0}0.0% to 100.0%{0}",
    "Vertical Units{0}V{0}V",
    "Horizontal Units{0}s{0}",
    "Compliance{0}[µm/N]{0}1.9",
    "Force Constant, nN/nm:\t1.5",
    "Date: 2025-05-12",
    "Operator: mb",
    "k=3 N/m",
    "[Header]",
    "Sample rate [Hz]{0}1000",
    "# exported on Monday",
    "Probe{0}10{0}10",
    "",
)
MARKERS = ("", "eoh", "***End_of_Header***", "-----")
OVERLOADS = ("∞", "-∞", "OVERLOAD", "OL", "Over range")


@dataclass(frozen=True)
class Layout:
    """A table as it is written: what is in it, and how."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray  # (rows, columns); NaN for an overload
    overload: str
    separator: str
    decimal: str
    units_in: str  # "brackets", "a line", "a line in brackets", "nowhere"
    above: tuple[str, ...]
    marker: str
    end: str
    encoding: str
    digits: int
    exponents: bool
    quoted: bool
    trailing: bool
    words: tuple[str, ...]  # of the column of words, repeated; none without one
    words_at: int
    parted: int  # rows before a blank line; 0 without one

    def cell(self, value: float) -> str:
        form = "e" if self.exponents else "f"
        written = self.overload if math.isnan(value) else f"{value:.{self.digits}{form}}".replace(".", self.decimal)
        return f'"{written}"' if self.quoted else written

    def line(self, cells: Sequence[str], word: str) -> str:
        """A line with a word among its cells, where the table has words."""
        if not self.words:
            return self.separator.join(cells)
        return self.separator.join([*cells[: self.words_at], word, *cells[self.words_at :]])

    def headings(self) -> list[str]:
        if self.units_in == "brackets":
            return [
                self.line([f"{name} [{label}]" for name, label in zip(self.names, self.units, strict=True)], "Note")
            ]
        lines = [self.line(self.names, "Note")]
        if self.units_in == "a line":
            lines.append(self.line(self.units, ""))
        elif self.units_in == "a line in brackets":
            lines.append(self.line([f"({label})" for label in self.units], ""))
        return lines

    def text(self) -> bytes:
        ending = self.separator if self.trailing else ""
        above = [line.format(self.separator) for line in self.above]
        rows = [
            self.line([*map(self.cell, row)], self.words[number % len(self.words)] if self.words else "") + ending
            for number, row in enumerate(self.values.tolist())
        ]
        if self.parted:
            rows.insert(self.parted, "")
        lines = [*above, *self.headings(), *([self.marker] if self.marker else []), *rows]
        return (self.end.join(lines) + self.end).encode(self.encoding, "replace")

    def labels(self) -> list[str]:
        return [""] * len(self.units) if self.units_in == "nowhere" else list(self.units)


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    columns = draw(st.integers(2, 4))
    rows = draw(st.integers(5, 12) | st.integers(60, 140))  # more than are read at once
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    digits = draw(st.integers(1, 6))
    values = random.normal(size=(rows, columns)).round(digits) * 10.0 ** random.integers(-1, 3, size=columns)
    overload = draw(st.sampled_from(OVERLOADS))
    if draw(st.integers(0, 3)) == 0:
        values[rows // 2, columns - 1] = math.nan
    separator, decimal = draw(st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ",")]))
    return Layout(
        names=tuple(draw(st.lists(st.sampled_from(NAMES), min_size=columns, max_size=columns, unique=True))),
        units=tuple(draw(st.lists(st.sampled_from(UNITS), min_size=columns, max_size=columns))),
        values=values,
        overload=overload,
        separator=separator,
        decimal=decimal,
        units_in=draw(st.sampled_from(["brackets", "a line", "a line in brackets", "nowhere"])),
        above=tuple(draw(st.lists(st.sampled_from(ABOVE), max_size=4))),
        marker=draw(st.sampled_from(MARKERS)),
        end=draw(st.sampled_from(["\n", "\r\n", "\r"])),
        encoding=draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16"])),
        digits=digits,
        exponents=draw(st.booleans()),
        quoted=draw(st.booleans()),
        trailing=draw(st.booleans()),
        words=draw(st.sampled_from([(), (), ("hold",), ("approach", "hold", "back"), ("", "event"), ("s01", "s02")])),
        words_at=draw(st.integers(0, columns)),
        parted=draw(st.sampled_from([0, 0, 2, rows - 2])),
    )


def same_unit(label: str, meant: str) -> bool:
    return label == meant or (unit(label) is not None and unit(label) == unit(meant))


def wrong(layout: Layout, found: Contents) -> list[str]:
    """What is read wrong: a number, or a name or unit that are of another column or line."""
    (block,) = found.blocks
    if len(block.channels) != len(layout.names):
        return [f"{len(block.channels)} channels"]
    departures = []
    for channel, name, label, column in zip(
        block.channels, layout.names, layout.labels(), layout.values.T, strict=True
    ):
        written = [float(f"{value:.{layout.digits}{'e' if layout.exponents else 'f'}}") for value in column.tolist()]
        if not np.array_equal(channel.values, np.array(written), equal_nan=True):
            departures.append(f"values of {name}")
        if channel.name not in (name, f"{name} [{label}]"):
            departures.append(f"{channel.name!r} for {name!r}")
        if channel.label and not same_unit(channel.label, label):
            departures.append(f"{channel.label!r} for the unit {label!r} of {name}")
    cells = [layout.words[number % len(layout.words)] for number in range(len(layout.values)) if layout.words]
    read = [[column.texts[code] for code in column.codes] for column in block.texts]
    return departures if all(column == cells for column in read) else [*departures, f"words {read}"]


@given(layouts())
def test_layouts_of_instruments(layout: Layout) -> None:
    """Names, units and numbers are those of the table, or it is refused."""
    try:
        found = contents(layout.text(), "run.csv")
    except FileError:
        event("refused")
        return
    event("read")
    assert wrong(layout, found) == []


@pytest.mark.parametrize("words", [("hold",), ("hold", "cold"), ("∞",)])
def test_decimal_commas_beside_words(words: tuple[str, ...]) -> None:
    """Commas between semicolons are decimal, also where words or overloads stand beside few numbers."""
    rows = [";".join([f"0,{number}", *words, f"{number},5"]) for number in range(5)]
    text = "\n".join(["Probe;10;10", "Probe;10;10", ";".join(["t [s]", *words, "F [N]"]), *rows])
    block = contents(text.encode(), "run.csv").blocks[0]
    by_name = {channel.name: channel.values.tolist() for channel in block.channels}
    assert by_name["t [s]"] == [number / 10 for number in range(5)]
    assert by_name["F [N]"] == [number + 0.5 for number in range(5)]


COMPLEX = {
    "i": "{re}{im:+}i",
    "python": "({re}{im:+}j)",
    "pair": "({re},{im})",
    "blanks": "{re} {sign} {size}i",
    "polar": "{r!r}∠{degrees!r}°",
    "polar in rad": "{r!r} ∠ {angle!r} rad",
}
NUMBER = st.floats(-1e6, 1e6).map(lambda number: round(number, 4))


@given(
    st.lists(st.builds(complex, NUMBER, NUMBER), min_size=3, max_size=8),
    st.sampled_from(sorted(COMPLEX)),
    st.sampled_from([",", ";", "\t"]),
)
def test_complex_numbers_in_a_cell(values: list[complex], form: str, separator: str) -> None:
    cells = [
        COMPLEX[form].format(
            re=value.real,
            im=value.imag,
            sign="-" if math.copysign(1, value.imag) < 0 else "+",
            size=abs(value.imag),
            r=abs(value),
            angle=cmath.phase(value),
            degrees=math.degrees(cmath.phase(value)),
        )
        for value in values
    ]
    if separator == "," and form == "pair":
        cells = [f'"{cell}"' for cell in cells]
    rows = [f"{10 * number}{separator}{cell}" for number, cell in enumerate(cells, start=1)]
    text = "\n".join([f"Frequency [Hz]{separator}FRF [pC/N]", *rows])
    (block,) = contents(text.encode(), "frf.csv").blocks
    frequency, frf = block.channels
    assert frequency.values.tolist() == [10.0 * number for number in range(1, len(values) + 1)]
    assert frf.values == pytest.approx(np.array(values), rel=1e-12, abs=1e-9)


@given(st.integers(4, 30), st.integers(1, 28), st.sampled_from([",", ";", "\t"]))
def test_shorter_columns_end_where_they_do(rows: int, helper: int, separator: str) -> None:
    """Columns beside the table that end before it have the numbers that they have."""
    helper = min(helper, rows - 2)
    lines = [separator.join([str(row), str(row / 8), str(row * 10) if row < helper else ""]) for row in range(rows)]
    text = "\n".join([separator.join(["Time [s]", "Force [N]", "sum"]), *lines])
    if helper == 1:
        lines[0] = lines[0].rpartition(separator)[0] + separator
    (block,) = contents(text.encode(), "run.csv").blocks
    by_name = {channel.name: channel.values.tolist() for channel in block.channels}
    assert by_name["Time [s]"] == [float(row) for row in range(rows)]
    assert by_name["Force [N]"] == [row / 8 for row in range(rows)]
    assert by_name.get("sum", []) == [10.0 * row for row in range(helper)][: len(by_name.get("sum", []))]


@pytest.mark.parametrize("rows", [["0,1,2", "1,2,3", "2,,4", "3,4,5"], ["0,1,2", "1,2,3", "2,,4"]])
def test_an_empty_cell_among_the_rows_is_refused(rows: list[str]) -> None:
    """A number below an empty cell is refused by the line of that cell, and so is an empty cell in the last row."""
    with pytest.raises(FileError, match=r"line 4: must be a row of 3 numbers"):
        contents("\n".join(["a,b,c", *rows]).encode(), "run.csv")


@given(st.lists(st.integers(2, 6), min_size=2, max_size=4), st.sampled_from([",", ";", "\t"]), st.booleans())
def test_several_tables_in_a_file(lengths: list[int], separator: str, blank: bool) -> None:
    lines: list[str] = []
    for number, length in enumerate(lengths):
        lines += [f"Curve{separator}{number}", f"Depth [mm]{separator}Force [N]"]
        lines += [f"{row}{separator}{100 * number + row}" for row in range(length)]
        lines += [""] if blank else []
    found = contents("\n".join(lines).encode(), "curves.csv")
    assert [block.channels[1].values.tolist() for block in found.blocks] == [
        [100.0 * number + row for row in range(length)] for number, length in enumerate(lengths)
    ]
    assert [found.properties[f"{number}.Curve"] for number in range(1, len(lengths) + 1)] == [
        str(number) for number in range(len(lengths))
    ]


@given(
    st.sampled_from([("CH1",), ("CH1", "CH2"), ("Voltage A", "Voltage B", "MATH")]),
    st.sampled_from([1e-9, 3.90625e-05, 2.5e-3]),
    st.sampled_from(["Increment", "Increment (ms)"]),
    st.sampled_from([",", ";", "\t"]),
    st.booleans(),
)
def test_a_time_base_beside_the_names(
    names: tuple[str, ...], step: float, heading: str, separator: str, trailing: bool
) -> None:
    """An oscilloscope that counts its samples states start and increment in columns without numbers under them."""
    end = separator if trailing else ""
    lines = [
        separator.join(["X", *names, "Start", heading]) + end,
        separator.join(["Sequence", *["Volt"] * len(names), "-1.0e-01", f"{step:.6e}"]) + end,
        *(
            separator.join([str(row), *[f"{row / 8 - number}" for number in range(len(names))]]) + end
            for row in range(9)
        ),
    ]
    found = contents("\n".join(lines).encode(), "scope.csv")
    (block,) = found.blocks
    assert block.sample_rate_hz == pytest.approx(1 / (step * (1e-3 if "ms" in heading else 1)))
    assert found.properties["Start"] == "-1.0e-01"
    assert [(channel.name, channel.unit) for channel in block.channels[1:]] == [(name, "Volt") for name in names]
    for number, channel in enumerate(block.channels[1:]):
        assert channel.values.tolist() == [row / 8 - number for row in range(9)]


@given(
    st.lists(st.tuples(st.integers(2, 4), st.integers(2, 6)), min_size=2, max_size=4),
    st.sampled_from([(",", "."), (";", ","), ("\t", ".")]),
    st.booleans(),
    st.integers(0, 2**32),
)
def test_tables_of_different_columns_in_a_file(
    sizes: list[tuple[int, int]], style: tuple[str, str], titled: bool, seed: int
) -> None:
    """Results above the data, or temperatures below: each table has its own names, and its title names it."""
    separator, decimal = style
    random = np.random.default_rng(seed)
    lines: list[str] = []
    wanted = []
    for number, (columns, rows) in enumerate(sizes):
        values = random.normal(size=(rows, columns)).round(3)
        names = [f"{NAMES[column]} {number} [{UNITS[column]}]" for column in range(columns)]
        lines += [f"Part {number}"] if titled else [""]
        lines += [separator.join(names)]
        lines += [separator.join(f"{value:.3f}".replace(".", decimal) for value in row) for row in values.tolist()]
        wanted.append((names, values.T.tolist()))
    found = contents("\n".join(lines).encode(), "run.csv")
    held = [([channel.name for channel in block.channels], block) for block in found.blocks]
    assert [(names, [channel.values.tolist() for channel in block.channels]) for names, block in held] == wanted
    assert [block.name for block in found.blocks][1:] == [
        f"Part {number}" if titled else str(number + 1) for number in range(1, len(sizes))
    ]


@pytest.mark.parametrize("bad", ["2,x", "2,,3,4", "x,y", "2"])
def test_a_bad_row_of_a_later_table_is_named_by_its_line(bad: str) -> None:
    rows = "Raw\nDepth [mm],Force [N]\n0,1\n1,2"
    text = f"Results\nMax [N],Work [mJ]\n5,6\n5,7\n\n{rows}\n{bad}\n3,4\n4,5\n"
    with pytest.raises(FileError, match=rf"line 10: must be a row of 2 numbers, as above it; found '{bad}'"):
        contents(text.encode(), "run.csv")


CLOCKS = {
    "h:m:s": lambda s: f"{s // 3600:02.0f}:{s % 3600 // 60:02.0f}:{s % 60:06.3f}",
    "decimal comma": lambda s: f"{s // 3600:02.0f}:{s % 3600 // 60:02.0f}:{s % 60:06.3f}".replace(".", ","),
    "date and time": lambda s: (
        f"2026-05-{3 + s // 86400:02.0f} {s % 86400 // 3600:02.0f}:{s % 3600 // 60:02.0f}:{s % 60:06.3f}"
    ),
    "12 hours": lambda s: (
        f"{(s % 43200 // 3600) or 12:.0f}:{s % 3600 // 60:02.0f}:{s % 60:06.3f} {'PM' if s % 86400 >= 43200 else 'AM'}"
    ),
}


@given(
    st.sampled_from(sorted(CLOCKS)),
    st.integers(0, 86_399),
    st.lists(st.integers(1, 4_000_000), min_size=3, max_size=12),
)
def test_clock_times_are_seconds(form: str, start: int, steps_ms: list[int]) -> None:
    """A column of times of day, also over midnight, is a channel of seconds after the first row."""
    after = np.cumsum([0, *steps_ms]) / 1000
    if form in ("h:m:s", "decimal comma"):
        times = [(start + moment) % 86_400 for moment in after.tolist()]
    else:
        times = [start + moment for moment in after.tolist()]
    rows = [f"{CLOCKS[form](round(time, 3))};{row / 8};{row}" for row, time in enumerate(times)]
    (block,) = contents("\n".join(["Time of day;Depth [mm];Force [N]", *rows]).encode(), "run.csv").blocks
    clock = block.channel("Time of day")
    assert clock is not None
    assert clock.unit == "s"
    assert clock.values == pytest.approx(after, abs=1.1e-3)
