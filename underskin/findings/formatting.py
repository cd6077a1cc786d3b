"""Numbers, probabilities, lists and clauses for readers, and equal problems of many recordings in one line."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal
from typing import Any


def significant(value: float, digits: int, *, trailing_zeros: bool = False) -> str:
    """To significant digits; below 100,000 never with a positive power of ten: 13,600 is 13600, not 1.36e+04."""
    text = format(value, f"#.{digits}g" if trailing_zeros else f".{digits}g").rstrip(".")
    if "e+0" in text and abs(value) < 1e5:
        return format(float(text), ".0f")
    return text


def in_percent(probability: float) -> str:
    """A probability in words; never 0 or 100 %."""
    stated = round(probability, 3)
    if 0.001 <= stated <= 0.999:
        return f"{100 * stated:.3g} %"
    return "under 0.1 %" if stated < 0.5 else "over 99.9 %"


def times_in_words(nats: float) -> str:
    """exp(nats) as a factor: "about 40 times", "more than a million times"."""
    return f"about {in_digits(math.exp(nats), 1)} times" if nats < math.log(1e6) else "more than a million times"


def in_digits(value: float, digits: int = 4) -> str:
    """To significant digits, never as a power of ten."""
    text = format(Decimal(f"{value:.{digits}g}"), "f")
    return text.rstrip("0").rstrip(".") if "." in text else text


def listed(names: Sequence[str]) -> str:
    """Names joined with commas and a final "and"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def few(names: Sequence[str], most: int) -> str:
    """The first names, joined, and the number of further ones."""
    return listed([*names[:most], *([f"{len(names) - most} more"] if len(names) > most else [])])


_END = re.compile(r"([.?!]) +(?=[\"'(]?[A-Z])")  # end of a sentence within a clause
_END_OR_STOP = re.compile(r"([.?!]) +")
_STOP = re.compile(r"\. +")
_NAME = re.compile(r"\w+('s|s')")  # Hertz's, Mullins': keeps its capital
_SYMBOLS = ("d33",)  # keep their small letter at the beginning of a sentence


def of_clauses(*sentences: Sequence[str], names: Sequence[str] = ()) -> str:
    """One sentence from the clauses of each of `sentences`; empty clauses, and sentences without any, are left out.

    Within a sentence no full stop is followed by a space, so that the sentences can be split again. `names` of
    campaigns and skins are not split: "Palm 2. Upper" is no end of a sentence.

    >>> of_clauses(["one slip: given in µm? Left out", "apart from that, all agrees"], [], ["d33 to quote: 14 pC/N"])
    'One slip: given in µm? – left out; apart from that, all agrees. d33 to quote: 14 pC/N.'
    """
    protected_names = {name: _END_OR_STOP.sub("\\1\N{NO-BREAK SPACE}", name) for name in names}

    def as_clause(text: str) -> str:
        for name, protected in protected_names.items():
            text = text.replace(name, protected)
        return clause(text)

    filled = ([as_clause(text) for text in clauses if text] for clauses in sentences)
    texts = (capital("; ".join(map(small, clauses))) for clauses in filled if clauses)
    return " ".join(text if text.endswith("?") else f"{text}." for text in texts)


def clause(text: str) -> str:
    """A text of one or several sentences as part of a sentence, without a full stop at its end."""
    first, *parts = _END.split(text.strip().rstrip("."))
    for mark, following in zip(parts[::2], parts[1::2], strict=True):
        first += f"{'; ' if mark == '.' else f'{mark} – '}{small(following)}"
    return _STOP.sub(".\N{NO-BREAK SPACE}", first)


def capital(text: str) -> str:
    """The text with a capital at its beginning, unless it begins with a symbol."""
    return text if text.startswith(_SYMBOLS) else text[:1].upper() + text[1:]


def small(text: str) -> str:
    """The text with a small letter at its beginning, unless it begins with a symbol or a name."""
    plain = text[1:2].islower() or text.startswith("A ")
    return text[:1].lower() + text[1:] if plain and not _NAME.match(text) else text


_FEWEST = 3  # recordings with one reason that are grouped
_NAMED = 3


def grouped_by_reason(problems: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Pairs of recording and reason; three or more recordings with one reason become one pair that names the first of
    them and their number."""
    by_reason: dict[str, list[str]] = {}
    for recording, reason in problems:
        by_reason.setdefault(reason, []).append(recording)
    grouped = []
    for reason, recordings in by_reason.items():
        if len(recordings) < _FEWEST:
            grouped += [(recording, reason) for recording in recordings]
        else:
            more = f" and {len(recordings) - _NAMED} more" if len(recordings) > _NAMED else ""
            grouped.append((f"{', '.join(recordings[:_NAMED])}{more}", reason))
    return grouped


def left_out_lines(problems: Iterable[tuple[str, str]]) -> list[str]:
    """Lines on recordings of which no number follows, from pairs of recording and reason."""
    return [f"left out: {recordings_called(names)}: {why}" for names, why in grouped_by_reason(problems)]


def recordings_called(names: str) -> str:
    """Names from `grouped_by_reason`, preceded by the noun."""
    return f"recording{'s' if ', ' in names else ''} {names}"


def why_refused(error: Mapping[str, Any]) -> str:
    """An entry of the service's `errors` in words: with the value if one was sent; of a file only the reason."""
    if error["field"] == "file":
        return str(error["allowed"])
    value = "" if error["value"] is None else f" = {error['value']!r}"
    return f"{error['field']}{value}: {error['allowed']}"
