"""Compiled sums over rows: the likelihood of the roughness of lines, products of dynamic factors with their
derivatives, corrections of sums for mains pick-up, the evidence of laws with several amplitudes, and the likelihood,
sums of curves and priors of a fit (see `inference.hypothesis` for the model of the noise).

A row of variance κ² d² has κ² d² + q² with pick-up: its weight 1/d² in the sums (over κ²) becomes
1/d² · 1/(1 + x), x = (q/κ)²/d², and log|C| grows by 2 log(1 + x). Arrays of a fit are (points, sets, recordings); one
set of sums may stand for all. The inverse of the covariance is applied by Sherman and Morrison's identity, first for
each recording, with its direction u, then for the sensors' columns.
"""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Array, Complexes, Floats, Indices, Mask

_VARIANCES_TOGETHER = 4  # factors, of 1e-70 to 1e70 each, that share one logarithm


@compiled("float64(float64[::1], int64[::1], float64[::1], float64[::1], float64, float64[::1])")
def roughness_cost(
    variance: Floats, middle: NDArray[np.int64], share: Floats, rough: Floats, freedom: float, by_variance: Floats
) -> float:
    """Σ ln v + (ν/2 + 1) ln(1 + 2u/ν), u = rough/v and v = d²ⱼ + λ² d²ⱼ₋₁ + (1 − λ)² d²ⱼ₊₁: Student's likelihood.

    Parameters
    ----------
    variance
        d² (rows,).
    middle, share, rough
        The rows j that are compared with their neighbours, λ, and half the square of their deviations.
    freedom
        ν.
    by_variance
        (rows,) to which the derivatives by d² are added.
    """
    power = freedom / 2 + 1
    total, of_v, of_u = 0.0, 1.0, 1.0
    for number in range(len(middle)):
        j = middle[number]
        before, after = share[number] ** 2, (1 - share[number]) ** 2
        v = variance[j] + before * variance[j - 1] + after * variance[j + 1]
        x = 2 * rough[number] / (v * freedom)
        of_v *= v
        of_u *= 1 + x
        if number % _VARIANCES_TOGETHER == 0:
            total += np.log(of_v) + power * np.log(of_u)
            of_v, of_u = 1.0, 1.0
        slope = (1 - power * x / (1 + x)) / v
        by_variance[j] += slope
        by_variance[j - 1] += before * slope
        by_variance[j + 1] += after * slope
    return total + np.log(of_v) + power * np.log(of_u)


_THREE = "float64[:, :, ::1]"


@compiled(f"void(complex128[:, :, ::1], {_THREE}, {_THREE}, {_THREE})")
def line_products(values: Array, products: Floats, real: Floats, imag: Floats) -> None:
    """Re x*y of all pairs of functions on the lines.

    Parameters
    ----------
    values
        The functions (points, functions, lines).
    products
        (points, pairs, lines) the pairs in the order of the upper triangle, to be filled.
    real, imag
        (points, functions, lines) the functions' parts, to be filled.
    """
    points, functions, lines = values.shape
    for point in range(points):
        for first in range(functions):
            for line in range(lines):
                real[point, first, line] = values[point, first, line].real
                imag[point, first, line] = values[point, first, line].imag
        pair = 0
        for first in range(functions):
            re, im = real[point, first], imag[point, first]
            for second in range(first, functions):
                product, re_other, im_other = products[point, pair], real[point, second], imag[point, second]
                for line in range(lines):
                    product[line] = re[line] * re_other[line] + im[line] * im_other[line]
                pair += 1


_TOGETHER = 8  # factors of a determinant that share one logarithm: below 1e38 each, they do not overflow
_NO_LOSS = 1e-17  # of x: smaller losses are below the sum's rounding
_ROWS = "int64[::1], float64[::1], int64[::1], complex128[::1], int64[::1]"


@compiled()
def _subtract_losses(losses: Floats, uu: Floats, uy: Floats, yy: Floats, point: int, recording: int) -> None:
    """Subtract the losses (3, sets) of a recording's rows from its sums, and reset them."""
    for number in range(losses.shape[1]):
        uu[point, number, recording] -= losses[0, number]
        uy[point, number, recording] -= losses[1, number]
        yy[point, number, recording] -= losses[2, number]
    losses[:] = 0.0


