"""Points spread evenly over a unit cube: the sequence of Halton, Numer. Math. 2 (1960) 84.

As scipy.stats.qmc.Halton without scrambling, to the bit; to import scipy.stats takes a third of a second.
"""

from itertools import count

import numpy as np

from underskin.units import Floats


def halton(points: int, dimensions: int) -> Floats:
    """The first points (points, dimensions) after 0: along each axis the digits of 1, 2, 3, … to the base of a prime,
    mirrored at the point."""
    primes: list[int] = []
    for number in count(2):
        if len(primes) == dimensions:
            break
        if all(number % prime for prime in primes):
            primes.append(number)
    columns = np.zeros((dimensions, points))
    for column, prime in zip(columns, primes, strict=True):
        rest, digit = np.arange(1, points + 1), 1 / prime
        while rest.any():
            column += rest % prime * digit
            rest, digit = rest // prime, digit / prime
    return columns.T
