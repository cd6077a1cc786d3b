"""Diagnoses between their claim and the start of a worker, which may take minutes on a busy machine."""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from service.jobs.process import WorkerProcesses
from service.jobs.runner import Runner
from service.store import campaigns, database, diagnoses, open_store
from service.store.tables import AnyRow
from service.store.tables import diagnoses as table_of_diagnoses
from tests.service.jobs.test_diagnoses import SEVERAL, await_workers
from tests.service.waiting import until
from tests.support.diagnosed import awaited, begun, small, small_report, table
from tests.support.store_server import Place, Server, campaign, running
from underskin import __version__
from underskin.recordings.campaign import parse
from underskin.surrogate.hdf5_format import tables_folder
from underskin.surrogate.sigma_table import SIGMA_TABLE

BACKEND = "sqlite"
TWO = SEVERAL | {"UNDERSKIN_DIAGNOSIS_WORKERS": "2"}


@contextmanager
def no_worker_starts(server: Server) -> Iterator[None]:
    """As on a machine that is too busy to fork one."""
    (ready,) = await_workers(server, 1, "underskin-ready")
    os.kill(ready, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(ready, signal.SIGCONT)


def row_of(place: Place, diagnosis_id: str) -> AnyRow:
    with closing(database(place.database_url, place.folder)) as store:
        return store.read(diagnoses.find, diagnosis_id)


def test_diagnosis_worker_slow_start_kept_alive(place: Place) -> None:
    """A diagnosis whose worker is slow to start is kept alive and never run twice at once."""
    with running(place, **TWO) as server:
        with no_worker_starts(server):
            diagnosis_id = begun(server, small())
            awaited(server, diagnosis_id, "running")
            claimed_at = row_of(place, diagnosis_id).alive_at
            until(lambda: row_of(place, diagnosis_id).alive_at >= claimed_at + 2, "no sign of life")
            with closing(database(place.database_url, place.folder)) as store, store.writing() as connection:
                killed = {"claimed_by": "a server that was killed", "alive_at": 0.0}
                connection.execute(table_of_diagnoses.update().values(**killed))
            other = begun(server, campaign("other", sensors=1), "finger")
            assert awaited(server, other, "running")["state"] == "running"
            assert row_of(place, diagnosis_id).claimed_by == killed["claimed_by"]
        assert awaited(server, diagnosis_id)["report"] == small_report()
        assert awaited(server, other)["state"] == "done"


@pytest.mark.soak
def test_a_diagnosis_for_which_no_thread_starts_is_put_back_and_done_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    tried: list[float] = []
    start: Callable[[threading.Thread], None] = threading.Thread.start

    def start_later(thread: threading.Thread) -> None:
        if thread.name.startswith("d-"):
            tried.append(time.monotonic())
            if len(tried) == 1:
                raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", start_later)
    processes = WorkerProcesses(tables_folder() / SIGMA_TABLE, table().sha256, 1_000_000_000, 600.0, keeps_ready=False)
    with closing(open_store("", tmp_path)) as store:
        arrival = campaigns.NewCampaign(parse(campaign("array", sensors=1)), "palm")
        campaign_id, _ = store.write(campaigns.add, arrival)
        diagnosis = store.write(diagnoses.ask, campaign_id, diagnoses.Basis(table().sha256, __version__), None)
        runner = Runner(store, processes, 1)
        runner.start()
        try:
            until(lambda: store.read(diagnoses.find, diagnosis.id).state == "done")
        finally:
            runner.stop()
    first, second = tried
    assert second - first < diagnoses.HEARTBEAT_TIMEOUT_S, "it was not put back, but taken for abandoned"
    assert "can't start new thread" in caplog.text
