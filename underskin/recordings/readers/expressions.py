"""Arithmetic expressions in text: laws of mechanism files, formulas of derived channels.

Python's `ast` parses them, and one whitelist over its nodes accepts numbers, names, + − * /, parentheses and what a
grammar adds; everything else is rejected, and nothing is compiled or executed.
"""

import ast
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from underskin.errors import InvalidInput
from underskin.recordings.readers.unit_labels import exponents
from underskin.recordings.validation import shown

_MOST_TERMS = 200
_LARGEST = 1e30  # of a number
_OPERATORS = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.USub)


@dataclass(frozen=True)
class Grammar:
    """What expressions of one kind may hold beside numbers, + − * / and parentheses.

    Without `names` any name is allowed, also in quotes, and a unit in brackets after a name or a number.
    """

    form: str  # what an expression must be, in words
    longest: int  # characters
    names: Collection[str] | None = None
    functions: Mapping[str, int] = field(default_factory=dict)  # the number of arguments of each
    operators: tuple[type[ast.AST], ...] = ()


@dataclass(frozen=True)
class Expression:
    """A parsed expression: its text and its tree."""

    text: str
    tree: ast.expr = field(compare=False)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The distinct names in it, from left to right, without functions and units."""
        return tuple(dict.fromkeys(_names(self.text, self.tree)))

    @property
    def is_sum(self) -> bool:
        """Whether two terms that hold names are added or subtracted anywhere in it."""
        return any(
            all(any(_names(self.text, side)) for side in (node.left, node.right))
            for node in _terms(self.tree)
            if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)
        )


def read(text: object, place: str, grammar: Grammar) -> Expression:
    """Parse an expression; raises InvalidInput that names the place, the invalid term and what is allowed."""
    if not isinstance(text, str) or len(text) > grammar.longest:
        raise InvalidInput(place, shown(text), f"must be an expression of up to {grammar.longest} characters")
    text = text.strip()
    try:
        tree = ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        column = getattr(error, "offset", None)
        raise InvalidInput(place, text, grammar.form + (f"; look at character {column}" if column else "")) from None
    if b"#" in text.encode()[tree.end_col_offset or 0 :]:  # to `ast` the rest is a comment
        raise InvalidInput(place, text, f"{grammar.form}; a name with # in quotes")
    if sum(isinstance(node, ast.expr) for node in ast.walk(tree)) > _MOST_TERMS:
        raise InvalidInput(place, text, f"must have up to {_MOST_TERMS} terms")
    for node in _terms(tree):
        reason = _refusal(text, node, grammar)
        if reason is not None:
            raise InvalidInput(place, text, f"{shown(source(text, node))}: {reason}")
    return Expression(text, tree)


def source(text: str, node: ast.expr) -> str:
    """A node as it is written."""
    return (ast.get_source_segment(text, node) or "").strip()


def name_of(text: str, node: ast.expr) -> str | None:
    """The name that a node is, as written (`ast` would normalise its letters); None for other nodes."""
    if isinstance(node, ast.Name):
        return source(text, node)
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def _terms(node: ast.expr) -> Iterator[ast.expr]:
    """A node and those in it, from left to right, without names of functions and units in brackets."""
    yield node
    inner = [node.value] if isinstance(node, ast.Subscript) else ast.iter_child_nodes(node)
    for child in node.args if isinstance(node, ast.Call) else inner:
        if isinstance(child, ast.expr):
            yield from _terms(child)


def _names(text: str, tree: ast.expr) -> Iterator[str]:
    return (name for node in _terms(tree) if (name := name_of(text, node)) is not None)


def _refusal(text: str, node: ast.expr, grammar: Grammar) -> str | None:
    """Why the grammar does not allow a node; None where it does."""
    match node:
        case ast.BinOp(op=op) | ast.UnaryOp(op=op) if isinstance(op, (*_OPERATORS, *grammar.operators)):
            return None
        case ast.Constant(value=value) if type(value) in (int, float):
            return None if abs(value) <= _LARGEST else "is too large a number"  # type: ignore[arg-type]
        case ast.Name() if grammar.names is not None:
            allowed = source(text, node) in grammar.names
            return None if allowed else f"must be one of {', '.join(sorted(grammar.names))}"
        case ast.Name() | ast.Constant(value=str()) if grammar.names is None:
            return None
        case ast.Subscript(value=ast.Constant() | ast.Name(), slice=label) if grammar.names is None:
            unit = source(text, label)
            known = exponents(unit) is not None
            return None if known else f"{unit!r} is no unit that is known here, such as N, mm, V, pC or N/m"
        case ast.Call(func=ast.Name(id=name), keywords=[], args=arguments) if grammar.functions:
            arities = ", ".join(f"{key} of {count}" for key, count in grammar.functions.items())
            is_right = grammar.functions.get(name) == len(arguments)
            return None if is_right else f"must be a function with its arguments: {arities}"
    return f"is not allowed; it {grammar.form}"
