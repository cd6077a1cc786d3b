"""Compiled parts of the fit (see `hypothesis` for the model of the noise): likelihood, priors and normal equations.

Arrays are (points, sets, recordings); an axis of length 1 stands for all. The inverse of the covariance is applied by
Sherman and Morrison's identity, first for each recording, with its direction u and the derivatives J of its
prediction, then for the sensors' columns.
"""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Floats, Mask

_TOGETHER = 8  # factors of a determinant that share one logarithm: below 1e38 each, they do not overflow
_NONE = 1e-300  # u*u where u is 0


@compiled()
def log_likelihood(
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
    mm: Floats,
    mr: Floats,
) -> float:
    """Of one point and set, see `log_likelihoods`; `mm` and `mr` (sensors,) are overwritten.

    With V = s'² a² + p² |t|² a recording's χ² is |y|² − (Re u*y)²/u*u, the part of y `across` u, and
    (Re u*r)²/((1 + V u*u) u*u), the square completed along u: |r|² minus what V takes out would cancel to rounding
    error where a model predicts far more than was measured.
    """
    gain2, k2, p2, tau2 = noise[0] ** 2, noise[1] ** 2, noise[2] ** 2, noise[3] ** 2
    mm[:], mr[:] = 0.0, 0.0
    chi2 = log_determinant = 0.0
    determinant, inverse = 1.0, 1 / k2
    for recording in range(len(level)):
        sensor_index = sensor[recording]
        log_gain = sensor_log_gain[sensor_index]
        exponent = log_gain + 0.5 * p2 * laplacian[recording]
        factor = np.exp(exponent) if exponent != 0 else 1.0
        a = level[recording] * factor
        mean = a * (1 - log_gain)
        u_r = (uy[recording] - mean * uu[recording]) * inverse
        u = max(uu[recording] * inverse, _NONE)
        a2 = a * a
        variance = (gain2 + 0.5 * p2 * p2 * square[recording]) * a2
        if len(squared_slopes):
            variance += p2 * squared_slopes[recording] * factor * factor
        inflation = 1 + variance * u
        scale = 1 / (inflation * u)
        reduced = scale * u
        chi2 += across[recording] * inverse + u_r * u_r * scale
        mm[sensor_index] += a2 * u * reduced
        mr[sensor_index] += a * u_r * reduced
        determinant *= inflation
        if recording % _TOGETHER == 0:
            log_determinant += np.log(determinant)
            determinant = 1.0
    log_determinant += np.log(determinant)
    for sensor_index in range(len(mm)):
        chi2 -= tau2 / (1 + tau2 * mm[sensor_index]) * mr[sensor_index] ** 2
        log_determinant += np.log1p(tau2 * mm[sensor_index])
    return -0.5 * (chi2 + log_determinant)


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
    mm, mr = np.empty(sensor_log_gain.shape[1]), np.empty(sensor_log_gain.shape[1])
    for point in range(totals.shape[0]):
        for number in range(totals.shape[1]):
            totals[point, number] += log_likelihood(
                level[point],
                uu[min(point, uu.shape[0] - 1), min(number, uu.shape[1] - 1)],
                uy[min(point, uy.shape[0] - 1), min(number, uy.shape[1] - 1)],
                across[min(point, across.shape[0] - 1), min(number, across.shape[1] - 1)],
                squared_slopes[point],
                sensor,
                sensor_log_gain[point],
                laplacian,
                square,
                noise[min(point, len(noise) - 1), number],
                mm,
                mr,
            )


@compiled()
def _factorise(matrix: Floats) -> float:
    """Replace a positive definite matrix by its Cholesky factor; the logarithm of its determinant."""
    log_determinant = 0.0
    for row in range(len(matrix)):
        for column in range(row + 1):
            value = matrix[row, column]
            for before in range(column):
                value -= matrix[row, before] * matrix[column, before]
            matrix[row, column] = value / matrix[column, column] if column < row else np.sqrt(max(value, _NONE))
        log_determinant += 2.0 * np.log(matrix[row, row])
    return log_determinant


@compiled()
def _whiten(factor: Floats, values: Floats) -> None:
    """Multiply by the inverse of a Cholesky factor."""
    for row in range(len(values)):
        for before in range(row):
            values[row] -= factor[row, before] * values[before]
        values[row] /= factor[row, row]


@compiled()
def _add_row(weight: float, value: float, columns: Floats, row: int, total: Floats) -> None:
    """Add one row to Pᵀ W v."""
    for column in range(len(total)):
        total[column] += weight * value * columns[column, row]


