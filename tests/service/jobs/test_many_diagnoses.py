"""Diagnoses one after the other: each ends with a report, and the server and its worker take no more memory for it."""

from pathlib import Path

import pytest

from bench.figures import Figure
from bench.soak import SOAK, record
from tests.support.diagnosed import asked, awaited, resonant, sent
from tests.support.memory import family_mb
from tests.support.store_server import Place, running

DIAGNOSES = 2000
WARM_AFTER = DIAGNOSES // 4  # caches are full by then
MOST_GROWN_MB = 60


@pytest.mark.soak
@pytest.mark.skipif(not SOAK, reason="hours of diagnoses; make soak")
def test_memory_is_flat_over_many_diagnoses(tmp_path: Path) -> None:
    place = Place(tmp_path / "data")
    place.folder.mkdir()
    memory_mb = []
    # As a lab's server runs: one process loads the program and forks a worker for each of them.
    with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="1", UNDERSKIN_DIAGNOSIS_READY="true") as server:
        for number in range(DIAGNOSES):
            campaign_id = sent(server, resonant(f"array-{number}", seed=number), f"palm-{number % 25}")
            assert awaited(server, asked(server, campaign_id))["state"] == "done"
            memory_mb.append(family_mb(server.process.pid))
    grown = max(memory_mb[-WARM_AFTER:]) - max(memory_mb[: 2 * WARM_AFTER])
    assert grown <= MOST_GROWN_MB
    record(Figure("Diagnoses in a row with a report", DIAGNOSES, "", 2000))
    record(Figure("2,000 diagnoses in a row: memory grown over the last half", grown, "MB", MOST_GROWN_MB, "lower"))
