"""Formulas of derived channels: arithmetic and units against an independent evaluation, and what is refused."""

import operator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from underskin.errors import FileError, InvalidInput
from underskin.recordings.channels import Block, Channel, Contents
from underskin.recordings.readers.channel_arithmetic import parse, with_derived
from underskin.recordings.readers.unit_labels import unit

SAMPLES = np.array([1.0, -2.0, 3.5, 0.25])
# Each label with its factor to SI and exponents of m, N, C, s: by hand, not by the code under test.
UNITS = {
    "nm": (1e-9, (1, 0, 0, 0)),
    "mm": (1e-3, (1, 0, 0, 0)),
    "mN": (1e-3, (0, 1, 0, 0)),
    "N/m": (1.0, (-1, 1, 0, 0)),
    "pC": (1e-12, (0, 0, 1, 0)),
    "V": (1.0, (1, 1, -1, 0)),
    "mV/pC": (1e9, (1, 1, -2, 0)),
    "kPa": (1e3, (-2, 1, 0, 0)),
    "ms": (1e-3, (0, 0, 0, 1)),
}
OPERATORS = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}


@dataclass
class Measured:
    """A value with its dimension, as a textbook combines them; None as dimension: it cannot be. `cancels`: a sum in it
    is so much less than its terms that rounding decides."""

    values: Any
    powers: tuple[int, ...] | None
    cancels: bool = False

    def combined(self, sign: str, other: "Measured") -> "Measured":
        cancels = self.cancels or other.cancels
        if self.powers is None or other.powers is None or cancels:
            return Measured(None, None, cancels)
        if sign in "+-":
            values = OPERATORS[sign](self.values, other.values)
            terms = np.maximum(np.abs(self.values), np.abs(other.values))
            alike = self.powers == other.powers
            return Measured(values, self.powers if alike else None, bool(np.any(np.abs(values) < 1e-4 * terms)))
        turn = 1 if sign == "*" else -1
        powers = tuple(a + turn * b for a, b in zip(self.powers, other.powers, strict=True))
        return Measured(OPERATORS[sign](self.values, other.values), powers)

    def negative(self) -> "Measured":
        return Measured(None if self.powers is None else -self.values, self.powers, self.cancels)


NUMBERS = st.floats(0.1, 100).map(lambda number: float(f"{number:.4g}"))
LABELS = st.sampled_from(sorted(UNITS))
TERMS = st.one_of(
    LABELS.map(lambda label: (f"'in {label}'", Measured(UNITS[label][0] * SAMPLES, UNITS[label][1]))),
    st.tuples(NUMBERS, LABELS).map(
        lambda one: (f"{one[0]!r} [{one[1]}]", Measured(one[0] * UNITS[one[1]][0], UNITS[one[1]][1]))
    ),
    NUMBERS.map(lambda number: (repr(number), Measured(number, (0, 0, 0, 0)))),
)


