"""A declared law as a mechanism: it acts where it says, by its expressions over the axes that it names."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from underskin.autodiff import Differentiated, constant
from underskin.mechanisms.base import Kind, Mechanism, Stage, Values
from underskin.mechanisms.declared.expressions import Expression, Value
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.frf_design import FrfDesign
from underskin.mechanisms.parameter import Parameter
from underskin.mechanisms.unnamed.axes import every_axis
from underskin.mechanisms.unnamed.laws import log_of, log_positive
from underskin.mechanisms.unnamed.level_tables import LevelTables
from underskin.mechanisms.unnamed.vocabulary import ActsOn
from underskin.recordings.conditions import Conditions
from underskin.surrogate.sigma_table import SigmaTable, load_table
from underskin.units import Floats
from underskin.weak_cache import cached_while_alive

FREQUENCY = "frequency_hz"


@dataclass(frozen=True, eq=False)
class Bound:
    """The numbers of each axis by the recording's id, and how levels follow what is pressed."""

    axes: dict[str, dict[str, float]]
    tables: LevelTables

    @classmethod
    def to(cls, conditions: Conditions, table: SigmaTable) -> "Bound":
        """To the recordings of a campaign."""
        axes = {axis.name: dict(axis.values) for axis in every_axis(conditions) if not (axis.relative or axis.words)}
        return cls(axes, LevelTables(conditions, table, ()))


@cached_while_alive
def _bound(conditions: Conditions) -> Bound:
    return Bound.to(conditions, load_table())


class DeclaredMechanism(Mechanism):
    """What a file declares."""

    order = 300
    needs_axes: ClassVar[str]  # what is said of the axes that it reads

    def __init__(
        self,
        name: str,
        description: str,
        acts_on: ActsOn,
        axes: tuple[str, ...],
        laws: tuple[Expression, ...],
        parameters: tuple[Parameter, ...],
        source: str,
    ) -> None:
        """Of what the file says."""
        self.name = name
        self.plain = description
        self.law = f"{acts_on}: {', '.join(entry.text for entry in laws)}"
        self.assumptions = "As declared by the lab; what other mechanisms do to its factor is left out."
        self.source = source
        self.needs = f"{' and '.join(axes)} {self.needs_axes}"
        self.acts_on, self.laws, self.axes_read = acts_on, laws, axes
        self.parameters_stated = parameters

    @property
    def axes(self) -> tuple[str, ...]:  # type: ignore[override]
        """Those that it reads."""
        return self.axes_read


class DeclaredOfFrf(DeclaredMechanism):
    """One of FRFs. A diagnosis binds it to its campaign, so that a part of that has the order of the whole."""

    kinds = ("frf",)
    needs_axes = "of every recording, not all the same"
    bound: Bound | None = None

    def bind(self, conditions: Conditions, table: SigmaTable) -> "DeclaredOfFrf":
        """The same, bound to the recordings of a campaign."""
        other = copy(self)
        other.bound = Bound.to(conditions, table)
        return other

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """Axes that recordings lack, or on which they do not differ."""
        known = self.bound.axes if self.bound is not None else _bound(conditions).axes
        own = [entry.id for entry in conditions.recordings]
        for name in self.axes_read:
            if name == FREQUENCY:
                continue
            if name not in known:
                return f"not every recording has {name}, as a number"
        differing = [name for name in self.axes_read if name != FREQUENCY]
        same = all(len({known[name][key] for key in own}) == 1 for name in differing)
        return f"{differing[0]} is the same in all recordings" if differing and same and not self._of_lines else None

    @property
    def _of_lines(self) -> bool:
        return FREQUENCY in self.axes_read

    def _evaluated(self, values: Values, axes: dict[str, Floats], rows: int) -> list[Differentiated]:
        """Each expression on so many rows."""
        first = next(iter(values.values()))
        names: dict[str, Value] = {**values, **axes}
        answers = []
        for law in self.laws:
            value = law(names)
            if not isinstance(value, Differentiated):
                value = constant(np.asarray(value), len(first.slopes), first.value.shape[:-1])
            answers.append(value.spread(rows))
        return answers

    def _axes(self, design: FrfDesign, ids: Sequence[str]) -> dict[str, Floats]:
        bound = self.bound or _bound(design.conditions)
        return {name: np.array([bound.axes[name][key] for key in ids]) for name in self.axes_read if name != FREQUENCY}


class DeclaredOfRecordings(DeclaredOfFrf):
    """One that changes the level of each recording."""

    stage = Stage.RECORDING

    def on_recordings(self, design: FrfDesign, values: Values) -> Differentiated:
        """The factor on each recording."""
        tables = (self.bound or _bound(design.conditions)).tables
        rows = tables.rows(design.ids)
        first, *second = self._evaluated(values, self._axes(design, design.ids), len(design.ids))
        if self.acts_on == "position":
            return tables.moved(rows, first, second[0])
        if self.acts_on == "gain":
            return first
        if self.acts_on == "force":
            force = np.array([tables.force[key] for key in design.ids])
            return tables.factor("force", rows, log_positive(first / force))
        return tables.factor(self.acts_on, rows, log_of(first))


class DeclaredOfLines(DeclaredOfFrf):
    """One that changes each line."""

    stage = Stage.LINES

    @property
    def tells_recordings_apart(self) -> bool:  # type: ignore[override]
        """Where it follows an axis of the recordings."""
        return any(name != FREQUENCY for name in self.axes_read)

    def on_lines(self, design: FrfDesign, contacts: Contacts, values: Values) -> Differentiated:
        """The complex factor on each distinct line."""
        ids = [design.ids[number] for number in design.contact_recording]
        axes = {name: column[design.line_contact] for name, column in self._axes(design, ids).items()}
        (factor,) = self._evaluated(values, {**axes, FREQUENCY: design.line_frequency}, len(design.line_frequency))
        return Differentiated(factor.value.astype(complex), factor.slopes.astype(complex))