@compiled(f"void({_THREE}, {_ROWS}, complex128[:, ::1], {_THREE}, {_THREE}, {_THREE}, float64[:, ::1])")
def subtract_pickup(
    pickup: Floats,
    alike: NDArray[np.int64],
    precision: Floats,
    recording: NDArray[np.int64],
    y: Complexes,
    line: NDArray[np.int64],
    u: Array,
    uu: Floats,
    uy: Floats,
    yy: Floats,
    log_determinant: Floats,
) -> None:
    """Subtract each row's loss x/(1 + x)/d² from `uu`, `uy` and `yy` (points, sets, recordings), and add 2 log(1 + x)
    to `log_determinant` (points, sets).

    Parameters
    ----------
    pickup
        (q/κ)² (points, distinct, sets).
    alike, precision, recording, y, line
        Of each row: the index of its distinct q, 1/d², the recording, the measured value and the line.
    u
        The direction (points, lines).
    """
    points, distinct, sets = pickup.shape
    factors, total, losses, largest = np.empty(sets), np.empty(sets), np.zeros((3, sets)), np.empty(distinct)
    for point in range(points):
        factors[:], total[:] = 1.0, 0.0
        count, current_recording = 0, 0
        for number in range(distinct):
            largest[number] = pickup[point, number].max()
        for row in range(len(y)):
            deviation_index, weight = alike[row], precision[row]
            if largest[deviation_index] * weight <= _NO_LOSS:
                continue
            if recording[row] != current_recording:
                _subtract_losses(losses, uu, uy, yy, point, current_recording)
                current_recording = recording[row]
            direction, measured = u[point, line[row]], y[row]
            uu_row = direction.real * direction.real + direction.imag * direction.imag
            uy_row = direction.real * measured.real + direction.imag * measured.imag
            yy_row = measured.real * measured.real + measured.imag * measured.imag
            for number in range(sets):
                x = pickup[point, deviation_index, number] * weight
                loss = x / (1 + x) * weight
                losses[0, number] += loss * uu_row
                losses[1, number] += loss * uy_row
                losses[2, number] += loss * yy_row
                factors[number] *= 1 + x
            count += 1
            if count == _TOGETHER:
                for number in range(sets):
                    total[number] += np.log(factors[number])
                    factors[number] = 1.0
                count = 0
        _subtract_losses(losses, uu, uy, yy, point, current_recording)
        for number in range(sets):
            log_determinant[point, number] += 2 * (total[number] + np.log(factors[number]))


@compiled("void(float64[:, :, ::1], float64[:, ::1], float64[::1])")
def law_gains(grams: Floats, moments: Floats, gains: Floats) -> None:
    """ln p(y) with a law less that without, ½ (mᵀ (I + G)⁻¹ m − ln |I + G|), by Cholesky's factors.

    Parameters
    ----------
    grams
        G (sets, features, features), AᵀC⁻¹A of the features A.
    moments
        m (sets, features), AᵀC⁻¹r of the residual r.
    gains
        (sets,), to be filled.
    """
    size = moments.shape[1]
    lower, solved = np.empty((size, size)), np.empty(size)
    for number in range(len(moments)):
        determinant = square = 0.0
        for i in range(size):
            for j in range(i):
                total = grams[number, i, j]
                for k in range(j):
                    total -= lower[i, k] * lower[j, k]
                lower[i, j] = total / lower[j, j]
            total, right = 1 + grams[number, i, i], moments[number, i]
            for k in range(i):
                total -= lower[i, k] ** 2
                right -= lower[i, k] * solved[k]
            lower[i, i] = np.sqrt(total)
            solved[i] = right / lower[i, i]
            determinant += np.log(total)
            square += solved[i] ** 2
        gains[number] = 0.5 * (square - determinant)


@compiled("void(float64[:, ::1], int64[::1], int64[::1], float64[:, ::1], float64[:, :, :, ::1])")
def less_shared(weights: Floats, rows: Indices, first: Indices, columns: Floats, grams: Floats) -> None:
    """Subtract Σ sₙ sₙᵀ from products of columns, sₙ = Σ w x over the n-th sensor's recordings.

    Parameters
    ----------
    weights
        w at each scatter (scatters, pairs), the pairs of a sensor contiguous.
    rows, first
        The row of `columns` of each pair, and the first pair of each sensor (sensors + 1,).
    columns
        x (rows, sets · features).
    grams
        (sets, scatters, features, features), to be changed.
    """
    count, size = grams.shape[0], grams.shape[2]
    width = count * size
    sums = np.empty(width)
    for scatter in range(len(weights)):
        for sensor in range(len(first) - 1):
            sums[:] = 0.0
            for pair in range(first[sensor], first[sensor + 1]):
                weight, row = weights[scatter, pair], rows[pair]
                for column in range(width):
                    sums[column] += weight * columns[row, column]
            for number in range(count):
                for i in range(size):
                    for j in range(size):
                        grams[number, scatter, i, j] -= sums[number * size + i] * sums[number * size + j]


