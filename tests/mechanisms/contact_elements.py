"""An independent solution of a sphere's contact with a relaxing half space: springs that know nothing of each other.

A half space under an axisymmetric contact is a row of independent elements x, each with the body's relaxation (the
method of dimensionality reduction): pressed by δ − x²/R while in contact, free otherwise. The outermost element in
contact lets go where it carries more tension than E' √(2πxw/E'); elements join where they come as near as that. Marched
in small steps of time.
"""

from dataclasses import dataclass

import numpy as np

from underskin.units import Floats


@dataclass(frozen=True)
class Body:
    """Sphere radius [m], E' [Pa], relaxed fraction and time [s], work of adhesion [J/m²]."""

    radius: float
    modulus: float
    fraction: float = 0.0
    tau: float = 1.0
    work: float = 0.0


def force_of_elements(body: Body, depth: Floats, time: Floats, *, between: int = 10, count: int = 2000) -> Floats:
    """F [N] at the samples of depth [m] and time [s], straight between them."""
    grid = np.arange((len(depth) - 1) * between + 1) / between
    times = np.interp(grid, np.arange(len(depth)), time)
    depths = np.interp(grid, np.arange(len(depth)), depth)
    unit = np.cbrt(2 * np.pi * body.work * body.radius**2 / body.modulus)
    width = (1.3 * np.sqrt(body.radius * depth.max()) + 2 * unit) / count
    x = (np.arange(count) + 0.5) * width
    reach = np.sqrt(2 * np.pi * x * body.work / body.modulus)
    stretch, memory, on = np.zeros(count), np.zeros(count), np.zeros(count, dtype=bool)
    touched, forces = False, []
    for number, now in enumerate(depths):
        ratio = (times[number] - times[number - 1]) / body.tau if number else 0.0
        decay, mean = np.exp(-ratio), -np.expm1(-ratio) / ratio if ratio else 1.0
        pressed = now - x**2 / body.radius
        free = memory * np.exp(-(1 - body.fraction) * ratio)
        stuck = decay * memory + (mean - decay) * stretch + (1 - mean) * pressed
        holding = np.flatnonzero(on & (pressed - body.fraction * stuck >= -reach))
        stays = on & (np.arange(count) <= (holding[-1] if len(holding) else -1))
        touched = bool(now >= 0) or (touched and bool(stays.any()))
        joins = ~on & touched & (pressed >= body.fraction * free - reach)
        memory = np.where(on, stuck, free)
        on = stays | joins
        stretch = np.where(on, pressed, body.fraction * memory)
        forces.append(2 * body.modulus * width * (stretch - body.fraction * memory)[on].sum())
    return np.array(forces)[::between]
