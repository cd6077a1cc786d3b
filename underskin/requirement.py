"""What a refused value must be, in words, with the other fields that these words mention kept apart from them.

An interface whose users know the fields by other names, such as a form, words the mentions itself.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self


@dataclass(frozen=True)
class Mention:
    """A field in a sentence; `words` stand for it where its users know it by its name."""

    field: str
    words: str = ""

    def __str__(self) -> str:
        return self.words or self.field


class Requirement(str):
    """A sentence of plain parts and mentions; as a text it has the mentions as they stand."""

    __slots__ = ("parts",)
    parts: tuple[str | Mention, ...]

    def __new__(cls, *parts: str | Mention) -> Self:
        """Parts that are requirements themselves are taken apart."""
        flat = tuple(one for part in parts for one in (part.parts if isinstance(part, Requirement) else (part,)))
        made = super().__new__(cls, "".join(map(str, flat)))
        made.parts = flat
        return made

    def worded(self, word: Callable[[Mention], str]) -> str:
        """The sentence with each mention as `word` has it."""
        return "".join(word(part) if isinstance(part, Mention) else part for part in self.parts)


UNITS_CHECKED = Mention("units_checked", " (or set units_checked to true)")  # which takes an unlikely magnitude
