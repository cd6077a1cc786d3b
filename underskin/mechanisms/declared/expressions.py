"""Expressions of a declared law: read by a whitelist over the syntax tree, evaluated with derivatives.

Numbers, names, + − * / **, and the functions of FUNCTIONS with one or two arguments; `pi` and `i` (√−1) are known. No
attribute, index, comparison, string, keyword or call of anything else is read, and no code is compiled or executed.
"""

import ast
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.autodiff import Differentiated, chain, exp, log, where
from underskin.errors import InvalidInput
from underskin.units import Array

LONGEST, _MOST_NODES, _LARGEST = 500, 200, 1e12
Value = Differentiated | Array | complex
CONSTANTS: Mapping[str, np.float64 | np.complex128] = {"pi": np.float64(np.pi), "i": np.complex128(1j)}


@dataclass(frozen=True)
class Expression:
    """One that was read. Attributes: `text`; `names` of parameters and axes in it."""

    text: str
    names: frozenset[str]
    _tree: ast.expr

    def __call__(self, values: Mapping[str, Value]) -> Value:
        """Its value where names have these values."""
        return _value(self._tree, values)


def read(text: str, field: str, known: Collection[str]) -> Expression:
    """Read an expression in these names; raises InvalidInput that names the field, the place and what is allowed."""
    if not isinstance(text, str) or not text.strip() or len(text) > LONGEST:
        raise InvalidInput(field, text, f"must be an expression of 1 to {LONGEST} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        place = f" at column {error.offset}" if isinstance(error, SyntaxError) and error.offset else ""
        raise InvalidInput(field, text, f"cannot be read as an expression{place}") from None
    nodes = list(ast.walk(tree.body))
    if len(nodes) > _MOST_NODES:
        raise InvalidInput(field, text, "is too long to be a law: take several")
    called = {id(node.func) for node in nodes if isinstance(node, ast.Call)}
    for node in nodes:
        _check(node, field, known, called)
    names = {node.id for node in nodes if isinstance(node, ast.Name) and id(node) not in called}
    return Expression(text.strip(), frozenset(names - set(CONSTANTS)), tree.body)


def _check(node: ast.AST, field: str, known: Collection[str], called: Collection[int]) -> None:
    """Raises InvalidInput for everything that is not on the list."""
    if isinstance(node, ast.expr_context | ast.operator | ast.unaryop):
        allowed = isinstance(node, ast.Load | ast.Add | ast.Sub | ast.Mult | ast.Div | ast.Pow | ast.USub | ast.UAdd)
        if not allowed:
            raise InvalidInput(field, type(node).__name__, "may use + − * / ** only")
        return
    place = f"{field}, column {getattr(node, 'col_offset', 0) + 1}"
    if isinstance(node, ast.Constant):
        number = type(node.value) in (int, float) and abs(node.value) <= _LARGEST  # type: ignore[arg-type]
        if not number:
            raise InvalidInput(place, repr(node.value)[:40], "must be a number of usual size")
    elif isinstance(node, ast.Name):
        if id(node) not in called and node.id not in CONSTANTS and node.id not in known:
            raise InvalidInput(place, node.id, f"must be one of {', '.join([*sorted(known), *CONSTANTS])}")
    elif isinstance(node, ast.Call):
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name not in FUNCTIONS or node.keywords or len(node.args) != FUNCTIONS[name][0]:
            arguments = ", ".join(f"{key} of {count}" for key, (count, _) in FUNCTIONS.items())
            raise InvalidInput(place, ast.unparse(node)[:40], f"must be a function with its arguments: {arguments}")
    elif not isinstance(node, ast.BinOp | ast.UnaryOp):
        raise InvalidInput(place, type(node).__name__, "is not allowed: numbers, names, + − * / ** and functions are")


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
            return _combined(op, _value(left, values), _value(right, values))
        case ast.Call(func=ast.Name(id=name), args=args):
            return FUNCTIONS[name][1](*(_value(entry, values) for entry in args))
    raise AssertionError(node)  # `read` lets nothing else through


def _combined(op: ast.operator, a: Value, b: Value) -> Value:
    match op:
        case ast.Add():
            return a + b
        case ast.Sub():
            return a - b
        case ast.Mult():
            return a * b
        case ast.Div():
            return a / b
    if isinstance(b, Differentiated):
        return _exp(b * _log(a))
    if isinstance(a, Differentiated):
        return a ** float(np.asarray(b).real) if np.ndim(b) == 0 else _exp(_log(a) * b)
    return np.asarray(a, dtype=complex if np.iscomplexobj(a) else float) ** b


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


FUNCTIONS: Mapping[str, tuple[int, Callable[..., Value]]] = {  # how many arguments, and what it is
    "exp": (1, _exp),
    "log": (1, _log),
    "sqrt": (1, lambda x: _combined(ast.Pow(), x, 0.5)),
    "sin": (1, _by(np.sin, np.cos)),
    "cos": (1, _by(np.cos, lambda x: -np.sin(x))),
    "tanh": (1, _by(np.tanh, lambda x: 1 - np.tanh(x) ** 2)),
    "step": (1, _by(lambda x: (x > 0).astype(float), lambda x: np.zeros(np.shape(x)))),  # 1 above 0, else 0
    "max": (2, _larger),
    "min": (2, lambda a, b: -_larger(-a, -b)),
}


def together(expressions: Sequence[Expression]) -> frozenset[str]:
    """The names in several."""
    return frozenset().union(*(entry.names for entry in expressions))
