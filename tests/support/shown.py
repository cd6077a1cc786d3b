"""What a page shows against what a program prints: numbers as numbers, to the digits shown; all else as text.

Processors round differently in the last digit: 0.75 on one is 0.7499999999999999 on another.
"""

import re

_NUMBER = r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?"
# In a page: a number that is cut off (14.007…), a number, white space, … for anything, a piece of text.
_PIECES = re.compile(
    rf"(?<![\w.])(?P<cut>[-+]?\d+\.\d*)…|(?<![\w.])(?P<whole>{_NUMBER})(?!…)|(?P<space>\s+)|(?P<any>…)|."
)
_ROUNDING = 1e-9  # of a number, beyond the half digit that rounding to those shown makes


def is_as_shown(shown: str, printed: str) -> bool:
    """Whether `printed` is what a page shows, where … stands for anything, behind digits for more of them.

    White space may differ. A number agrees where it is the one shown when rounded to as many digits, or, cut off, when
    it begins with them.
    """
    pattern, numbers = _pattern(shown.strip())
    match = re.fullmatch(pattern, printed.strip())
    return match is not None and all(
        _agrees(number, is_cut, float(group)) for (number, is_cut), group in zip(numbers, match.groups(), strict=True)
    )


def _pattern(shown: str) -> tuple[str, list[tuple[str, bool]]]:
    """A regular expression with a group for each number, and the numbers: as text, and whether they are cut off."""
    parts, numbers = [], []
    for piece in _PIECES.finditer(shown):
        number = piece["cut"] or piece["whole"]
        if number:
            numbers.append((number, bool(piece["cut"])))
            parts.append(rf"(?<![\w.])((?>{_NUMBER}))")  # a number as a whole: parts of it are tried for no other
        else:
            parts.append(r"\s*+" if piece["space"] else r"[\s\S]*?" if piece["any"] else re.escape(piece[0]))
    return "".join(parts), numbers


def _agrees(shown: str, is_cut: bool, printed: float) -> bool:
    mantissa, _, exponent = shown.lower().partition("e")
    digit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    beyond = abs(printed) - abs(float(shown)) if is_cut else abs(printed - float(shown))
    rounding = _ROUNDING * abs(float(shown)) + 1e-15
    if is_cut:
        same_sign = (printed < 0) == shown.startswith("-") or abs(printed) < rounding
        return same_sign and -rounding <= beyond <= digit + rounding
    return beyond <= digit / 2 + rounding
