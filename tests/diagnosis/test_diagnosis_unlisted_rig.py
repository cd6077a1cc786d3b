"""Laws that nobody listed, hidden by independent rigs: found and predicted."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.cases import first
from tests.support.lean_reports import beside, lean_report
from underskin.recordings.campaign import parse
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
def test_most_laws_of_an_independent_rig_are_found_and_predict_what_was_held_out(table: SigmaTable) -> None:
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
