"""Numbers and probabilities for readers."""

from decimal import Decimal


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


def in_digits(value: float, digits: int = 4) -> str:
    """To significant digits, never as a power of ten."""
    text = format(Decimal(f"{value:.{digits}g}"), "f")
    return text.rstrip("0").rstrip(".") if "." in text else text
