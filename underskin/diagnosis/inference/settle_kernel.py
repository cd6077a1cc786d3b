"""Compiled: Newton steps of noise levels towards the least cost, each parameter on its own, at fixed predictions."""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.diagnosis.inference.cost_kernel import log_likelihood, log_plateaus
from underskin.units import Array, Floats

STEP = 0.05  # of the finite differences in the covariance's logarithms
LARGEST_STEP = 0.7  # of a Newton step in a noise level's logarithm: a factor of 2
TRIES, SHORTER, LEAST_GAIN = 4, 4.0, 1e-3  # of a step that may gain nothing; gain that ends the steps


@compiled()
def _cost(
    covariance: Floats,
    noise: Floats,
    of_point: tuple[Array, ...],
    sums: tuple[Floats, Floats],
    known: tuple[float, float, bool, Floats],
) -> float:
    """The cost with covariance parameters (parameters,), up to what no noise level changes; `noise` and `sums` are
    overwritten."""
    about_means, numbers, placed, plateaus = known
    noise[0], noise[1] = np.exp(covariance[0]), np.exp(covariance[1])
    if placed:
        noise[2] = np.exp(covariance[2])
    of_lines = -numbers * covariance[1] - 0.5 * about_means / noise[1] ** 2
    return -(of_lines + log_likelihood(*of_point, noise, *sums) + log_plateaus(covariance, plateaus))


@compiled()
def _inside(here: Floats, step: Floats, lowest: Floats, highest: Floats, moved: Floats) -> None:
    """`moved` becomes where a step from here leads, within the bounds (parameters,)."""
    for parameter in range(len(here)):
        moved[parameter] = min(max(here[parameter] + step[parameter], lowest[parameter]), highest[parameter])


@compiled()
def _newton_step(
    here: Floats,
    lowest: Floats,
    highest: Floats,
    held: int,
    noise: Floats,
    of_point: tuple[Array, ...],
    sums: tuple[Floats, Floats],
    known: tuple[float, float, bool, Floats],
    step: Floats,
) -> None:
    """`step` becomes that of each parameter on its own, by central differences; 0 where it would leave the bounds."""
    centre = np.empty(len(here))
    _inside(here, 0 * here, lowest + 2 * STEP, highest - 2 * STEP, centre)  # far enough inside for the differences
    middle = _cost(centre, noise, of_point, sums, known)
    largest = 1e-12
    for parameter in range(len(here)):
        value = centre[parameter]
        centre[parameter] = value + STEP
        up = _cost(centre, noise, of_point, sums, known)
        centre[parameter] = value - STEP
        down = _cost(centre, noise, of_point, sums, known)
        centre[parameter] = value
        bent = (up + down - 2 * middle) / STEP**2
        slope = (up - down) / (2 * STEP) + bent * (here[parameter] - value)
        step[parameter] = -slope / max(abs(bent), 1.0)
        low, high = here[parameter] <= lowest[parameter], here[parameter] >= highest[parameter]
        if parameter == held or (low and step[parameter] < 0) or (high and step[parameter] > 0):
            step[parameter] = 0.0
        largest = max(largest, abs(step[parameter]))
    step *= min(1.0, LARGEST_STEP / largest)


@compiled(
    "void(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], float64[:, ::1], int64[::1], "
    "float64[:, ::1], float64[::1], float64[::1], float64, float64, float64, boolean, float64[:, ::1], float64[::1], "
    "float64[::1], int64, int64, float64[:, ::1], float64[::1])"
)
def settle(
    level: Floats,
    uu: Floats,
    uy: Floats,
    yy: Floats,
    place: Floats,
    sensor: NDArray[np.int64],
    bend: Floats,
    laplacian: Floats,
    square: Floats,
    about_means: float,
    numbers: float,
    spread: float,
    placed: bool,
    plateaus: Floats,
    lowest: Floats,
    highest: Floats,
    steps: int,
    held: int,
    covariance: Floats,
    cost: Floats,
) -> None:
    """Newton steps of gain, level and, where `placed`, position scatter, each on its own: `covariance` (points,
    parameters) and `cost` (points,) are overwritten with where they end.

    Parameters
    ----------
    level, uu, uy, place
        (points, recordings); `place` may be (points, 0).
    yy, sensor, laplacian, square
        (recordings,).
    bend
        (points, sensors).
    about_means, numbers
        What lines scatter about their recordings' means, and how many numbers all lines are.
    spread
        Of the sensors' gains.
    plateaus, lowest, highest
        Prior (parameters, 5) and bounds (parameters,).
    steps, held
        Steps at most, and the parameter that stays; -1 for none.
    """
    count = covariance.shape[1]
    noise, step, tried = np.zeros(4), np.empty(count), np.empty(count)
    noise[3] = spread
    sums = np.empty(bend.shape[1]), np.empty(bend.shape[1])
    for point in range(len(cost)):
        if not np.isfinite(cost[point]):
            continue
        here = covariance[point]
        of_point = level[point], uu[point], uy[point], yy, place[point], sensor, bend[point], laplacian, square
        known = about_means, numbers, placed, plateaus
        best = begun = _cost(here, noise, of_point, sums, known)
        for _ in range(steps):
            _newton_step(here, lowest, highest, held, noise, of_point, sums, known, step)
            gained = 0.0
            for _ in range(TRIES):
                _inside(here, step, lowest, highest, tried)
                reached = _cost(tried, noise, of_point, sums, known)
                if reached < best:
                    gained = best - reached
                    best = reached
                    here[:] = tried
                    break
                step /= SHORTER
            if gained < LEAST_GAIN:
                break
        cost[point] += best - begun
