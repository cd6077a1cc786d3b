"""Products and quotients of units, as arithmetic on channels makes them: N/m times m is N."""

from collections.abc import Iterable
from itertools import product

from underskin.recordings.readers.unit_labels import unit

Exponents = tuple[int, int, int, int]  # of length, force, charge and time

NO_DIMENSION: Exponents = (0, 0, 0, 0)
_EXPONENTS: dict[str, Exponents] = {
    "length": (1, 0, 0, 0),
    "force": (0, 1, 0, 0),
    "charge": (0, 0, 1, 0),
    "time": (0, 0, 0, 1),
    "pressure": (-2, 1, 0, 0),
    "frequency": (0, 0, 0, -1),
    "voltage": (1, 1, -1, 0),
    "current": (0, 0, 1, -1),
    "acceleration": (1, 0, 0, -2),
}
_SI = ("m", "N", "C", "s", "Pa", "Hz", "V", "A", "m/s^2")
_PARTS = ("m", "N", "C", "s", "V")
_FRF = "C/N"  # before m/V, which has the same dimension
_SI_RATIOS = (_FRF, *(f"{above}/{below}" for above, below in product(_PARTS, _PARTS) if above != below))


def times(first: Exponents, second: Exponents, sign: int = 1) -> Exponents:
    """The exponents of a product; of the quotient where `sign` is -1."""
    length, force, charge, time = (one + sign * other for one, other in zip(first, second, strict=True))
    return length, force, charge, time


def exponents(label: str) -> Exponents | None:
    """Those of a unit, `1` for a number without one; None where the unit is not known here."""
    if label == "1":
        return NO_DIMENSION
    known = unit(label)
    if known is None:
        return None
    parts = [_EXPONENTS.get(part) for part in known.dimension.split("/")]
    result, *below = parts
    for part in below:
        result = None if result is None or part is None else times(result, part, -1)
    return result


def ratio_of(label: str, signal: str, quantity: str) -> Exponents | None:
    """The exponents of label/signal · quantity; None where a unit is not known here."""
    given, divided, measured = exponents(label), exponents(signal), exponents(quantity)
    if given is None or divided is None or measured is None:
        return None
    return times(times(given, divided, -1), measured)


def label_of(dimension: Exponents, preferred: Iterable[str]) -> str | None:
    """A unit of these exponents: the first preferred one that has them, else that of SI; empty where they are all 0.

    None where no single unit, and no quotient of two, has them.
    """
    if dimension == NO_DIMENSION:
        return ""
    return next((label for label in (*preferred, *_SI, *_SI_RATIOS) if exponents(label) == dimension), None)


def described(dimension: Exponents) -> str:
    """In words for an error: `m`, `N·m^-2`, "no unit"."""
    label = label_of(dimension, ())
    if label is not None:
        return f"the unit {label}" if label else "no unit"
    powers = [f"{base}^{power}" if power != 1 else base for base, power in zip(_SI, dimension, strict=False) if power]
    return f"the unit {'·'.join(powers)}"
