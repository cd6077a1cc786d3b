"""What a campaign could have shown at all, and what its answers are worth where they could show little."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import beside, lean_report, quick_diagnosis, whole_report
from tests.support.sphere_curves import campaign as of_curve
from tests.support.sphere_curves import pressed, ways
from underskin.mechanisms import CATALOGUE, compose
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

pytestmark = pytest.mark.slow

QUIET = Made(sensors=1, repeats=2)
FEW = beside("preload_dependent_d33", "timing_delay", "ageing", "thickness_error", "amplifier_high_pass")


def visible(report: dict[str, Any]) -> dict[str, float]:
    """The smallest visible percentage of each mechanism in a campaign."""
    return {entry["mechanism"]: entry["smallest_visible_percent"] for entry in report["power"]}


@pytest.fixture(scope="module")
def least(table: SigmaTable) -> dict[str, float]:
    report = lean_report(campaign(QUIET, table), table, *FEW)
    assert report["verdict"] == "no_mismatch"
    return visible(report)


def changed_percent(name: str, values: Sequence[float], table: SigmaTable) -> float:
    """What a mechanism changes of the response, as a root mean square over all rows [%]."""
    empty = campaign(QUIET, table)
    base, model = compose((), empty, table), compose((name,), empty, table)
    fit = np.array([entry.start for entry in base.parameters])
    own = [entry.to_fit(value) for entry, value in zip(model.parameters, values, strict=False)]
    with_it, without = model.predict(np.array([*own, *fit])).value, base.predict(fit).value
    return float(100 * np.sqrt((np.abs(with_it - without) ** 2).sum() / (np.abs(without) ** 2).sum()))


def test_three_times_visible_seen_third(least: dict[str, float], table: SigmaTable) -> None:
    """Three times what is visible is seen and a third of it is not."""
    name = "preload_dependent_d33"
    coefficients = np.geomspace(0.01, 5.0, 60)
    changes: Floats = np.array([changed_percent(name, (value, 1.0), table) for value in coefficients])
    for times, seen in ((3.0, True), (1 / 3, False)):
        strength = float(np.interp(times * least[name], changes, coefficients))
        for seed in first(1, [11, 12]):
            hidden = replace(QUIET, mechanisms=(name,), parameters=(strength, 1.0), seed=seed)
            report = lean_report(campaign(hidden, table), table, *FEW)
            assert (report["verdict"] != "no_mismatch") is seen


def test_more_recordings_and_less_scatter_show_more(least: dict[str, float], table: SigmaTable) -> None:
    many, rough = (
        visible(lean_report(campaign(made, table), table, *FEW))
        for made in (replace(QUIET, repeats=8), replace(QUIET, gain=0.05, line=0.02))
    )
    assert set(least) <= set(many)
    for name in ("timing_delay", "preload_dependent_d33"):
        assert rough[name] > 1.5 * least[name]
        assert many[name] < 0.9 * least[name]
    assert many["timing_delay"] == pytest.approx(least["timing_delay"] / 2, rel=0.2)  # four times as many recordings


def test_a_quiet_report_says_what_would_have_shown(table: SigmaTable) -> None:
    report = whole_report(campaign(QUIET, table), table)
    known = sum("frf" in mechanism.kinds for mechanism in CATALOGUE.values())
    small = {name for name, percent in visible(report).items() if percent <= 5.0}
    hidden = {
        entry["mechanism"]
        for entry in report["not_identifiable"]
        if entry["confounded_with"] in ("d33", "noise")  # at a typical strength: not to be read as ruled out
    }
    assert small & hidden
    said = report["statement"].rpartition(". ")[2]
    assert said.startswith(f"Of the {known} known mechanisms {len(small - hidden)} would have shown")
    named = set(said.rstrip(".").partition(": ")[2].split(", "))
    assert named == {name.replace("_", " ") for name in small - hidden}
    assert 0 < len(named) < known
    percents = list(visible(report).values())
    assert percents == sorted(percents)
    assert all(0 < percent < 100 for percent in percents)


def test_curve_shows_what_is_not_noise() -> None:
    """A curve that shows a modulus wrong by less than usual does not say that such a one stays within the noise."""
    depth = ways(-0.1, 0.3, -0.1)
    report = dict(quick_diagnosis(of_curve(depth, pressed(depth), skin={"youngs_modulus_mpa": 1.0})).document)
    within_noise = {entry["mechanism"] for entry in report["not_identifiable"] if entry["confounded_with"] == "noise"}
    assert visible(report)["modulus_error"] < 15.0
    assert "modulus_error" not in within_noise
    assert "instrument_compliance" in within_noise
