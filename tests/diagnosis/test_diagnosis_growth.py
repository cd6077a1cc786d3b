"""What a diagnosis takes grows no faster than its recordings, however many sensors these are of."""

import time
import tracemalloc

import numpy as np
import pytest

from tests.support.store_server import campaign
from underskin.diagnosis.data.dataset import lines as measured_lines
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.selection.gain_residual import GainResidual
from underskin.recordings.campaign import parse
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.slow

FEW, MANY = 100, 400  # sensors, of two recordings each


def residual(sensors: int, table: SigmaTable) -> GainResidual:
    """Under the paper's model."""
    problem = FittingProblem(measured_lines(parse(campaign("array", sensors=sensors, lines=4)), {}), table)
    nothing = problem.explain(Request(()))
    assert nothing is not None
    return GainResidual(problem, nothing)


def taken(sensors: int, table: SigmaTable) -> tuple[float, int]:
    """Seconds on a processor and largest memory of screening a few laws."""
    own = residual(sensors, table)
    laws = np.random.default_rng(1).normal(size=(16, 2 * sensors, 2))
    own.gains(laws)
    tracemalloc.start()
    fresh = residual(sensors, table)
    tracemalloc.reset_peak()
    fresh.gains(laws)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    began = time.process_time()
    for _ in range(3):
        own.gains(laws)
    return time.process_time() - began, peak


def test_screening_laws_grows_recordings_alone(table: SigmaTable) -> None:
    """Screening laws grows with recordings alone.

    Four times the sensors, of as many recordings each, take at most some six times as much, not sixteen.
    """
    (few_s, few_bytes), (many_s, many_bytes) = (taken(sensors, table) for sensors in (FEW, MANY))
    assert many_bytes < 6 * few_bytes
    assert many_s < 8 * few_s


def test_sensors_recording_several_weighed_alike(table: SigmaTable) -> None:
    """Sensors of one recording and of several are weighed alike.

    By the density of the residual and the features together, worked out with whole matrices.
    """
    own = residual(3, table)
    random = np.random.default_rng(2)
    change = random.normal(size=(1, 6, 1))
    nodes = own.usual
    sensor = np.repeat(np.arange(3), 2)
    shared = own.spread**2 * np.equal.outer(sensor, sensor)

    def log_density(amplitude: float) -> float:
        fixed = own.fixed @ own.fixed.T + shared + amplitude**2 * change[0] @ change[0].T
        terms = []
        for node in nodes:
            for weight, variances in zip(node.log_weights, node.variances, strict=True):
                covariance = fixed + np.diag(variances)
                quadratic = node.residual @ np.linalg.solve(covariance, node.residual)
                terms.append(weight - 0.5 * (quadratic + np.linalg.slogdet(covariance)[1]))
        return float(np.logaddexp.reduce(terms))

    with_half, with_one = (float(own.gains(amplitude * change)[0]) for amplitude in (0.5, 1.0))
    assert with_one - with_half == pytest.approx(log_density(1.0) - log_density(0.5), abs=1e-8)
