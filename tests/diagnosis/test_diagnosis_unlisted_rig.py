"""Laws that nobody listed, hidden by independent rigs: found and predicted."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.draw import drawn, record
from rig.recorded import campaign as recorded
from tests.support.cases import first
from tests.support.lean_reports import beside, lean_report, whole_report
from underskin.recordings.campaign import from_dict, parse
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.slow

FEW = beside("sensor_spread", "modulus_error", "thickness_error", "preload_dependent_d33")
TRUTH = "unlisted-open-truth.json"
ALIKE = {"day_time": "time_of_day", "previous_preload": "previous_preload_n", "drift_then_plateau": "saturating"}
SHARED = Path(os.environ.get("UNDERSKIN_CAMPAIGNS", ""))
needs_campaigns = pytest.mark.skipif(
    "UNDERSKIN_CAMPAIGNS" not in os.environ, reason="UNDERSKIN_CAMPAIGNS does not name the folder of campaigns"
)


def report_on(name: str, table: SigmaTable) -> dict[str, Any]:
    document = json.loads((SHARED / "unlisted-open" / f"{name}.json").read_text(encoding="utf-8"))
    return lean_report(parse(document), table, *FEW)


@pytest.mark.soak
@needs_campaigns
def test_laws_independent_rig_found_predict_held(table: SigmaTable) -> None:
    """Most laws of an independent rig are found and predict what was held out."""
    truths = [entry for entry in json.loads((SHARED / TRUTH).read_text()).items() if entry[1]["identifiable"]]
    right, shares = 0, []
    for name, truth in (tried := first(5, truths)):
        report = report_on(name, table)
        law, own = report["unnamed"], truth["law"]
        if law is None:
            continue
        good = all(
            law[field] in {ALIKE.get(word, word) for word in (own[field], *truth[f"{field}_also"])}
            for field in ("acts_on", "axis", "form")
        )
        right += good
        before, after = law["heldout_rmse_percent"]["before"], law["heldout_rmse_percent"]["after"]
        if good:
            shares.append((before**2 - after**2) / (before**2 - report["fit"]["noise_floor_percent"] ** 2))
    assert right >= 0.8 * len(tried)
    assert np.median(shares) > 0.8


@needs_campaigns
@pytest.mark.soak
def test_delay_disperses_delay_exponent(table: SigmaTable) -> None:
    """A delay that disperses is a delay with another exponent.

    A phase that grows with the square of frequency.
    """
    report = report_on("c6h8e3rgx", table)
    assert "this is a delay with another exponent: its phase grows with frequency to the power" in report["statement"]
    exponent = next(entry for entry in report["unnamed"]["parameters"] if entry["name"] == "exponent")
    assert exponent["value"] == pytest.approx(2.0, abs=0.05)


@pytest.mark.soak
def test_law_leads_fit_absurd_responses(table: SigmaTable) -> None:
    """A law that leads a fit to absurd responses is no better for it.

    A high pass whose corner rises with the preload, of which this diagnosis once failed.
    """
    content, _ = from_dict(recorded(record(drawn(61496, 231, None))))
    report = whole_report(content, table)
    assert report["verdict"] == "unexplained"
    assert (report["unnamed"]["acts_on"], report["unnamed"]["axis"]) == ("frequency_response", "preload_n")
