"""What the chain of force and charge does to a diagnosis of time series: delays, filters, noise, values at a bound."""

from dataclasses import replace
from typing import Any

import pytest

import underskin
from tests.support.cases import first
from tests.support.lean_reports import beside
from tests.support.shaken_series import D33, delayed, high_pass, low_pass, shaken
from underskin.client.documents import Report
from underskin.mechanisms import CATALOGUE
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.slow

# Those that act along frequency, and one that does not.
OF_LINES = beside(
    *("amplifier_high_pass", "amplifier_low_pass", "sensor_relaxation", "timing_delay", "contact_resonance"),
    *("mains_pickup", "layered_contact"),
)


def diagnosed(table: SigmaTable, **chain: Any) -> Report:
    return underskin.diagnose(shaken(**chain), table, without=OF_LINES)


def named(report: Report) -> dict[str, dict[str, float]]:
    """Value of each parameter of each mechanism."""
    return {one.name: {entry.name: entry.value or 0.0 for entry in one.parameters} for one in report.mechanisms}


@pytest.mark.parametrize(
    ("chain", "delay_us"),
    first(
        2, [({"force": delayed(3e-3)}, -3e3), ({"charge": delayed(60e-3)}, 60e3), ({"charge": delayed(20e-3)}, 20e3)]
    ),
)
def test_delay_either_sign_size_named(chain: dict[str, Any], delay_us: float, table: SigmaTable) -> None:
    """A delay of either sign and any size is named.

    FRFs that were computed here are not conjugated, and a late charge is not taken for a small one.
    """
    report = diagnosed(table, **chain)
    assert report.verdict == "explained", report.statement
    assert named(report)["timing_delay"]["delay"] == pytest.approx(delay_us, rel=0.01)
    assert {finding.code for finding in report.findings}.isdisjoint(("conjugated", "units_off_by_1000", "no_response"))
    assert report.d33 is not None
    assert report.d33.value == pytest.approx(D33, rel=0.03)


@pytest.mark.parametrize(
    ("chain", "mechanism", "parameter", "corner_hz"),
    first(
        2,
        [
            (high_pass(150.0), "amplifier_high_pass", "corner", 150.0),
            (low_pass(120.0, 2), "amplifier_low_pass", "low_pass_corner", 120.0),
            (low_pass(90.0), "amplifier_low_pass", "low_pass_corner", 90.0),
        ],
    ),
)
def test_a_filter_within_the_band_is_named_with_its_corner_and_d33(
    chain: Any, mechanism: str, parameter: str, corner_hz: float, table: SigmaTable
) -> None:
    report = diagnosed(table, charge=chain)
    assert report.verdict == "explained", report.statement
    assert named(report)[mechanism][parameter] == pytest.approx(corner_hz, rel=0.05)
    assert report.d33 is not None
    assert report.d33.quotable
    assert report.d33.low is not None
    assert report.d33.high is not None
    assert report.d33.low < D33 < report.d33.high


@pytest.mark.parametrize("share", first(1, [0.1, 0.03]))
def test_noise_in_the_force_is_no_physics(share: float, table: SigmaTable) -> None:
    """Lines that the force did not excite say nothing, and its noise does not lower d33."""
    report = diagnosed(table, force_noise=share)
    assert report.verdict == "no_mismatch", report.statement
    assert report.d33 is not None
    assert report.d33.value == pytest.approx(D33, rel=0.03)
    assert "noise_in_frf" in {finding.code for finding in report.findings}


def test_value_bound_search_explains_nothing(table: SigmaTable, monkeypatch: pytest.MonkeyPatch) -> None:
    """A value at the bound of its search explains nothing.

    As a corner of 150 Hz is where the search ends at 60 Hz: it is at or beyond that, and d33 is not to be quoted.
    """
    mechanism = CATALOGUE["amplifier_high_pass"]
    narrow = replace(mechanism.parameters_stated[0], high=60.0)
    monkeypatch.setattr(type(mechanism), "parameters_stated", (narrow, *mechanism.parameters_stated[1:]))
    left_out = [name for name in CATALOGUE if name not in ("amplifier_high_pass", "timing_delay")]
    report = underskin.diagnose(shaken(charge=high_pass(150.0)), table, without=left_out)
    assert report.verdict != "explained"
    assert report.d33 is None or not report.d33.quotable
    at_bound = [entry for one in report.mechanisms for entry in one.parameters if entry.at_bound]
    assert [(entry.name, entry.at_bound) for entry in at_bound] in ([("corner", "high")], [])
    assert report.verdict == "unexplained" or "at or beyond 60 Hz" in report.statement


def test_an_unlisted_law_over_frequency_leaves_no_d33_to_quote(table: SigmaTable) -> None:
    """A low-pass that no catalogue lists takes from the response within the band that d33 is read from."""
    left_out = [*OF_LINES, "amplifier_low_pass", "sensor_relaxation", "contact_resonance"]
    report = underskin.diagnose(shaken(charge=low_pass(100.0)), table, without=left_out)
    assert report.verdict == "unexplained", report.statement
    assert report.d33 is None or not report.d33.quotable