_NONE = 1e-300  # u*u where u is 0


@compiled(
    "void(float64[:, ::1], float64[:, :, ::1], float64[:, :, ::1], float64[:, :, ::1], float64[:, ::1], int64[::1], "
    "float64[:, ::1], float64[::1], float64[::1], float64[:, :, ::1], float64[:, ::1])"
)
def log_likelihoods(
    level: Floats,
    uu: Floats,
    uy: Floats,
    across: Floats,
    squared_slopes: Floats,
    sensor: NDArray[np.int64],
    sensor_log_gain: Floats,
    laplacian: Floats,
    square: Floats,
    noise: Floats,
    totals: Floats,
) -> None:
    """Add −½ of the terms of χ² and log|C| that depend on the noise levels to `totals` (points, sets).

    With V = s'² a² + p² |t|² a recording's χ² is |y|² − (Re u*y)²/u*u, the part of y `across` u, and
    (Re u*r)²/((1 + V u*u) u*u), the square completed along u: |r|² minus what V takes out would cancel to rounding
    error where a model predicts far more than was measured.

    Parameters
    ----------
    level
        (points, recordings).
    uu, uy, across
        The sums Re u*u and Re u*y, and the square of y's part across u.
    squared_slopes
        (points, recordings) |t|² of the position slopes, (points, 0) without positioning scatter.
    sensor
        (recordings,).
    sensor_log_gain
        (points, sensors).
    laplacian, square
        (recordings,) of σ over the contact's position, relative to σ.
    noise
        (points, sets, 4): gain, level, position and spread.
    """
    points, sets = totals.shape
    mm, mr = np.empty(sensor_log_gain.shape[1]), np.empty(sensor_log_gain.shape[1])
    for point in range(points):
        for number in range(sets):
            gain2, k2, p2, tau2 = noise[point, number] ** 2
            at = min(number, uu.shape[1] - 1)
            mm[:], mr[:] = 0.0, 0.0
            chi2 = log_determinant = 0.0
            determinant, inverse = 1.0, 1 / k2
            for recording in range(len(sensor)):
                sensor_index = sensor[recording]
                log_gain = sensor_log_gain[point, sensor_index]
                exponent = log_gain + 0.5 * p2 * laplacian[recording]
                factor = np.exp(exponent) if exponent != 0 else 1.0
                a = level[point, recording] * factor
                u_u = uu[point, at, recording]
                u_r = (uy[point, at, recording] - a * (1 - log_gain) * u_u) * inverse
                u = max(u_u * inverse, _NONE)
                variance = (gain2 + 0.5 * p2 * p2 * square[recording]) * a * a
                if squared_slopes.shape[1]:
                    variance += p2 * squared_slopes[point, recording] * factor * factor
                inflation = 1 + variance * u
                scale = 1 / (inflation * u)
                chi2 += across[point, at, recording] * inverse + u_r * u_r * scale
                mm[sensor_index] += a * a * u * u * scale
                mr[sensor_index] += a * u_r * u * scale
                determinant *= inflation
                if recording % _TOGETHER == 0:
                    log_determinant += np.log(determinant)
                    determinant = 1.0
            log_determinant += np.log(determinant)
            for sensor_index in range(len(mm)):
                chi2 -= tau2 / (1 + tau2 * mm[sensor_index]) * mr[sensor_index] ** 2
                log_determinant += np.log1p(tau2 * mm[sensor_index])
            totals[point, number] -= 0.5 * (chi2 + log_determinant)


