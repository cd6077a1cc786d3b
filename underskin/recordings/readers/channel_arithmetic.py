"""Arithmetic on channels with units: `Piezo - Deflection`, `0.05 [N/m] * 'Deflection (nm)'` (`derived` of `rig/1`).

A formula (expressions.py) holds names of channels, in quotes where one is not a single word; numbers; a unit in
brackets after either. Both sides of a sum need one dimension; units are converted.
"""

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import Block, Channel, Contents
from underskin.recordings.field_words import number_of
from underskin.recordings.readers.expressions import Expression, Grammar, name_of, read, source
from underskin.recordings.readers.unit_labels import (
    Exponents,
    contradicts,
    described,
    exponents,
    label_of,
    labelled_unit,
    times,
    unit,
)
from underskin.recordings.validation import LONGEST_NAME, shown

_GRAMMAR = Grammar(
    form="must be arithmetic on channels, such as Piezo - Deflection, 0.05 [N/m] * Deflection or -'Load cell'; a name "
    "of several words in quotes, a number with its unit in brackets, such as 0.05 [N/m]",
    longest=LONGEST_NAME,
)


@dataclass(frozen=True)
class _Quantity:
    """Values in SI, a scalar or (samples,), the exponents of their unit, and their original unit ("" of results)."""

    values: Any
    dimension: Exponents
    label: str = ""


def parse(field: str, text: str) -> Expression:
    """Parse a formula; raises InvalidInput that names the invalid term."""
    return read(text, field, _GRAMMAR)


def _in_unit(values: Any, label: str) -> _Quantity:
    """Values in a supported unit, `1` for numbers without one."""
    parsed_unit, dimension = unit(label), exponents(label)
    assert dimension is not None
    if parsed_unit is None:
        return _Quantity(values, dimension)
    return _Quantity(values * parsed_unit.to_si, dimension, label)


Stated = Mapping[str, str | float]
FIELD = "derived"


def with_derived(
    contents: Contents, formulas: Mapping[str, Expression], stated: Callable[[Block], Stated], file: str
) -> Contents:
    """The contents with the derived channels in every block that has the names of their formulas.

    A name is a channel, one derived before it, or a property of the file (`stated` of a block). A warning states each
    derivation. Raises FileError that names the formula and its term.
    """
    if not formulas:
        return contents
    derivations = [_Derivation(block, stated(block), file) for block in contents.blocks]
    for name, formula in formulas.items():
        place = f"{FIELD}.{name}"
        if any(block.channel(name) for block in contents.blocks):
            raise FileError(file, place, "is a channel of the file already: choose another name")
        possible = [derivation for derivation in derivations if not derivation.missing(formula)]
        if not possible:
            nearest = min(derivations, key=lambda derivation: len(derivation.missing(formula)), default=None)
            lacking = ", ".join(formula.names if nearest is None else nearest.missing(formula))
            raise FileError(file, place, f"{lacking}: is no channel or property; it has {contents.described()}")
        for derivation in possible:
            derivation.add(name, formula, place)
    remarks = [warning for derivation in derivations for warning in derivation.warnings]
    warnings = tuple(dict.fromkeys([*contents.warnings, *remarks]))
    return replace(contents, blocks=tuple(derivation.block for derivation in derivations), warnings=warnings)


