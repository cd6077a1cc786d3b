"""Mechanisms that a file declares.

Laws are expressions of numbers, names, + − * / **, `pi`, `i` (√−1), and the functions of FUNCTIONS, evaluated with
derivatives.

A declared mechanism acts on FRFs by expressions over its axes, or on indentation curves by an expression over depth,
force or time of each sample.
"""

import ast
from abc import abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import partial
from operator import add, mul, sub, truediv
from typing import Any, ClassVar

import numpy as np

from underskin.autodiff import Differentiated, chain, constant, exp, log, where
from underskin.mechanisms.base import Kind, Mechanism, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import FrfDesign, FrfState
from underskin.mechanisms.models.curve_state import Curve, SampleLaw, Samples, numbers
from underskin.mechanisms.unlisted.forms import every_axis
from underskin.mechanisms.unlisted.laws import LevelTables, log_of, log_positive
from underskin.mechanisms.unlisted.vocabulary import ActsOn
from underskin.recordings.campaign import Conditions, IndentationConditions, curves_of
from underskin.recordings.readers import expressions
from underskin.recordings.readers.expressions import Expression, Grammar
from underskin.surrogate.sigma_table import SigmaTable, load_table
from underskin.units import Array, Floats
from underskin.weak_cache import cached_while_alive

Value = Differentiated | Array | complex
_LONGEST = 500  # characters
CONSTANTS: Mapping[str, np.float64 | np.complex128] = {"pi": np.float64(np.pi), "i": np.complex128(1j)}


def read(text: object, field: str, names: Collection[str]) -> Expression:
    """Parse a law in these names; raises InvalidInput that names the field, the term and what is allowed."""
    functions = {name: count for name, (count, _) in FUNCTIONS.items()}
    allowed = {*names, *CONSTANTS}
    form = "must be a law of numbers, names, + − * / ** and functions"
    return expressions.read(text, field, Grammar(form, _LONGEST, allowed, functions, (ast.Pow, ast.UAdd)))


def value_of(law: Expression, values: Mapping[str, Value]) -> Value:
    """The value of a law for these values of the names in it."""
    return _value(law.tree, values)


def _value(node: ast.expr, values: Mapping[str, Value]) -> Value:
    if isinstance(node, ast.Constant):
        return np.float64(node.value)  # type: ignore[arg-type]  # which may be divided by 0
    match node:
        case ast.Name(id=name):
            return CONSTANTS[name] if name in CONSTANTS else values[name]
        case ast.UnaryOp(op=op, operand=operand):
            inner = _value(operand, values)
            return -inner if isinstance(op, ast.USub) else inner
        case ast.BinOp(left=left, op=op, right=right):
            return _OPERATORS[type(op)](_value(left, values), _value(right, values))
        case ast.Call(func=ast.Name(id=name), args=args):
            return FUNCTIONS[name][1](*(_value(argument, values) for argument in args))
    raise AssertionError(node)  # the grammar has no other node


def _power(a: Value, b: Value) -> Value:
    if isinstance(b, Differentiated):
        return _exp(b * _log(a))
    if isinstance(a, Differentiated):
        return a ** float(np.asarray(b).real) if np.ndim(b) == 0 else _exp(_log(a) * b)
    return np.asarray(a, dtype=complex if np.iscomplexobj(a) else float) ** b


_OPERATORS: Mapping[type[ast.operator], Callable[[Any, Any], Value]] = {
    ast.Add: add,
    ast.Sub: sub,
    ast.Mult: mul,
    ast.Div: truediv,
    ast.Pow: _power,
}


def _log(x: Value) -> Value:
    return log(x) if isinstance(x, Differentiated) else np.log(x)


def _exp(x: Value) -> Value:
    return exp(x) if isinstance(x, Differentiated) else np.exp(x)


def _by(function: Callable[[Array], Array], slope: Callable[[Array], Array]) -> Callable[[Value], Value]:
    def applied(x: Value) -> Value:
        if isinstance(x, Differentiated):
            return chain(function(x.value), (slope(x.value), x))
        return function(np.asarray(x))

    return applied


