"""Channels that a rig description derives from those of a file (`derived` of `rig/1`), by formulas with units."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import Block, Channel, Contents
from underskin.recordings.readers import channel_arithmetic, text
from underskin.recordings.readers.channel_arithmetic import Formula, Quantity, in_unit
from underskin.recordings.readers.dimensions import described, exponents, label_of
from underskin.recordings.readers.unit_labels import contradicts, labelled_unit, unit
from underskin.recordings.shown_values import LONGEST_NAME

Stated = Mapping[str, str | float]
FIELD = "derived"


def with_derived(
    contents: Contents, formulas: Mapping[str, Formula], stated: Callable[[Block], Stated], file: str
) -> Contents:
    """The contents with the derived channels in every block that has the names of their formulas.

    A name is a channel, one derived before it, or a property of the file (`stated` of a block). What was derived from
    what is a warning. Raises FileError that names the formula and its term.
    """
    if not formulas:
        return contents
    derivations = [_Derivation(block, stated(block), file) for block in contents.blocks]
    for name, formula in formulas.items():
        place = f"{FIELD}.{name}"
        if any(block.channel(name) for block in contents.blocks):
            raise FileError(file, place, "is a channel of the file already: choose another name")
        able = [one for one in derivations if not one.missing(formula)]
        if not able:
            least = min(derivations, key=lambda one: len(one.missing(formula)), default=None)
            lacking = ", ".join(formula.names if least is None else least.missing(formula))
            raise FileError(file, place, f"{lacking}: is no channel or property; it has {contents.described()}")
        for one in able:
            one.add(name, formula, place)
    remarks = [warning for one in derivations for warning in one.warnings]
    warnings = tuple(dict.fromkeys([*contents.warnings, *remarks]))
    return replace(contents, blocks=tuple(one.block for one in derivations), warnings=warnings)


class _Derivation:
    """One block, to which derived channels are added, what the file states about it, and remarks on them."""

    def __init__(self, block: Block, stated: Stated, file: str) -> None:
        self.block = block
        self.stated = stated
        self.file = file
        self.warnings: list[str] = []
        self._constants: dict[str, Quantity] = {}
        self._place = ""
        self._labels: list[str] = []

    def missing(self, formula: Formula) -> list[str]:
        """Names of a formula that are nothing here."""
        known = {*self.stated, *self._constants}
        return [name for name in formula.names if name not in known and self._channel(name) is None]

    def add(self, name: str, formula: Formula, place: str) -> None:
        """Add the channel of a formula; a constant serves later formulas alone."""
        self._place, self._labels = place, []
        quantity = channel_arithmetic.evaluate(formula, self._known, self.file, place)
        label = label_of(quantity.dimension, [*self._labels, *channel_arithmetic.labels(formula)])
        if label is None:
            raise self._error(f"{formula.text} has {described(quantity.dimension)}, which no channel can have")
        if np.ndim(quantity.values) == 0:
            self._constants[name] = quantity
            return
        known = unit(label)
        values = quantity.values if known is None else quantity.values / known.to_si
        channel = Channel(name, label or "1", values)
        self.block = replace(self.block, channels=(*self.block.channels, channel))
        self.warnings.append(f"channel {name!r} is derived: {formula.text}")

    def _known(self, name: str, stated_unit: str | None) -> Quantity:
        if name in self._constants:
            return self._constants[name]
        channel = self._channel(name)
        if channel is not None:
            label = self._unit(name, channel.label, stated_unit)
            self._labels.append(label)
            return in_unit(channel.values, label)
        given = self.stated[name]
        number = text.number(given, text.decimal_mark(lambda _: [[given]], "\t")) if isinstance(given, str) else given
        if number is None:
            raise self._error(f"{name}: the file states {given!r:.{LONGEST_NAME}}, which is no number")
        return in_unit(number, self._unit(name, labelled_unit(name), stated_unit))

    def _channel(self, name: str) -> Channel | None:
        """The channel of that name; one whose heading has a unit behind it only where nothing else is called so."""
        stated = name in self.stated or name in self._constants
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

    def _error(self, reason: str) -> FileError:
        return FileError(self.file, self._place, reason)
