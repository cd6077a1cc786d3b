"""Which limit a row exceeds that is out of the domain, in words: `L = 1.17 exceeds 0.1: at most 25.6 N`."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.physics.skin import INCOMPRESSIBLE
from underskin.prediction.pressed_skin import Transmission
from underskin.surrogate.contact_model import ContactModel
from underskin.units import Floats, Mask

OTHER_MODULUS = "Poisson's ratio = {:g}: the table is of incompressible elastomer, 0.5"
NOT_FINITE = "the result is too large a number"
SYMBOLS = {"load_parameter": "L", "a_over_h": "a/h", "rt_over_h": "rT/h"}
Domain = Mapping[str, tuple[float, float]]
Words = Sequence[str | None]


@dataclass(frozen=True)
class Limit:
    """A quantity by its symbol, its values of each row, its lowest and highest; and of a force that it grows with the
    highest [N] of each row."""

    symbol: str
    values: Floats
    low: float
    high: float
    most_n: Floats | None = None


def of_numbers(numbers: Mapping[str, Floats], domain: Domain) -> list[Limit]:
    """The limits of dimensionless numbers by their names."""
    return [Limit(SYMBOLS[name], numbers[name], *domain[name]) for name in SYMBOLS if name in domain]


def of_pressed(reached: Transmission, preload_n: Floats, contact_model: ContactModel) -> list[Limit]:
    """The limits of a skin under a sphere, with the preload at which each is reached."""
    domain, alpha = contact_model.domain, reached.small_strain_a_over_h
    load, over_h = (domain[name][1] for name in ("load_parameter", "a_over_h"))
    with np.errstate(all="ignore"):
        at_limit, _ = contact_model.load_over_cube(np.array(over_h))
        at_rows, _ = contact_model.load_over_cube(alpha)
        most = {
            "load_parameter": preload_n * (load / reached.load_parameter),
            "a_over_h": preload_n * (over_h / alpha) ** 3 * (at_limit / at_rows),
        }
    values = {"load_parameter": reached.load_parameter, "a_over_h": alpha, "rt_over_h": reached.rt_over_h}
    return [Limit(SYMBOLS[name], values[name], *domain[name], most_n=most.get(name)) for name in SYMBOLS]


def in_words(
    inside: Mask, count: int, limits: Sequence[Limit], poisson_ratio: Floats | float = INCOMPRESSIBLE
) -> Words | None:
    """Of each row that is not inside what it exceeds, and where a force would be inside the highest; None where all
    are inside."""
    rows = np.flatnonzero(~np.broadcast_to(inside, (count,)))
    if not rows.size:
        return None
    words: list[str | None] = [None] * count
    ratio = _at(np.asarray(poisson_ratio), rows, count)
    values = [_at(limit.values, rows, count) for limit in limits]
    most = [[math.inf] * len(rows) if limit.most_n is None else _at(limit.most_n, rows, count) for limit in limits]
    for place, row in enumerate(rows.tolist()):
        if ratio[place] != INCOMPRESSIBLE:
            words[row] = OTHER_MODULUS.format(ratio[place])
            continue
        beyond = [
            (told, most[number][place])
            for number, limit in enumerate(limits)
            for told in _told(limit, values[number][place])
        ]
        forces = [force for _, force in beyond]
        # No force brings a row back that exceeds another limit as well.
        at_most = f": at most {_rounded_down(min(forces))} N" if forces and all(map(math.isfinite, forces)) else ""
        words[row] = (", ".join(told for told, _ in beyond) or NOT_FINITE) + at_most
    return words


def _at(values: Floats, rows: np.ndarray[tuple[int], np.dtype[np.intp]], count: int) -> list[float]:
    return np.broadcast_to(values, (count,))[rows].tolist()


def _told(limit: Limit, value: float) -> Iterator[str]:
    if value > limit.high:
        yield f"{limit.symbol} = {_beside(value, limit.high)} exceeds {limit.high:g}"
    elif value < limit.low:
        yield f"{limit.symbol} = {_beside(value, limit.low)} is below {limit.low:g}"


def _beside(value: float, limit: float) -> str:
    """A number with three digits, or as many as tell it from a limit."""
    return next((text for digits in (3, 6, 9) if float(text := f"{value:.{digits}g}") != limit), repr(value))


def _rounded_down(force: float) -> str:
    """A force with three digits that is not greater, but for the rounding of floats."""
    if not force > 0:
        return "0"
    step = 10.0 ** (math.floor(math.log10(force)) - 2)
    return f"{math.floor(force / step * (1 + 1e-12)) * step:.3g}"