@compiled()
def _orthogonalise(rows: Floats, squares: Floats) -> float:
    """Subtract from each row its projections on those before it (Gram and Schmidt), and fill the `squares` (rows,) of
    what is left; the product of the last row with the one before it."""
    along = 0.0
    for row in range(len(rows)):
        for before in range(row):
            along = 0.0
            for sample in range(rows.shape[1]):
                along += rows[before, sample] * rows[row, sample]
            share = along / max(squares[before], _NONE)
            for sample in range(rows.shape[1]):
                rows[row, sample] -= share * rows[before, sample]
        squares[row] = (rows[row] ** 2).sum()
    return along


@compiled(
    "void(float64[:, ::1], float64[::1], float64[:, ::1], float64[::1], int64[::1], float64[:, ::1], float64[:, ::1], "
    "float64[:, :, :, ::1], float64[:, ::1])"
)
def curve_sums(
    force: Floats,
    measured: Floats,
    columns: Floats,
    size: Floats,
    edges: NDArray[np.int64],
    ratio: Floats,
    level: Floats,
    sums: Floats,
    log_determinant: Floats,
) -> None:
    """Fill Re u*u, Re u*y, |y|² and the square of y across u (4, points, sets, recordings) of curves, and log|C|.

    C/κ² = diag(1 + (η/κ)² size) + P Pᵀ/κ² on transformed rows; `ratio` is η/κ, `level` κ (points, sets). With P, below
    which stands κ, before u and y, what is left of these, each across all before it, has the sums of a recording, whose
    rows end at the `edges`.
    """
    count = len(columns)
    squares = np.empty(count + 2)
    for point in range(ratio.shape[0]):
        for number in range(ratio.shape[1]):
            larger = 1.0 + ratio[point, number] ** 2 * size
            root = 1.0 / np.sqrt(larger)
            log_determinant[point, number] = np.log(larger).sum()
            for recording in range(len(edges) - 1):
                low, high = edges[recording], edges[recording + 1]
                rows = np.zeros((count + 2, count + high - low))
                for column in range(count):
                    rows[column, column] = level[point, number]
                    rows[column, count:] = root[low:high] * columns[column, low:high]
                rows[count, count:] = root[low:high] * force[point, low:high]
                rows[count + 1, count:] = root[low:high] * measured[low:high]
                uy = _orthogonalise(rows, squares)
                log_determinant[point, number] += np.log(squares[:count] / level[point, number] ** 2).sum()
                uu, across = squares[count], squares[count + 1]
                sums[0, point, number, recording] = uu
                sums[1, point, number, recording] = uy
                sums[2, point, number, recording] = across + uy * uy / max(uu, _NONE)
                sums[3, point, number, recording] = across


@compiled()
def log_plateaus(covariance: Floats, plateaus: Floats) -> float:
    """The log prior density of covariance parameters (parameters,)."""
    total = 0.0
    for index in range(len(covariance)):
        value = covariance[index]
        below = max((plateaus[index, 0] - value) / plateaus[index, 2], 0.0)
        above = max((value - plateaus[index, 1]) / plateaus[index, 3], 0.0)
        total -= 0.5 * (below + above) ** 2 + plateaus[index, 4]
    return total


@compiled(
    "void(float64[:, ::1], boolean[::1], float64[::1], float64[::1], float64[::1], float64[::1], float64[::1], "
    "float64, float64[:, :, ::1], float64[:, ::1], float64[:, ::1])"
)
def log_priors(
    fit: Floats,
    free: Mask,
    low: Floats,
    high: Floats,
    precision: Floats,
    centre: Floats,
    freedom: Floats,
    height: float,
    covariances: Floats,
    plateaus: Floats,
    totals: Floats,
) -> None:
    """Add the log prior densities to `totals` (points, sets).

    Of the coordinates `fit` (points, parameters) that are free a normal or uniform density within bounds, or one of
    Student's t with so many degrees of `freedom`, where these are finite; of the covariance's coordinates (points,
    sets, parameters) `plateaus`, see `Plateau`: low, high, fall_low, fall_high and the log of the area (parameters, 5).
    """
    for point in range(len(fit)):
        log_prior = height
        for index in range(fit.shape[1]):
            if free[index]:
                value = fit[point, index]
                if value < low[index] or value > high[index]:
                    log_prior = -np.inf
                square = precision[index] * (value - centre[index]) ** 2
                tail = freedom[index]
                log_prior -= 0.5 * (square if tail == np.inf else (tail + 1) * np.log1p(square / tail))
        for number in range(covariances.shape[1]):
            totals[point, number] += log_prior + log_plateaus(covariances[point, number], plateaus)