@compiled()
def _recording_sums(
    u: Floats, measured: Floats, columns: Floats, weight: Floats, span: tuple[int, int], k2: float, sums: Floats
) -> float:
    """Fill the sums (4,) of one recording, whose rows are a `span`; log|I + Pᵀ W P/κ²|."""
    count = len(columns)
    factor = k2 * np.eye(count)
    of_force, of_measured, of_rest = np.zeros(count), np.zeros(count), np.zeros(count)
    sums[:] = 0.0
    for row in range(*span):
        by_force, by_measured = weight[row] * u[row], weight[row] * measured[row]
        sums[0] += by_force * u[row]
        sums[1] += by_force * measured[row]
        sums[2] += by_measured * measured[row]
        _add_row(weight[row], u[row], columns, row, of_force)
        _add_row(weight[row], measured[row], columns, row, of_measured)
        for column in range(count):
            _add_row(weight[row], columns[column, row], columns, row, factor[column])
    log_determinant = _factorise(factor) - count * np.log(k2)
    _whiten(factor, of_force)
    _whiten(factor, of_measured)
    sums[0] -= (of_force**2).sum()
    sums[1] -= (of_force * of_measured).sum()
    sums[2] -= (of_measured**2).sum()
    share = sums[1] / max(sums[0], _NONE)
    for row in range(*span):
        rest = measured[row] - share * u[row]
        sums[3] += weight[row] * rest * rest
        _add_row(weight[row], rest, columns, row, of_rest)
    _whiten(factor, of_rest)
    sums[3] -= (of_rest**2).sum()
    return float(log_determinant)


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

    C/κ² = diag(1 + (η/κ)² size) + P Pᵀ/κ² on transformed rows, by Woodbury's identity for each recording, whose rows
    end at the `edges`; `ratio` is η/κ, `level` κ (points, sets).
    """
    points, sets = ratio.shape
    weight, of_recording = np.empty(columns.shape[1]), np.empty(4)
    for point in range(points):
        for number in range(sets):
            larger = 1.0 + ratio[point, number] ** 2 * size
            weight[:] = 1.0 / larger
            log_determinant[point, number] = np.log(larger).sum()
            for recording in range(len(edges) - 1):
                span = edges[recording], edges[recording + 1]
                log_determinant[point, number] += _recording_sums(
                    force[point], measured, columns, weight, span, level[point, number] ** 2, of_recording
                )
                sums[:, point, number, recording] = of_recording


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


_FROM_SLOPES = 1e-3  # m: the slopes dominate where the response changes by more than itself over this distance
_OF_PARAMETERS, _OF_PAIRS = "float64[:, :, ::1]", "float64[:, :, :, ::1]"


_TERMS = 8
_FACTOR, _A, _MEAN, _UU, _UR, _REDUCED, _AS_MODEL, _MOVED = range(_TERMS)  # of each recording


@compiled()
def _fill_terms(
    level: Floats,
    uu: Floats,
    uy: Floats,
    squared_slopes: Floats,
    sensor: NDArray[np.int64],
    sensor_log_gain: Floats,
    laplacian: Floats,
    square: Floats,
    levels: Floats,
    terms: Floats,
) -> None:
    """Fill `terms` (recordings, 8) with each recording's scatter, V = s'² a² + p² |t|²."""
    gain2, k2, p2, _ = levels
    for r in range(len(level)):
        log_gain = sensor_log_gain[sensor[r]]
        factor = np.exp(log_gain + 0.5 * p2 * laplacian[r])
        a = level[r] * factor
        mean = a * (1 - log_gain)
        as_model = gain2 + 0.5 * p2 * p2 * square[r]
        moved = p2 * squared_slopes[r] * factor * factor if len(squared_slopes) else 0.0
        u = uu[r] / k2
        terms[r, _FACTOR], terms[r, _A], terms[r, _MEAN] = factor, a, mean
        terms[r, _UU], terms[r, _UR] = u, (uy[r] - mean * uu[r]) / k2
        terms[r, _REDUCED] = 1 / (1 + (as_model * a * a + moved) * u)  # 1 − (share of u taken out)
        terms[r, _AS_MODEL], terms[r, _MOVED] = as_model, moved


@compiled()
def _shrink(terms: Floats) -> float:
    """V/(1 + V u*u)."""
    return (terms[_AS_MODEL] * terms[_A] ** 2 + terms[_MOVED]) * terms[_REDUCED]


@compiled()
def _project_derivatives(
    level_slopes: Floats, uv: Floats, vy: Floats, inverse: float, terms: Floats, uj: Floats, jr: Floats
) -> None:
    """Re u*J and, with each recording's own scatter taken out, Re J*r, both over κ² (recordings, P)."""
    leveled, turned = level_slopes.shape[1] > 0, uv.shape[1] > 0
    for r in range(len(terms)):
        row = terms[r]
        for p in range(uj.shape[1]):
            along = with_r = 0.0
            if leveled:
                along += level_slopes[r, p] * row[_FACTOR] * row[_UU]
                with_r += level_slopes[r, p] * row[_FACTOR] * row[_UR]
            if turned:
                along += row[_A] * uv[r, p] * inverse
                with_r += row[_A] * (vy[r, p] - row[_MEAN] * uv[r, p]) * inverse
            uj[r, p] = along
            jr[r, p] = with_r - along * _shrink(row) * row[_UR]