class _Derivation:
    """One block, to which derived channels are added, the properties of the file for it, and warnings."""

    def __init__(self, block: Block, stated: Stated, file: str) -> None:
        self.block = block
        self.warnings: list[str] = []
        self._stated = stated
        self._file = file
        self._constants: dict[str, _Quantity] = {}
        self._place = ""
        self._text = ""
        self._labels: list[str] = []  # units of the channels of a formula, then those stated in it

    def missing(self, formula: Expression) -> list[str]:
        """Names of a formula that are neither channel, constant nor property."""
        scalars = {*self._stated, *self._constants}
        return [name for name in formula.names if name not in scalars and self._channel(name) is None]

    def add(self, name: str, formula: Expression, place: str) -> None:
        """Add the channel of a formula; a constant is used by later formulas only."""
        self._place, self._text, self._labels = place, formula.text, []
        with np.errstate(all="ignore"):
            quantity = self._of(formula.tree)
        stated = [node.slice for node in ast.walk(formula.tree) if isinstance(node, ast.Subscript)]
        label = label_of(quantity.dimension, [*self._labels, *(source(formula.text, node) for node in stated)])
        if label is None:
            raise self._error(f"{formula.text} has {described(quantity.dimension)}, which no channel can have")
        if np.ndim(quantity.values) == 0:
            self._constants[name] = quantity
            return
        label_unit = unit(label)
        values = quantity.values if label_unit is None else quantity.values / label_unit.to_si
        channel = Channel(name, label or "1", values)
        self.block = replace(self.block, channels=(*self.block.channels, channel))
        self.warnings.append(f"channel {name!r} is derived: {formula.text}")

    def _of(self, node: ast.expr, label: str | None = None) -> _Quantity:
        """The quantity of a node; `label`: the unit stated after it."""
        if isinstance(node, ast.Subscript):
            return self._of(node.value, source(self._text, node.slice))
        name = name_of(self._text, node)
        if name is not None:
            return self._named(name, label)
        if isinstance(node, ast.UnaryOp):
            operand = self._of(node.operand)
            return _Quantity(-operand.values, operand.dimension)
        if isinstance(node, ast.BinOp):
            return self._combined(node)
        return _in_unit(float(ast.literal_eval(node)), label or "1")

    def _combined(self, node: ast.BinOp) -> _Quantity:
        left, right = self._of(node.left), self._of(node.right)
        if np.ndim(left.values) and np.ndim(right.values) and len(left.values) != len(right.values):
            raise self._error(f"{self._source_of(node.left)} and {self._source_of(node.right)} differ in length")
        if isinstance(node.op, ast.Mult):
            return _Quantity(left.values * right.values, times(left.dimension, right.dimension))
        if isinstance(node.op, ast.Div):
            if not np.ndim(right.values) and right.values == 0:
                raise self._error(f"{self._source_of(node)}: is a division by 0")
            return _Quantity(np.divide(left.values, right.values), times(left.dimension, right.dimension, -1))
        if left.dimension != right.dimension:
            both = f"{self._with_unit(node.left, left)}, {self._with_unit(node.right, right)}"
            raise self._error(
                f"{self._source_of(node)}: {both}; only what has units of one kind can be added or subtracted"
            )
        sign = 1 if isinstance(node.op, ast.Add) else -1
        return _Quantity(left.values + sign * right.values, left.dimension)

    def _named(self, name: str, stated_unit: str | None) -> _Quantity:
        """The quantity of a name, with the unit stated after it."""
        if name in self._constants:
            return self._constants[name]
        channel = self._channel(name)
        if channel is not None:
            label = self._unit(name, channel.label, stated_unit)
            self._labels.append(label)
            return _in_unit(channel.values, label)
        number = number_of(self._stated[name])
        if number is None:
            given = f"{self._stated[name]!r:.{LONGEST_NAME}}"
            raise self._error(f"{name}: the file states {given}, which is no number")
        return _in_unit(number, self._unit(name, labelled_unit(name), stated_unit))

    def _channel(self, name: str) -> Channel | None:
        """The channel of that name; one whose heading ends with a unit only where nothing else has the name."""
        stated = name in self._stated or name in self._constants
        return self.block.channel(name) if stated else self.block.headed(name)

    def _unit(self, name: str, label: str, stated: str | None) -> str:
        """The unit in brackets, else the label; they must not contradict each other."""
        if stated is None:
            if exponents(label) is None:
                what = f"its unit {label!r} is not known here" if label else "has no unit in the file"
                raise self._error(f"{name}: {what}: say it in brackets, such as [mm] behind it")
            return label
        if contradicts(label, stated, name, ""):
            remedy = f"if the label is wrong, leave {stated!r} out and convert by a factor in the formula"
            raise self._error(f"{name} [{stated}]: is labelled {label!r}, but the formula says {stated!r}; {remedy}")
        return stated

    def _with_unit(self, node: ast.expr, quantity: _Quantity) -> str:
        unit_words = f"the unit {quantity.label}" if quantity.label else described(quantity.dimension)
        return f"{self._source_of(node)} has {unit_words}"

    def _source_of(self, node: ast.expr) -> str:
        return str(shown(source(self._text, node)))

    def _error(self, reason: str) -> FileError:
        return FileError(self._file, self._place, reason)
