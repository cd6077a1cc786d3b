"""What no mechanism describes, from recording to recording: found, described, and not seen where it is not."""

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from rig.draw import drawn, record
from rig.recorded import campaign as recorded
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.rig_reports import rig_report
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.selection.frequency_gp import frequency_bins
from underskin.diagnosis.selection.recording_gp import GainResidual, ScatterNodes
from underskin.recordings.campaign import from_dict
from underskin.surrogate.sigma_table import SigmaTable


@pytest.mark.slow
def test_what_scatters_as_no_rig_does_is_unexplained(table: SigmaTable) -> None:
    assert rig_report(table, {}, gain=0.25)["verdict"] == "unexplained"


@pytest.mark.slow
@pytest.mark.parametrize(("gain", "position_mm"), [(0.05, 0.0), (0.02, 0.28)])
def test_the_scatter_of_an_ordinary_rig_is_nothing_missing(gain: float, position_mm: float, table: SigmaTable) -> None:
    assert rig_report(table, {}, gain=gain, position_mm=position_mm)["verdict"] == "no_mismatch"


def test_the_evidence_of_a_process_is_that_of_the_whole_covariance(table: SigmaTable) -> None:
    """Blocks, projections and eigenvalues against dense covariance matrices, one for each scatter and amplitude."""
    problem = FittingProblem(lines(campaign(Made(offsets_mm=(0.0, 1.0), position_mm=0.1), table)), table)
    (nothing,) = problem.explain([Request(())])
    assert nothing is not None
    residual = GainResidual(problem, nothing)
    amplitudes = np.array([0.02, 0.2])
    sets = np.random.default_rng(1).normal(size=(3, problem.lines.recordings, 4))
    known = residual.fixed @ residual.fixed.T

    def log_density(scatter: ScatterNodes, shapes: np.ndarray) -> float:
        each = []
        for log_weight, variances in zip(scatter.log_weights, scatter.variances, strict=True):
            whole = np.diag(variances) + known + shapes @ shapes.T
            density = multivariate_normal(np.zeros(len(whole)), whole).logpdf(scatter.residual)
            each.append(log_weight + float(density))
        return float(logsumexp(each))

    found = residual.gains(sets, amplitudes)
    expected = [
        logsumexp([log_density(entry, size * own) for entry in residual.usual for size in amplitudes]) for own in sets
    ]
    assert found - found[0] == pytest.approx(np.array(expected) - expected[0], abs=1e-6)
    # Recordings that are alike have the same features.
    alike = np.arange(problem.lines.recordings) % 4
    few = sets[:, :4]
    assert residual.gains(few, amplitudes, alike) == pytest.approx(residual.gains(few[:, alike], amplitudes), abs=1e-8)
    # With hardly any amplitude nothing is gained, but for the grids of scatter: usual ones, and any.
    assert residual.gains(sets, np.array([1e-9])) == pytest.approx(0.0, abs=0.3)


@pytest.mark.parametrize("spacing", [1 / 1.7, 1 / 1.3, 0.62515263])
def test_more_frequencies_than_bins_each_fall_into_one(spacing: float) -> None:
    """Those at the ends, too, that six decimals round up or down."""
    frequency = np.tile(spacing * np.arange(1, 401), 2)
    line, centres = frequency_bins(frequency)
    assert len(centres) <= 160
    assert np.abs(np.log(centres[line] / frequency)).max() <= np.log(400) / 160


@pytest.mark.slow
def test_a_law_that_leads_a_fit_to_absurd_responses_is_no_better_for_it(table: SigmaTable) -> None:
    """A high pass whose corner rises with the preload, of which this diagnosis once failed."""
    content, _ = from_dict(recorded(record(drawn(61496, 231, None))))
    report = diagnosis_report(content, table)
    assert report["verdict"] == "unexplained"
    assert report["unnamed"]["acts_on"] == "frequency_response"
    assert report["unnamed"]["axis"] == "preload_n"
