"""Compiled: how probable recordings are under predictions (see `likelihood`), and priors, at many sets of noise levels.

Arrays are (points, sets, recordings) where an axis may be 1 and then stands for all.
"""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Floats, Mask

_TOGETHER = 8  # factors of a determinant whose logarithm is taken together: below 1e38 each, they do not overflow
_NONE = 1e-300  # u*u where u is 0


@compiled()
def log_likelihood(
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
    """Of one point and set, see `log_likelihoods`; `mm` and `mr` (sensors,) are overwritten.

    With V = s'² a² + p² |t|² a recording's χ² is |y|² + ((Re u*r)²/(1 + V u*u) − (Re u*y)²)/u*u, the square completed
    along u: |r|² less what V takes out would be rounding alone where a model predicts far more than was measured.
    """
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
        u_r, u_y = (u_y - known * u) * inverse, u_y * inverse
        u = max(u * inverse, _NONE)
        a2 = a * a
        variance = (gain2 + 0.5 * p2 * p2 * square[recording]) * a2
        if len(place):
            variance += p2 * place[recording] * factor * factor
        left = 1 + variance * u
        part = 1 / (left * u)
        reduced = part * u
        chi2 += yy[recording] * inverse + (u_r * u_r - left * u_y * u_y) * part
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
            each[point, number] += log_likelihood(
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
def log_plateaus(covariance: Floats, plateaus: Floats) -> float:
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
    "float64[:, ::1], float64[:, ::1], float64[::1], float64[:, :, ::1], float64[:, ::1], float64[:, ::1])"
)
def log_priors(
    owner: NDArray[np.int64],
    fit: Floats,
    free: Mask,
    low: Floats,
    high: Floats,
    precision: Floats,
    centre: Floats,
    freedom: Floats,
    height: Floats,
    covariances: Floats,
    plateaus: Floats,
    each: Floats,
) -> None:
    """The logarithms of the prior densities, added to `each` (points, sets).

    Of the coordinates `fit` (points, parameters) that are free in each point's hypothesis a normal or uniform density
    within bounds, or one of Student's t with so many degrees of `freedom`, where these are finite; of the covariance's
    coordinates (points, sets, parameters) `plateaus`, see `Plateau`: low, high, fall_low, fall_high and the logarithm
    of the area (parameters, 5).
    """
    for point in range(len(fit)):
        of = owner[point]
        of_mean = height[of]
        for place in range(fit.shape[1]):
            if free[of, place]:
                value = fit[point, place]
                if value < low[of, place] or value > high[of, place]:
                    of_mean = -np.inf
                square = precision[of, place] * (value - centre[of, place]) ** 2
                tail = freedom[of, place]
                of_mean -= 0.5 * (square if tail == np.inf else (tail + 1) * np.log1p(square / tail))
        for number in range(covariances.shape[1]):
            each[point, number] += of_mean + log_plateaus(covariances[point, number], plateaus)
