"""A trend as a word-sized line chart."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

_WIDTH, _HEIGHT, _EDGE = 120, 28, 3
_LEAST_SPAN = 0.2  # of the values, over the height


@dataclass(frozen=True)
class Sparkline:
    """Points of an SVG polyline, its last point, and what it shows in words."""

    width: int
    height: int
    points: str
    end: tuple[float, float]
    words: str


def sparkline(values: Sequence[tuple[str, float]]) -> Sparkline | None:
    """d33 [pC/N] over time (ISO 8601), by time; None where there are fewer than two."""
    if len(values) < 2:
        return None
    moments = [datetime.fromisoformat(time).timestamp() for time, _ in values]
    numbers = [value for _, value in values]
    x = _scaled(moments, _WIDTH)
    # No less than a fifth of the value, so that a scatter of a few per cent looks like one.
    middle = (min(numbers) + max(numbers)) / 2
    half = max(max(numbers) - middle, _LEAST_SPAN / 2 * abs(middle))
    low, high = middle - half, middle + half
    y = [_HEIGHT - _EDGE - (value - low) / ((high - low) or 1.0) * (_HEIGHT - 2 * _EDGE) for value in numbers]
    pairs = list(zip(x, y, strict=True))
    change = f"d33 {numbers[0]:.3g} to {numbers[-1]:.3g} pC/N, {values[0][0][:10]} to {values[-1][0][:10]}"
    return Sparkline(_WIDTH, _HEIGHT, " ".join(f"{px:.1f},{py:.1f}" for px, py in pairs), pairs[-1], change)


def _scaled(values: Sequence[float], length: int) -> list[float]:
    span = (values[-1] - values[0]) or 1.0
    return [_EDGE + (value - values[0]) / span * (length - 2 * _EDGE) for value in values]
