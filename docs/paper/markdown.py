"""Small pieces of Markdown."""

from collections.abc import Iterable, Sequence

import numpy as np


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def percent(value: float, reference: float) -> float:
    """By how much `value` differs from `reference`, in percent of the latter."""
    return float(100 * (value / reference - 1))


def ceiling(error: float) -> str:
    """The next power of ten above an error, as 1e-6; nothing below 1e-12 is told apart."""
    return f"1e{int(np.ceil(np.log10(max(error, 1e-12))))}"
