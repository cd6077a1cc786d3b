"""Compiled: how probable recordings are under predictions (see `likelihood`), and priors, at many sets of noise levels;
and steps of these.

Arrays are (points, sets, recordings) where an axis may be 1 and then stands for all.
"""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Array, Floats, Mask

STEP = 0.05  # of the finite differences in the covariance's logarithms
LARGEST_STEP = 0.7  # of a Newton step in a noise level's logarithm: a factor of 2
TRIES, SHORTER, LEAST_GAIN = 4, 4.0, 1e-3  # of a step that may gain nothing; gain that ends the steps
_TOGETHER = 8  # factors of a determinant whose logarithm is taken together: below 1e38 each, they do not overflow


@compiled()
def _log_likelihood(
    level: Floats,
    uu: Floats,
    uy: Floats,
    yy: Floats,
    place: Floats,
    sensor: NDArray[np.int64],
    bend: Floats,
    laplacian: Floats,
    square: Floats,
    noise: Floats,
    mm: Floats,
    mr: Floats,
) -> float:
    """Of one point and set, see `log_likelihoods`; `mm` and `mr` (sensors,) are overwritten."""
    gain2, k2, p2, tau2 = noise[0] ** 2, noise[1] ** 2, noise[2] ** 2, noise[3] ** 2
    mm[:], mr[:] = 0.0, 0.0
    chi2 = log_determinant = 0.0
    determinant, inverse = 1.0, 1 / k2
    for recording in range(len(level)):
        of = sensor[recording]
        own = bend[of]
        exponent = own + 0.5 * p2 * laplacian[recording]
        factor = np.exp(exponent) if exponent != 0 else 1.0
        a = level[recording] * factor
        known = a * (1 - own)
        u, u_y = uu[recording], uy[recording]
        u_r = (u_y - known * u) * inverse
        r_r = (yy[recording] - known * (2 * u_y - known * u)) * inverse
        u *= inverse
        a2 = a * a
        variance = (gain2 + 0.5 * p2 * p2 * square[recording]) * a2
        if len(place):
            variance += p2 * place[recording] * factor * factor
        left = 1 + variance * u
        reduced = 1 / left
        chi2 += r_r - variance * reduced * u_r * u_r
        mm[of] += a2 * u * reduced
        mr[of] += a * u_r * reduced
        determinant *= left
        if recording % _TOGETHER == 0:
            log_determinant += np.log(determinant)
            determinant = 1.0
    log_determinant += np.log(determinant)
    for of in range(len(mm)):
        chi2 -= tau2 / (1 + tau2 * mm[of]) * mr[of] ** 2
        log_determinant += np.log1p(tau2 * mm[of])
    return -0.5 * (chi2 + log_determinant)


@compiled(
    "void(float64[:, ::1], float64[:, :, ::1], float64[:, :, ::1], float64[:, :, ::1], float64[:, ::1], int64[::1], "
    "float64[:, ::1], float64[::1], float64[::1], float64[:, :, ::1], float64[:, ::1])"
)
def log_likelihoods(
    level: Floats,
    uu: Floats,
    uy: Floats,
    yy: Floats,
    place: Floats,
    sensor: NDArray[np.int64],
    bend: Floats,
    laplacian: Floats,
    square: Floats,
    noise: Floats,
    each: Floats,
) -> None:
    """−½ of what noise levels make of χ² and log|C|: added to `each` (points, sets).

    Parameters
    ----------
    level
        (points, recordings).
    uu, uy, yy
        The sums Re u*u, Re u*y and |y|².
    place
        (points, recordings) |t|² of the position's slopes, (points, 0) where there are none.
    sensor
        (recordings,).
    bend
        (points, sensors).
    laplacian, square
        (recordings,) of σ over the place, relative to it.
    noise
        (points, sets, 4): gain, level, position and spread.
    """
    mm, mr = np.empty(bend.shape[1]), np.empty(bend.shape[1])
    for point in range(each.shape[0]):
        for number in range(each.shape[1]):
            each[point, number] += _log_likelihood(
                level[point],
                uu[min(point, uu.shape[0] - 1), min(number, uu.shape[1] - 1)],
                uy[min(point, uy.shape[0] - 1), min(number, uy.shape[1] - 1)],
                yy[min(point, yy.shape[0] - 1), min(number, yy.shape[1] - 1)],
                place[point],
                sensor,
                bend[point],
                laplacian,
                square,
                noise[min(point, len(noise) - 1), number],
                mm,
                mr,
            )


@compiled()
def _log_plateaus(covariance: Floats, plateaus: Floats) -> float:
    """The log prior density of covariance parameters (parameters,)."""
    total = 0.0
    for place in range(len(covariance)):
        value = covariance[place]
        below = max((plateaus[place, 0] - value) / plateaus[place, 2], 0.0)
        above = max((value - plateaus[place, 1]) / plateaus[place, 3], 0.0)
        total -= 0.5 * (below + above) ** 2 + plateaus[place, 4]
    return total


@compiled(
    "void(int64[::1], float64[:, ::1], boolean[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], "
    "float64[:, ::1], float64[::1], float64[:, :, ::1], float64[:, ::1], float64[:, ::1])"
)
def log_priors(
    owner: NDArray[np.int64],
    fit: Floats,
    free: Mask,
    low: Floats,
    high: Floats,
    precision: Floats,
    centre: Floats,
    height: Floats,
    covariances: Floats,
    plateaus: Floats,
    each: Floats,
) -> None:
    """The logarithms of the prior densities, added to `each` (points, sets).

    Of the coordinates `fit` (points, parameters) that are free in each point's hypothesis a normal or uniform density
    within bounds; of the covariance's coordinates (points, sets, parameters) `plateaus`, see `Plateau`: low, high,
    fall_low, fall_high and the logarithm of the area (parameters, 5).
    """
    for point in range(len(fit)):
        of = owner[point]
        of_mean = height[of]
        for place in range(fit.shape[1]):
            if free[of, place]:
                value = fit[point, place]
                if value < low[of, place] or value > high[of, place]:
                    of_mean = -np.inf
                of_mean -= 0.5 * precision[of, place] * (value - centre[of, place]) ** 2
        for number in range(covariances.shape[1]):
            each[point, number] += of_mean + _log_plateaus(covariances[point, number], plateaus)


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
    return -(of_lines + _log_likelihood(*of_point, noise, *sums) + _log_plateaus(covariance, plateaus))


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