def _larger(a: Value, b: Value) -> Value:
    if isinstance(a, Differentiated) or isinstance(b, Differentiated):
        difference = a - b
        assert isinstance(difference, Differentiated)
        return where(difference.value > 0, difference, 0.0) + b
    return np.maximum(a, b)


FUNCTIONS: Mapping[str, tuple[int, Callable[..., Value]]] = {  # number of arguments, function
    "exp": (1, _exp),
    "log": (1, _log),
    "sqrt": (1, lambda x: _power(x, 0.5)),
    "sin": (1, _by(np.sin, np.cos)),
    "cos": (1, _by(np.cos, lambda x: -np.sin(x))),
    "tanh": (1, _by(np.tanh, lambda x: 1 - np.tanh(x) ** 2)),
    "step": (1, _by(lambda x: (x > 0).astype(float), lambda x: np.zeros(np.shape(x)))),  # 1 above 0, else 0
    "max": (2, _larger),
    "min": (2, lambda a, b: -_larger(-a, -b)),
}


FREQUENCY = "frequency_hz"


@dataclass(frozen=True, eq=False)
class Bound:
    """The values of each axis by recording id, and the level of each recording as a function of what is pressed."""

    axes: dict[str, dict[str, float]]
    tables: LevelTables

    @classmethod
    def to(cls, conditions: Conditions, table: SigmaTable) -> "Bound":
        """Bound to the recordings of a campaign."""
        axes = {axis.name: dict(axis.values) for axis in every_axis(conditions) if not (axis.relative or axis.words)}
        return cls(axes, LevelTables(conditions, table))


@cached_while_alive
def _bound(conditions: Conditions) -> Bound:
    return Bound.to(conditions, load_table())


class DeclaredMechanism(Mechanism):
    """A mechanism that a file declares."""

    order = 300
    needs_axes: ClassVar[str]  # requirement on its axes, in words

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
        """Take the contents of the file."""
        self.name = name
        self.plain = description
        self.law = f"{acts_on}: {', '.join(expression.text for expression in laws)}"
        self.assumptions = "As declared by the lab; what other mechanisms do to its factor is left out."
        self.source = source
        self.needs = f"{' and '.join(axes)} {self.needs_axes}"
        self.acts_on, self.laws, self.axes_read = acts_on, laws, axes
        self.parameters_stated = parameters

    @abstractmethod
    def bind(self, conditions: Conditions, table: SigmaTable) -> "DeclaredMechanism":
        """A copy bound to the recordings of a campaign."""

    @property
    def axes(self) -> tuple[str, ...]:  # type: ignore[override]
        """The axes that the law reads."""
        return self.axes_read


class DeclaredOfFrf(DeclaredMechanism):
    """A declared mechanism of FRFs. A diagnosis binds it to its campaign, so that subsets keep the order of the
    whole."""

    kinds = ("frf",)
    needs_axes = "of every recording, not all the same"
    bound: Bound | None = None

    def bind(self, conditions: Conditions, table: SigmaTable) -> "DeclaredOfFrf":
        """A copy bound to the recordings of a campaign."""
        other = copy(self)
        other.bound = Bound.to(conditions, table)
        return other

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """Axes that recordings lack, or that do not vary."""
        axes, names = (self.bound or _bound(conditions)).axes, self.axes_of_recordings
        ids = [recording.id for recording in conditions.recordings]
        for name in names:
            if name not in axes:
                return f"not every recording has {name}, as a number"
        same = FREQUENCY not in self.axes_read and all(len({axes[name][key] for key in ids}) == 1 for name in names)
        return f"{names[0]} is the same in all recordings" if same else None

    @property
    def axes_of_recordings(self) -> list[str]:
        """The axes that the law reads, without frequency."""
        return [name for name in self.axes_read if name != FREQUENCY]

    def _evaluated(self, values: Values, axes: dict[str, Floats], rows: int) -> list[Differentiated]:
        """The value of each expression on this number of rows."""
        first = next(iter(values.values()))
        names: dict[str, Value] = {**values, **axes}
        answers = []
        for law in self.laws:
            value = value_of(law, names)
            if not isinstance(value, Differentiated):
                value = constant(np.asarray(value), len(first.slopes), first.value.shape[:-1])
            answers.append(value.spread(rows))
        return answers

    def _axes(self, design: FrfDesign, ids: Sequence[str]) -> dict[str, Floats]:
        bound = self.bound or _bound(design.conditions)
        return {name: np.array([bound.axes[name][key] for key in ids]) for name in self.axes_of_recordings}


