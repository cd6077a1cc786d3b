"""Laws that nobody listed, hidden by the virtual rig and by an independent one: found and predicted."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from tests.support.cases import first
from tests.support.rig_reports import rig_report
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.recordings.campaign import from_dict
from underskin.surrogate.sigma_table import SigmaTable

TRUTH = "unlisted-open-truth.json"
ALIKE = {"day_time": "time_of_day", "previous_preload": "previous_preload_n", "drift_then_plateau": "saturating"}


@pytest.mark.slow
def test_what_remembers_the_preload_before_is_found(table: SigmaTable) -> None:
    law = rig_report(table, {"hysteretic_d33": {"amplitude": 0.1}})["unnamed"]
    assert law["axis"] == "previous_preload_n"


@pytest.mark.slow
def test_a_place_that_runs_round_is_a_periodic_place(table: SigmaTable) -> None:
    law = rig_report(table, {"stage_wobble": {"amplitude_mm": 0.5, "period_recordings": 6.3}})["unnamed"]
    assert (law["acts_on"], law["axis"], law["form"]) == ("position", "order", "periodic")
    period = next(entry for entry in law["parameters"] if entry["name"] == "period")
    assert period["value"] == pytest.approx(6.3, rel=0.02)


@pytest.mark.slow
@pytest.mark.skipif(
    "UNDERSKIN_CAMPAIGNS" not in os.environ, reason="UNDERSKIN_CAMPAIGNS does not name the folder of campaigns"
)
def test_most_laws_of_an_independent_rig_are_found_and_predict_what_was_held_out(table: SigmaTable) -> None:
    folder = Path(os.environ["UNDERSKIN_CAMPAIGNS"])
    truths = [entry for entry in json.loads((folder / TRUTH).read_text()).items() if entry[1]["identifiable"]]
    right, shares = 0, []
    for name, truth in (tried := first(5, truths)):
        found, _ = from_dict(json.loads((folder / "unlisted-open" / f"{name}.json").read_text()))
        document = diagnosis_report(found, table)
        law, own = document["unnamed"], truth["law"]
        if law is None:
            continue
        good = all(
            law[field] in {ALIKE.get(word, word) for word in (own[field], *truth[f"{field}_also"])}
            for field in ("acts_on", "axis", "form")
        )
        right += good
        before, after = law["heldout_rmse_percent"]["before"], law["heldout_rmse_percent"]["after"]
        if good:
            shares.append((before**2 - after**2) / (before**2 - document["fit"]["noise_floor_percent"] ** 2))
    assert right >= 0.8 * len(tried)
    assert np.median(shares) > 0.8