def together(parts: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    both = st.tuples(parts, st.sampled_from("+-*/"), parts).map(
        lambda one: (f"({one[0][0]} {one[1]} {one[2][0]})", one[0][1].combined(one[1], one[2][1]))
    )
    negative = parts.map(lambda one: (f"-{one[0]}", one[1].negative()))
    return both | negative


FORMULAS = st.recursive(TERMS, together, max_leaves=6)


def derived(formula: str, *channels: Channel, properties: dict[str, str | float] | None = None) -> Channel:
    contents = Contents((Block("", channels),), properties or {})
    made = with_derived(contents, {"new": parse("derived.new", formula)}, lambda _: contents.properties, "a.csv")
    channel = made.blocks[0].channel("new")
    assert channel is not None
    return channel


def in_si(channel: Channel) -> np.ndarray:
    known = unit(channel.unit)
    return np.asarray(channel.values * (1.0 if known is None else known.to_si))


def powers_of(label: str) -> tuple[int, ...]:
    """The exponents of a unit, read off its letters."""
    above, _, below = label.partition("/")
    bases = {"m": (1, 0, 0, 0), "N": (0, 1, 0, 0), "C": (0, 0, 1, 0), "s": (0, 0, 0, 1), "V": (1, 1, -1, 0)}
    bases |= {"Pa": (-2, 1, 0, 0), "Hz": (0, 0, 0, -1), "A": (0, 0, 1, -1), "m/s^2": (1, 0, 0, -2), "1": (0, 0, 0, 0)}
    if label in bases:
        return bases[label]
    up, down = (next(bases[base] for base in bases if part.endswith(base)) for part in (above, below or "1"))
    return tuple(one - other for one, other in zip(up, down, strict=True))


ALL = tuple(Channel(f"in {label}", label, SAMPLES) for label in UNITS)


@given(FORMULAS)
def test_values_and_units_are_those_of_a_textbook(case: tuple[str, Measured]) -> None:
    formula, expected = case
    whole = f"{formula} * ('in mm' / 'in mm')"  # a channel, also where all terms are constants
    assume(not expected.cancels)
    if expected.powers is None:
        with pytest.raises(FileError, match=r"units of one kind"):
            derived(whole, *ALL)
        return
    try:
        channel = derived(whole, *ALL)
    except FileError as error:
        assume("which no channel can have" not in error.reason)
        raise
    np.testing.assert_allclose(in_si(channel), np.ones(4) * expected.values, rtol=1e-9)
    assert powers_of(channel.unit) == expected.powers


@pytest.mark.slow
@given(st.text(max_size=60) | st.text(alphabet="ab0.'[]()+-*/ _,:=@!{}", max_size=40))
def test_any_text_is_a_formula_or_is_refused(text: str) -> None:
    try:
        formula = parse("derived.x", text)
    except InvalidInput:
        return
    assert formula.text == text.strip()


@pytest.mark.parametrize(
    ("formula", "term"),
    [
        ("a ** 2", "a ** 2"),
        ("a + __import__('os').system('true')", "__import__('os').system('true')"),
        ("a + b.values", "b.values"),
        ("a - (lambda: 1)()", "(lambda: 1)()"),
        ("a * [1, 2]", "[1, 2]"),
        ("a * True", "True"),
        ("a * 2j", "2j"),
        ("a + b'c'", "b'c'"),
        ("a * f'{b}'", "f'{b}'"),
        ("a // b", "a // b"),
        ("~a", "~a"),
        ("a if b else 1", "a if b else 1"),
        ("a * 1e999", "1e999"),
        ("a * 2 [furlong]", "2 [furlong]"),
        ("a[b][c]", "a[b][c]"),
    ],
)
def test_what_is_no_arithmetic_is_refused_by_its_term(formula: str, term: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        parse("derived.x", formula)
    assert refused.value.allowed.startswith(f"{term}: ")


@pytest.mark.parametrize("formula", ["", "a -", "0.05 N/m * a", "(" * 150 + "a", "-" * 201, "a\\", "import os"])
def test_what_cannot_be_parsed_is_refused_with_an_example(formula: str) -> None:
    with pytest.raises(InvalidInput, match="must"):
        parse("derived.x", formula)


@pytest.mark.parametrize(
    ("formula", "said"),
    [
        ("Piezo - Load", "Piezo - Load: Piezo has the unit nm, Load has the unit mN"),
        ("Piezo - 5", "5 has no unit"),
        ("2 [N/m] * Piezo + Piezo", "2 [N/m] * Piezo has the unit N"),
        ("Piezo - Raw", "Raw: has no unit in the file: say it in brackets"),
        ("Piezo [V]", "Piezo [V]: is labelled 'nm', but the formula says 'V'"),
        ("Piezo * Piezo", "which no channel can have"),
        ("Piezo - Height", "Height: is no channel or property; it has Piezo [nm]"),
        ("Piezo - Short", "Piezo and Short differ in length"),
        ("Piezo / (1 - 1)", "is a division by 0"),
        ("k [N/m] * Piezo", "k: the file states 'soft', which is no number"),
    ],
)
def test_a_term_that_does_not_fit_is_named(formula: str, said: str) -> None:
    channels = [Channel("Piezo", "nm", SAMPLES), Channel("Load", "mN", SAMPLES), Channel("Raw", "", SAMPLES)]
    with pytest.raises(FileError) as refused:
        derived(formula, *channels, Channel("Short", "nm", SAMPLES[:2]), properties={"k": "soft"})
    assert refused.value.place == "derived.new"
    assert said in refused.value.reason
