"""Compiled sums of a diagnosis against the plain formulas."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import minimize, minimize_scalar

from tests.support.diagnosis_campaigns import Made, campaign, design
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.explanation import FittingProblem
from underskin.diagnosis.inference.frf_products import FrfProducts, RowSums
from underskin.diagnosis.inference.likelihood import log_likelihoods
from underskin.diagnosis.inference.line_kernel import line_products, spread_sums
from underskin.diagnosis.inference.optimizer import Evaluated, Fitter
from underskin.diagnosis.inference.pickup_kernel import lost, slopes_lost
from underskin.diagnosis.noise.noise_levels import NoiseLevels
from underskin.diagnosis.noise.noise_priors import level_prior
from underskin.diagnosis.noise.roughness_kernel import roughness_cost
from underskin.diagnosis.selection.process_kernel import at_best_level
from underskin.mechanisms.models.frf_design import frf_design
from underskin.recordings.campaign import FrfRecording, frf_recordings
from underskin.surrogate.sigma_table import load_table
from underskin.units import Floats


@pytest.mark.parametrize(
    "made", [Made(lines=5), Made(lines=400, sensors=6, preloads_n=(0.5, 2.0), spheres_mm=(4.0,))], ids=["few", "many"]
)
def test_sums_over_rows_are_those_of_each_recordings_lines(made: Made) -> None:
    """By a sparse matrix, and by dense blocks of each contact."""
    random = np.random.default_rng(1)
    rows = lines(design(made))
    layout = frf_design(rows.campaign, (), neighbours=False)
    weight, values = random.normal(size=len(rows.value)), random.normal(size=(2, 3, len(layout.line_frequency)))
    found = RowSums(weight, rows, layout)(values)
    assert found.shape == (2, 3, rows.recordings)
    expected = np.add.reduceat(weight * values[..., layout.line], rows.first, axis=-1)
    assert found == pytest.approx(expected, rel=1e-10, abs=1e-10)


def test_products_of_line_factors_are_those_of_complex_numbers() -> None:
    random = np.random.default_rng(4)
    points, recordings, parameters, of_lines = 2, 3, 5, 4
    moving = np.array([1, 4])
    each = random.normal(size=(points, 3, of_lines)) + 1j * random.normal(size=(points, 3, of_lines))
    products, real, imag = np.empty((points, 6, of_lines)), np.empty(each.shape), np.empty(each.shape)
    line_products(each, products, real, imag)
    pairs = [(one, other) for one in range(3) for other in range(one, 3)]
    expected = np.stack([(each[:, one].conj() * each[:, other]).real for one, other in pairs], axis=1)
    assert products == pytest.approx(expected)
    assert np.array_equal(real + 1j * imag, each)

    weight = random.uniform(size=(of_lines, recordings))
    both, with_y = products @ weight, real @ weight
    uv, vy = (np.zeros((points, recordings, parameters)) for _ in range(2))
    vv = np.zeros((points, recordings, parameters, parameters))
    spread_sums(both, with_y, moving, uv, vy, vv)
    slopes = np.zeros((points, parameters, of_lines), dtype=complex)
    slopes[:, moving] = each[:, 1:]
    assert uv == pytest.approx(np.einsum("pl,pkl,lr->prk", each[:, 0].conj(), slopes, weight).real)
    assert vv == pytest.approx(np.einsum("pjl,pkl,lr->prjk", slopes.conj(), slopes, weight).real)
    assert vy == pytest.approx(np.einsum("pkl,lr->prk", slopes.real, weight))


def test_lines_that_recordings_measure_at_other_frequencies_are_each_found() -> None:
    made = design(Made(lines=5, sensors=2, preloads_n=(0.5, 2.0), spheres_mm=(4.0,)))
    first, *others = frf_recordings(made)
    hz = np.array([30.0, 41.0, 500.0])
    changed = FrfRecording.of_lines(first, hz, np.ones(3, dtype=complex))
    layout = frf_design(replace(made, recordings=(changed, *others)), (), neighbours=False)
    assert layout.line_frequency[layout.line] == pytest.approx(layout.row_frequency, rel=0)
    assert np.array_equal(layout.line_contact[layout.line], layout.point_contact[layout.point][layout.recording])
    pairs = {*zip(layout.line_contact.tolist(), layout.line_frequency.tolist(), strict=True)}
    assert len(pairs) == len(layout.line_frequency) == layout.line.max() + 1


def test_steps_of_noise_levels_end_where_the_cost_is_least() -> None:
    """Against a general minimisation; a level that is held stays, and what is infinite is left alone."""
    made = Made(lines=5, sensors=2, preloads_n=(0.5, 1.0, 2.0), gain=0.03, position_mm=0.1)
    problem = FittingProblem(lines(campaign(made, load_table())), load_table())
    for placed in (False, True):
        fitter = Fitter([problem.hypothesis((), placed)])
        begun = fitter.begin([np.zeros((1, 0))])
        settled = fitter.settle(begun, 60)

        def cost(levels: Floats, fitter: Fitter = fitter, begun: Evaluated = begun) -> float:
            return float(fitter.costs(begun, levels[None, None])[0, 0])

        least = minimize(cost, begun.points.covariance[0], method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-8})
        assert settled.cost[0] == pytest.approx(least.fun, abs=5e-3)
        assert fitter.costs(begun, settled.points.covariance[:, None])[0, 0] == pytest.approx(settled.cost[0], abs=1e-9)
        held = fitter.settle(begun, 60, held=0)
        assert held.points.covariance[0, 0] == begun.points.covariance[0, 0]
        assert settled.cost[0] < held.cost[0] < begun.cost[0]
        lost = fitter.settle(replace(begun, cost=np.array([np.inf])), 3)
        assert np.array_equal(lost.points.covariance, begun.points.covariance)


@pytest.mark.parametrize("times", [3.0, 1e6, 1e15, 1e22])
def test_the_likelihood_of_a_prediction_far_beyond_what_was_measured_is_that_of_exact_arithmetic(times: float) -> None:
    """Not what rounding leaves of two squares: a law that gave 1e20 times the response once had a χ² of −8e28."""
    made = Made(lines=5, sensors=1, preloads_n=(0.5, 2.0), spheres_mm=(4.0,))
    problem = FittingProblem(lines(campaign(made, load_table())), load_table())
    fitter = Fitter([problem.hypothesis((), placed=False, whole=True)])
    at = fitter.begin([np.zeros((1, 0))])
    assert isinstance(at.products, FrfProducts)
    several = at.products, at.products.scaled(np.array([times]))
    levels = fitter.levels(at.points.covariance[:, None])
    near, far = (
        log_likelihoods(fitter.lines, fitter.curvature, products, levels, at.points.bend)[0, 0] for products in several
    )
    expected = [exact_log_likelihood(products, fitter.levels(at.points.covariance).first) for products in several]
    assert far - near == pytest.approx(expected[1] - expected[0], rel=1e-9)


def exact_log_likelihood(products: FrfProducts, levels: NoiseLevels) -> float:
    """Of one sensor's recordings by Woodbury's identity in rational numbers, up to what lines have about their means
    and to their level."""
    gain, noise, spread = (Fraction(float(one)) ** 2 for one in (levels.gain, levels.level, levels.spread))
    chi2 = mm = mr = Fraction(0)
    log_determinant = 0.0
    for numbers in zip(products.level[0], products.uu[0], products.uy[0], products.yy, strict=True):
        level, uu, uy, yy = (Fraction(float(one)) for one in numbers)
        size, along = level**2 * uu / noise, level * (uy - level * uu) / noise
        chi2 += (yy - 2 * level * uy + level**2 * uu) / noise - gain * along**2 / (1 + gain * size)
        mm, mr = mm + size / (1 + gain * size), mr + along / (1 + gain * size)
        log_determinant += np.log1p(float(gain * size))
    return -0.5 * (float(chi2 - spread * mr**2 / (1 + spread * mm)) + log_determinant + np.log1p(float(spread * mm)))


def test_what_pick_up_takes_is_the_difference_of_the_weights() -> None:
    random = np.random.default_rng(2)
    points, sets, rows, recordings, of_lines, distinct = 2, 3, 40, 4, 7, 5
    alike, line = random.integers(0, distinct, rows), random.integers(0, of_lines, rows)
    recording = np.sort(random.integers(0, recordings, rows))
    precision = random.uniform(0.5, 2.0, rows)
    y = random.normal(size=rows) + 1j * random.normal(size=rows)
    u = random.normal(size=(points, of_lines)) + 1j * random.normal(size=(points, of_lines))
    v = random.normal(size=(points, 2, of_lines)) + 1j * random.normal(size=(points, 2, of_lines))
    v[:, 1] *= np.array([0.0, 1.0])[:, None]  # the first point's direction does not change with the second parameter
    square = random.exponential(size=(points, distinct, sets)) ** 4
    square[:, 0] = 0.0
    sums = [np.zeros((points, sets, recordings)) for _ in range(3)]
    determinant = np.zeros((points, sets))
    lost(square, alike, precision, recording, y, line, u, *sums, determinant)
    taken = precision[:, None] - 1 / (1 / precision[:, None] + square[:, alike])  # (points, rows, sets)
    on_rows, v_rows, each = u[:, line], v[..., line], np.eye(recordings)[recording]

    def summed(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
        return np.asarray(-(values * weight) @ each)

    expected = np.abs(on_rows) ** 2, (on_rows.conj() * y).real, np.abs(y) ** 2 * np.ones((points, 1))
    for found, values in zip(sums, expected, strict=True):
        assert found == pytest.approx(summed(values[:, None], np.moveaxis(taken, 1, 2)))
    assert determinant == pytest.approx(2 * np.log1p(square[:, alike] * precision[:, None]).sum(axis=1))

    uv, vy, vv = (
        np.zeros((points, recordings, 2)),
        np.zeros((points, recordings, 2)),
        np.zeros((points, recordings, 2, 2)),
    )
    slopes_lost(np.ascontiguousarray(square[..., 0]), alike, precision, recording, y, line, u, v, uv, vy, vv)
    first = taken[:, None, :, 0]
    assert np.swapaxes(uv, 1, 2) == pytest.approx(summed((on_rows.conj()[:, None] * v_rows).real, first))
    assert np.swapaxes(vy, 1, 2) == pytest.approx(summed((v_rows.conj() * y).real, first))
    products = (v_rows.conj()[:, :, None] * v_rows[:, None]).real
    assert np.moveaxis(vv, 1, -1) == pytest.approx(summed(products, first[:, None]))


def test_the_roughness_of_lines_has_students_likelihood() -> None:
    random = np.random.default_rng(3)
    variance, middle = random.uniform(0.5, 2.0, 30), np.arange(1, 29)
    share, rough, freedom = random.uniform(0.2, 0.8, 28), random.exponential(size=28), 6.0

    def cost(d2: np.ndarray) -> float:
        v = d2[middle] + share**2 * d2[middle - 1] + (1 - share) ** 2 * d2[middle + 1]
        return float(np.log(v).sum() + (freedom / 2 + 1) * np.log1p(2 * rough / v / freedom).sum())

    by_variance = np.zeros(30)
    assert roughness_cost(variance, middle, share, rough, freedom, by_variance) == pytest.approx(cost(variance))
    step = 1e-6 * np.eye(30)
    slopes = [(cost(variance + one) - cost(variance - one)) / 2e-6 for one in step]
    assert by_variance == pytest.approx(np.array(slopes), rel=1e-6, abs=1e-7)


def test_a_process_along_frequency_is_weighed_at_the_best_level_of_the_noise() -> None:
    random = np.random.default_rng(4)
    eigenvalues = random.exponential(300.0, 12)
    squares = eigenvalues * random.exponential(20.0, 12)  # less than χ² allows
    chi2, freedom, prior, amplitudes = 900.0, 600.0, level_prior(0.1), np.array([0.0, 0.05, 0.5])
    found = np.empty(3)
    at_best_level(chi2, freedom, np.array(prior.row), eigenvalues, squares, amplitudes, found)
    for amplitude, value in zip(amplitudes, found, strict=True):

        def cost(level: float, a2: float = float(amplitude) ** 2) -> float:
            k2 = np.exp(2 * level)
            inner = 1 + a2 * eigenvalues / k2
            left = 0.5 * (chi2 / k2 - (a2 * squares / inner).sum() / k2**2)
            return float(left + freedom * level + np.log(inner).sum() - prior.log_density(level))

        best = minimize_scalar(cost, bounds=(-1.0, 5.0), method="bounded", options={"xatol": 1e-9})
        assert value == pytest.approx(-float(best.fun), abs=2e-3)
