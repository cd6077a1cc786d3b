"""A table with known numbers, written in the layouts of instruments, is read right or refused, and never wrong."""

import math
from dataclasses import dataclass

import numpy as np
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
    quoted: bool
    trailing: bool

    def cell(self, value: float) -> str:
        written = self.overload if math.isnan(value) else f"{value:.{self.digits}f}".replace(".", self.decimal)
        return f'"{written}"' if self.quoted else written

    def headings(self) -> list[str]:
        if self.units_in == "brackets":
            return [
                self.separator.join(f"{name} [{label}]" for name, label in zip(self.names, self.units, strict=True))
            ]
        lines = [self.separator.join(self.names)]
        if self.units_in == "a line":
            lines.append(self.separator.join(self.units))
        elif self.units_in == "a line in brackets":
            lines.append(self.separator.join(f"({label})" for label in self.units))
        return lines

    def text(self) -> bytes:
        ending = self.separator if self.trailing else ""
        above = [line.format(self.separator) for line in self.above]
        rows = [self.separator.join(map(self.cell, row)) + ending for row in self.values.tolist()]
        lines = [*above, *self.headings(), *([self.marker] if self.marker else []), *rows]
        return (self.end.join(lines) + self.end).encode(self.encoding, "replace")

    def labels(self) -> list[str]:
        return [""] * len(self.units) if self.units_in == "nowhere" else list(self.units)


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    columns = draw(st.integers(2, 4))
    rows = draw(st.integers(5, 12))
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
        quoted=draw(st.booleans()),
        trailing=draw(st.booleans()),
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
        written = [float(f"{value:.{layout.digits}f}") for value in column.tolist()]
        if not np.array_equal(channel.values, np.array(written), equal_nan=True):
            departures.append(f"values of {name}")
        if channel.name not in (name, f"{name} [{label}]"):
            departures.append(f"{channel.name!r} for {name!r}")
        if channel.label and not same_unit(channel.label, label):
            departures.append(f"{channel.label!r} for the unit {label!r} of {name}")
    return departures


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