@compiled()
def _sum_over_sensors(
    sensor: NDArray[np.int64],
    tau2: float,
    terms: Floats,
    uj: Floats,
    mj: Floats,
    of_sensors: Floats,
    by_sensor: Floats,
) -> None:
    """mᵀC⁻¹J of recordings and of sensors; of sensors mᵀC⁻¹m, mᵀC⁻¹r, τ²/(1 + τ² mᵀC⁻¹m) and the most probable b."""
    of_sensors[:], by_sensor[:] = 0.0, 0.0
    for r in range(len(terms)):
        row, sensor_index = terms[r], sensor[r]
        weight = row[_A] * row[_REDUCED]
        of_sensors[sensor_index, 0] += row[_A] * row[_UU] * weight
        of_sensors[sensor_index, 1] += row[_UR] * weight
        for p in range(uj.shape[1]):
            mj[r, p] = uj[r, p] * weight
            by_sensor[sensor_index, p] += mj[r, p]
    for sensor_index in range(len(of_sensors)):
        of_sensors[sensor_index, 2] = tau2 / (1 + tau2 * of_sensors[sensor_index, 0])
        of_sensors[sensor_index, 3] = of_sensors[sensor_index, 2] * of_sensors[sensor_index, 1]


@compiled()
def _add_information(
    level_slopes: Floats, uv: Floats, vv: Floats, inverse: float, terms: Floats, uj: Floats, information: Floats
) -> None:
    """Add Jᵀ C⁻¹ J, without the sensors' columns, to the lower half of `information`."""
    leveled, turned = level_slopes.shape[1] > 0, uv.shape[1] > 0
    for r in range(len(terms)):
        row = terms[r]
        shrink, f, a = _shrink(row), row[_FACTOR], row[_A]
        for p in range(uj.shape[1]):
            for q in range(p + 1):
                both = -uj[r, p] * shrink * uj[r, q]
                if leveled:
                    both += level_slopes[r, p] * f * f * row[_UU] * level_slopes[r, q]
                if turned:
                    both += a * a * inverse * vv[r, p, q]
                if leveled and turned:
                    both += f * a * inverse * (level_slopes[r, p] * uv[r, q] + uv[r, p] * level_slopes[r, q])
                information[p, q] += both


@compiled()
def _add_mean_gradient(
    sensor: NDArray[np.int64],
    terms: Floats,
    of_sensors: Floats,
    jr: Floats,
    mj: Floats,
    jr_sensor: Floats,
    slope: Floats,
) -> None:
    """Add the gradient by the mean and by the columns of C that follow it in each recording, with the sensors' columns
    in C."""
    jr_sensor[:] = 0.0
    for r in range(len(terms)):
        row, sensor_index = terms[r], sensor[r]
        _, _, shrink, gain = of_sensors[sensor_index]
        weight = row[_A] * row[_REDUCED]
        mm = row[_A] * row[_UU] * weight
        mr_residual, mm_factor = row[_UR] * weight - mm * gain, 1 - shrink * mm
        for p in range(len(slope)):
            with_r = jr[r, p] - mj[r, p] * gain
            jr_sensor[sensor_index, p] += with_r
            slope[p] += with_r + row[_AS_MODEL] * (with_r * mr_residual - mj[r, p] * mm_factor)


