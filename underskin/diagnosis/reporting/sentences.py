"""A statement as a few sentences of clauses, so that it stays short however much there is to say.

>>> of_clauses(["one slip: given in µm? Left out", "apart from that, all agrees"], [], ["d33 to quote: 14 pC/N"])
'One slip: given in µm? – left out; apart from that, all agrees. d33 to quote: 14 pC/N.'
"""

import re
from collections.abc import Sequence

_END = re.compile(r"([.?!]) +(?=[\"'(]?[A-Z])")  # of a sentence within a clause
_END_OR_STOP = re.compile(r"([.?!]) +")
_STOP = re.compile(r"\. +")
_NAME = re.compile(r"\w+('s|s')")  # Hertz's, Mullins': stays as it is
_SYMBOLS = ("d33",)  # that no sentence writes with a capital


def of_clauses(*sentences: Sequence[str], names: Sequence[str] = ()) -> str:
    """One sentence of each of `sentences` that has a clause that is not empty; within them no full stop stands before
    a space, so that they can be told apart again by these. `names` of campaigns and skins stay whole: "Palm 2. Upper"
    is no end of a sentence."""
    kept = {name: _END_OR_STOP.sub("\\1\N{NO-BREAK SPACE}", name) for name in names}

    def told(text: str) -> str:
        for name, whole in kept.items():
            text = text.replace(name, whole)
        return clause(text)

    filled = ([told(text) for text in clauses if text] for clauses in sentences)
    return " ".join(f"{capital('; '.join(map(small, clauses)))}." for clauses in filled if clauses)


def clause(text: str) -> str:
    """A text of one sentence or of several as part of a sentence, without the full stop at its end."""
    first, *parts = _END.split(text.strip().rstrip("."))
    for mark, following in zip(parts[::2], parts[1::2], strict=True):
        first += f"{'; ' if mark == '.' else f'{mark} – '}{small(following)}"
    return _STOP.sub(".\N{NO-BREAK SPACE}", first)


def capital(text: str) -> str:
    """With a capital at its beginning."""
    return text if text.startswith(_SYMBOLS) else text[:1].upper() + text[1:]


def small(text: str) -> str:
    """With a small letter at its beginning, unless that is a symbol or somebody's name."""
    plain = text[1:2].islower() or text.startswith("A ")
    return text[:1].lower() + text[1:] if plain and not _NAME.match(text) else text
