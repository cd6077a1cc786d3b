"""Diagnoses that take long are no obstacle for short ones."""

import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Self, cast

import pytest

from service.jobs import runner
from service.jobs.process import CampaignInput, WorkerProcesses
from service.jobs.runner import Runner
from service.store import Database, campaigns, diagnoses, open_store
from tests.service.waiting import until
from tests.support.diagnosed import report
from tests.support.store_server import campaign
from underskin.recordings.campaign import parse


class Played:
    """A worker that takes as long as its campaign's name says."""

    too_long = "it takes more than 1 s on a processor (UNDERSKIN_DIAGNOSIS_SECONDS)"
    failure, last_words = "", ""

    def __init__(self, name: str, report: dict[str, Any]) -> None:
        self.news = threading.Event()
        self.said: dict[str, Any] = {"progress": 0.0}
        self._ends = time.monotonic() + (3600.0 if name == "long" else 0.2)
        self._report = report

    @property
    def ended(self) -> bool:
        if time.monotonic() >= self._ends:
            self.said["report"] = self._report
        return time.monotonic() >= self._ends

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing is to be ended."""


class Workers:
    """Played ones, and the names of those under way."""

    table_sha256, longest_s = "table", 7200.0

    def __init__(self) -> None:
        self.begun: list[str] = []

    def at_work(self, given: Sequence[CampaignInput], *_: object) -> Played:
        name = given[0].skin_id
        self.begun.append(name)
        return Played(name, dict(report()))

    def get_ready(self) -> None:
        """It is."""

    def stop(self) -> None:
        """Nothing runs."""


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Database]:
    with closing(open_store("", tmp_path)) as opened:
        yield opened


def in_queue(store: Database, name: str, sensors: int) -> str:
    arrival = campaigns.NewCampaign(parse(campaign(f"{name} {sensors}", sensors=sensors)), name)
    campaign_id, _ = store.write(campaigns.add, arrival)
    return str(store.write(diagnoses.ask, campaign_id, diagnoses.Basis("table", "1"), None).id)


def state(store: Database, diagnosis_id: str) -> str:
    return str(store.read(diagnoses.find, diagnosis_id).state)


@pytest.mark.soak
def test_short_diagnoses_do_not_wait_for_long_ones(store: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    """With one worker that is at a long one, and another long one before them in the queue."""
    for name, seconds in (("_LONG_S", 0.3), ("_SHORT_S", 1.0), ("_POLL_S", 0.05), ("_BEAT_S", 0.05)):
        monkeypatch.setattr(runner, name, seconds)
    first, second = (in_queue(store, "long", sensors) for sensors in (4, 3))
    short = [in_queue(store, "short", sensors) for sensors in (6, 1)]
    workers = Workers()
    runs = Runner(store, cast("WorkerProcesses", workers), 1)
    runs.start()
    try:
        until(lambda: [state(store, one) for one in short] == ["done", "done"], workers.begun)
        assert state(store, first) == "running"
        assert state(store, second) in ("queued", "running")
        assert workers.begun.count("long") == 2
    finally:
        runs.stop()