class DeclaredOfRecordings(DeclaredOfFrf):
    """A declared mechanism that changes the level of each recording."""

    stage = Stage.RECORDING

    def act(self, state: FrfState, values: Values) -> None:
        """Set the factor on each recording."""
        state.factor = self._factor(state.design, values)

    def _factor(self, design: FrfDesign, values: Values) -> Differentiated:
        tables = (self.bound or _bound(design.conditions)).tables
        rows = tables.rows(design.ids)
        first, *second = self._evaluated(values, self._axes(design, design.ids), len(design.ids))
        if self.acts_on == "position":
            return tables.moved(rows, first, second[0])
        if self.acts_on == "gain":
            return first
        if self.acts_on == "force":
            return tables.factor("force", rows, log_positive(first / tables.forces(design.ids)))
        return tables.factor(self.acts_on, rows, log_of(first))


class DeclaredOfLines(DeclaredOfFrf):
    """A declared mechanism that changes each line."""

    stage = Stage.LINES

    @property
    def reads(self) -> tuple[str, ...]:  # type: ignore[override]
        """The recordings, where the law reads an axis of theirs."""
        return ("id",) if self.axes_of_recordings else ()

    def act(self, state: FrfState, values: Values) -> None:
        """Set the complex factor on each distinct line."""
        design = state.design
        ids = [design.ids[number] for number in design.contact_recording]
        axes = {name: column[design.line_contact] for name, column in self._axes(design, ids).items()}
        (factor,) = self._evaluated(values, {**axes, FREQUENCY: design.line_frequency}, len(design.line_frequency))
        state.factor = Differentiated(factor.value.astype(complex), factor.slopes.astype(complex))


_LARGEST_FACTOR = (
    1e6  # a factor, newtons or millimetres: the bound on what an expression gives far from usual parameters
)


class DeclaredOfCurves(DeclaredMechanism):
    """A declared mechanism of indentations.

    `modulus`: a factor on the contact force, equivalent to the modulus without adhesion and stage compliance;
    `gain`: a factor on the cell's gain; `force`: newtons added to the reading; `position`: millimetres added to the
    travel.
    """

    kinds = ("indentation",)
    stage = Stage.CURVE
    needs_axes = "of every sample"
    start_times: Mapping[str, float] | None = None  # start of each recording [s], by its id

    def bind(self, conditions: Conditions, table: SigmaTable) -> "DeclaredOfCurves":
        """A copy bound to the recordings of a campaign."""
        other = copy(self)
        curves = curves_of(conditions)
        other.start_times = {
            recording.id: float(recording.time_s[0]) for recording in curves if recording.time_s is not None
        }
        return other

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """Recordings without times, where the law reads them."""
        curves = conditions.of(IndentationConditions)
        untimed = "time_s" in self.axes_read and any(recording.time_s is None for recording in curves)
        return "not every recording has time_s" if untimed else None

    def act(self, state: Curve, values: Values) -> None:
        """Add the law at these parameter values to the curve's laws."""
        change = partial(self._change, {name: numbers(value) for name, value in values.items()})
        state.laws.append(SampleLaw(self.acts_on, change))

    def _change(self, values: Mapping[str, Floats], samples: Samples, force: Floats) -> Floats:
        """The expression at samples (points, curves, samples) where the contact force is `force` [N]."""
        axes = {name: samples.along(name, force, self.start_times or {}) for name in self.axes_read}
        with np.errstate(all="ignore"):
            result = np.asarray(value_of(self.laws[0], {**values, **axes})) + np.zeros(
                np.broadcast(samples.travel, force).shape
            )
        return np.clip(
            np.nan_to_num(result, nan=_LARGEST_FACTOR, posinf=_LARGEST_FACTOR, neginf=-_LARGEST_FACTOR),
            -_LARGEST_FACTOR,
            _LARGEST_FACTOR,
        )