@compiled()
def _add_position_gradient(
    level: Floats,
    level_slopes: Floats,
    squared_slopes: Floats,
    uv: Floats,
    vy: Floats,
    inverse: float,
    sensor: NDArray[np.int64],
    terms: Floats,
    of_sensors: Floats,
    slope: Floats,
) -> None:
    """Add the gradient by the column of the position slopes t, taken to change as L does, or not at all where t
    dominates."""
    for r in range(len(terms)):
        row = terms[r]
        _, _, shrink, gain = of_sensors[sensor[r]]
        weight = row[_A] * row[_REDUCED]
        um = row[_UU] * weight
        explained = row[_UR] * row[_REDUCED] - um * gain  # uᵀ C⁻¹ r
        u_information = row[_UU] * row[_REDUCED] - shrink * um * um  # uᵀ C⁻¹ u
        slopes_dominate = _FROM_SLOPES**2 * squared_slopes[r] > level[r] ** 2
        for p in range(len(slope)):
            log_gradient = 0.0 if slopes_dominate else 2 * level_slopes[r, p] / level[r]
            by_slopes = 0.5 * (explained * explained - u_information) * log_gradient
            if uv.shape[1]:
                along, with_r = uv[r, p] * inverse, (vy[r, p] - row[_MEAN] * uv[r, p]) * inverse
                mv = along * weight
                by_slopes += (with_r - along * _shrink(row) * row[_UR] - mv * gain) * explained
                by_slopes -= along * row[_REDUCED] - shrink * um * mv
            slope[p] += row[_MOVED] * by_slopes


@compiled(
    f"void(float64[:, ::1], {_OF_PARAMETERS}, float64[:, ::1], float64[:, ::1], {_OF_PARAMETERS}, {_OF_PARAMETERS}, "
    f"{_OF_PAIRS}, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[::1], "
    f"float64[:, ::1], {_OF_PARAMETERS}, float64[:, ::1])"
)
def normal_equations(
    level: Floats,
    level_slopes: Floats,
    uu: Floats,
    uy: Floats,
    uv: Floats,
    vy: Floats,
    vv: Floats,
    squared_slopes: Floats,
    sensor: NDArray[np.int64],
    sensor_log_gain: Floats,
    laplacian: Floats,
    square: Floats,
    noise: Floats,
    information: Floats,
    gradient: Floats,
) -> None:
    """Fill `information` Jᵀ C⁻¹ J (points, P, P) and `gradient` ∂/∂θ (−½ log|C| − ½ rᵀC⁻¹r) (points, P).

    Parameters
    ----------
    level, level_slopes
        L (points, recordings), and its derivatives (points, recordings, P), or P = 0 where L is 1.
    uu, uy, uv, vy, vv
        The sums Re u*u, Re u*y (points, recordings), with the derivatives v of u Re u*v, Re v*y (points, recordings,
        P) and Re v*v (points, recordings, P, P), or P = 0 where u does not change.
    squared_slopes
        |t|² of the position slopes (points, recordings), or (points, 0) without positioning scatter.
    sensor, sensor_log_gain, laplacian, square
        See `log_likelihoods`.
    noise
        (points, 4): gain, level, position and spread.
    """
    points, recordings = level.shape
    sensors, count = sensor_log_gain.shape[1], gradient.shape[1]
    terms = np.empty((recordings, _TERMS))
    uj, jr, mj = np.empty((recordings, count)), np.empty((recordings, count)), np.empty((recordings, count))
    of_sensors = np.empty((sensors, 4))
    by_sensor = np.empty((2, sensors, count))
    for point in range(points):
        levels = noise[min(point, len(noise) - 1)] ** 2
        at = min(point, len(squared_slopes) - 1)
        _fill_terms(
            level[point],
            uu[point],
            uy[point],
            squared_slopes[at],
            sensor,
            sensor_log_gain[point],
            laplacian,
            square,
            levels,
            terms,
        )
        _project_derivatives(level_slopes[point], uv[point], vy[point], 1 / levels[1], terms, uj, jr)
        _sum_over_sensors(sensor, levels[3], terms, uj, mj, of_sensors, by_sensor[0])
        point_information, slope = information[point], gradient[point]
        point_information[:], slope[:] = 0.0, 0.0
        _add_information(level_slopes[point], uv[point], vv[point], 1 / levels[1], terms, uj, point_information)
        for sensor_index in range(sensors):
            for p in range(count):
                for q in range(p + 1):
                    point_information[p, q] -= (
                        by_sensor[0, sensor_index, p] * of_sensors[sensor_index, 2] * by_sensor[0, sensor_index, q]
                    )
        for p in range(count):
            for q in range(p):
                point_information[q, p] = point_information[p, q]
        _add_mean_gradient(sensor, terms, of_sensors, jr, mj, by_sensor[1], slope)
        if squared_slopes.shape[1]:
            _add_position_gradient(
                level[point],
                level_slopes[point],
                squared_slopes[point],
                uv[point],
                vy[point],
                1 / levels[1],
                sensor,
                terms,
                of_sensors,
                slope,
            )
        for sensor_index in range(sensors):
            mm, mr, shrink, gain = of_sensors[sensor_index]
            for p in range(count):
                slope[p] += levels[3] * (
                    by_sensor[1, sensor_index, p] * (mr - mm * gain) - by_sensor[0, sensor_index, p] * (1 - shrink * mm)
                )
