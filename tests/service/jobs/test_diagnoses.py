"""Diagnoses of kept campaigns: by worker processes that are killed, cancelled and taken up again."""

import os
import signal
import threading
import time
from contextlib import closing, suppress
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from service.store import database, diagnoses
from service.store.tables import diagnoses as table_of_diagnoses
from tests.service.backends import on
from tests.support.diagnosed import (
    MOST,
    asked,
    awaited,
    begun,
    found,
    report,
    resonant,
    sent,
    small,
    small_report,
    table,
)
from tests.support.lean_reports import BESIDE_SKINS
from tests.support.store_server import Place, Server, campaign, running
from underskin import Client, ServiceError, __version__

NONE = {"UNDERSKIN_DIAGNOSIS_WORKERS": "0"}
ONE = {"UNDERSKIN_DIAGNOSIS_WORKERS": "1"}
SEVERAL = ONE | {"UNDERSKIN_DIAGNOSIS_READY": "true"}  # of a test with several diagnoses: the program is loaded once


@cache
def long() -> dict[str, Any]:
    """A campaign whose diagnosis ends by no means before something ends it."""
    return resonant("long", preloads=[0.5 + 0.1 * step for step in range(20)], lines=60)


def workers_of(server: Server, name: str = "underskin-works") -> list[int]:
    """Process ids of the worker processes of a server that are at a job, or of the process that forks them."""
    pids = []
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            if entry.name.isdigit() and (entry / "comm").read_text().strip() == name:
                parent, state = _parent(entry.name)
                if state != "Z" and server.process.pid in (parent, _parent(str(parent))[0]):
                    pids.append(int(entry.name))
    return pids


def _parent(pid: str) -> tuple[int, str]:
    """A process' parent, and its state."""
    fields = Path("/proc", pid, "stat").read_text().rpartition(")")[2].split()
    return int(fields[1]), fields[0]


def await_workers(server: Server, count: int, name: str = "underskin-works") -> list[int]:
    deadline = time.monotonic() + 240
    while time.monotonic() < deadline:
        pids = workers_of(server, name)
        if len(pids) == count:
            return pids
        time.sleep(0.1)
    raise AssertionError(f"{len(workers_of(server, name))} processes {name}")


def is_gone(pid: int) -> bool:
    """Whether a process ends within a while, whoever its parent is by now."""
    deadline = time.monotonic() + 240
    while time.monotonic() < deadline:
        with suppress(FileNotFoundError, ProcessLookupError):
            if (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z":
                time.sleep(0.1)
                continue
        return True
    return False


def test_a_campaign_is_diagnosed_once(working: Server) -> None:
    with Client(str(working.http.base_url)) as client:
        campaign_id = sent(working, small())
        started = client.diagnoses.start(campaign_id, without=MOST)
        shares: list[float] = []
        done = client.diagnoses.wait(started["id"], progress=shares.append)
        assert (done["state"], done["verdict"], done["progress"]) == ("done", "explained", 1.0)
        assert shares == sorted(shares)
        assert done["report"] == small_report()
        assert client.diagnoses.start(campaign_id, without=MOST) == {"id": started["id"], "state": "done"}
        with pytest.raises(ServiceError, match="cannot be cancelled"):
            client.diagnoses.cancel(started["id"])
        client.campaigns.exclude(campaign_id, "r3", "cable loose")
        assert client.diagnoses.get(started["id"])["outdated"].startswith("changed")
        second = client.diagnoses.wait(client.diagnoses.start(campaign_id, without=MOST)["id"])
        assert (second["excluded"], second["outdated"]) == (1, None)
        assert second["report"]["findings"][0] == {
            "code": "excluded",
            "recording": "r3",
            "field": "",
            "statement": "Left out: cable loose",
        }
        assert second["report"] != done["report"]
        client.campaigns.withdraw(campaign_id, "fell down")
        with pytest.raises(ServiceError, match="withdrawn: fell down"):
            client.diagnoses.start(campaign_id)


@on("sqlite")
def test_a_killed_server_leaves_no_process_and_takes_up_what_it_was_at(place: Place) -> None:
    """Diagnoses of a campaign and of several."""
    with running(place, **SEVERAL) as server, Client(str(server.http.base_url)) as client:
        first, second = (begun(server, small(), name, BESIDE_SKINS) for name in ("a", "b"))
        client.campaigns.post(resonant("another", preloads=(1.0,), lines=6, seed=3), skin="b")
        both = client.skins.diagnose("b", without=MOST)["id"]
        awaited(server, first, "running")
        (ready,), (worker,) = await_workers(server, 1, "underskin-ready"), await_workers(server, 1)
        server.kill()
        assert is_gone(worker)
        assert is_gone(ready)
    with running(place, **SEVERAL) as server:
        for diagnosis_id in (first, second):
            diagnosis = awaited(server, diagnosis_id)
            assert (diagnosis["state"], diagnosis["report"]) == ("done", small_report(BESIDE_SKINS))
        together = awaited(server, both)
        assert (together["state"], len(together["campaign_ids"])) == ("done", 2)
        assert together["report"]["campaign"] == "b"


@on("postgresql")
def test_a_server_that_ends_puts_back_what_it_was_at(place: Place) -> None:
    with running(place, **ONE) as server:
        diagnosis_id = asked(server, sent(server, long()))
        (worker,) = await_workers(server, 1)
        server.process.send_signal(signal.SIGTERM)
        server.process.wait(240)
        assert is_gone(worker)
    with running(place, **NONE) as server:
        assert found(server, diagnosis_id)["state"] == "queued"


def test_cancelled_while_it_runs_and_while_it_waits(working: Server) -> None:
    with Client(str(working.http.base_url)) as client:
        first, second = (asked(working, sent(working, long(), name)) for name in ("a", "b"))
        (worker,) = await_workers(working, 1)
        assert client.diagnoses.cancel(second)["state"] == "cancelled"
        assert client.diagnoses.cancel(first)["state"] == "cancelled"
        assert client.diagnoses.cancel(first)["state"] == "cancelled"
        assert is_gone(worker)
        assert workers_of(working) == []
        again = client.diagnoses.start(found(working, first)["campaign_id"])
        assert again["id"] != first
        assert client.diagnoses.cancel(again["id"])["state"] == "cancelled"
        assert awaited(working, begun(working, small()))["report"] == small_report()
        assert found(working, first)["state"] == found(working, second)["state"] == "cancelled"


def test_a_fork_server_is_kept_ready_and_replaced_when_it_is_killed(working: Server) -> None:
    """A worker that it has forked goes on without it."""
    (ready,) = await_workers(working, 1, "underskin-ready")
    diagnosis_id = begun(working, small(), without=BESIDE_SKINS)
    (worker,) = await_workers(working, 1)
    assert _parent(str(worker))[0] == ready
    os.kill(ready, signal.SIGKILL)
    assert is_gone(ready)
    done = awaited(working, diagnosis_id)
    assert (done["state"], done["report"]) == ("done", small_report(BESIDE_SKINS))
    assert is_gone(worker)
    (another,) = await_workers(working, 1, "underskin-ready")
    assert awaited(working, begun(working, small(), "finger"))["state"] == "done"
    assert await_workers(working, 1, "underskin-ready") == [another]


def test_a_worker_that_dies_is_told(working: Server) -> None:
    campaign_id = sent(working, long())
    diagnosis_id = asked(working, campaign_id)
    (worker,) = await_workers(working, 1)
    os.kill(worker, signal.SIGKILL)
    died = awaited(working, diagnosis_id)
    assert (died["state"], died["report"]) == ("failed", None)
    assert "killed by signal 9" in died["reason"]
    assert working.http.get("/ready").status_code == 200
    again = asked(working, campaign_id)
    assert again != diagnosis_id
    assert awaited(working, again, "running")["state"] == "running"
    assert working.http.delete(f"/v1/diagnoses/{again}").json()["state"] == "cancelled"


def test_beyond_a_limit_fails(tmp_path: Path) -> None:
    """Diagnoses that need more memory or time than they may have fail and name the setting.

    Of a campaign, and of several.
    """
    (tmp_path / "data").mkdir()
    limits = {"UNDERSKIN_DIAGNOSIS_MEMORY_MB": "100", "UNDERSKIN_DIAGNOSIS_SECONDS": "2"}
    with running(Place(tmp_path / "data"), **SEVERAL, **limits) as server:
        slow = asked(server, sent(server, long(), "finger"))
        large = resonant("large", preloads=[0.5 + 0.01 * step for step in range(100)], lines=800)
        alone = begun(server, large)
        sent(server, small())
        together = server.http.post("/v1/skins/palm/diagnosis").json()["id"]
        for diagnosis_id, setting in ((slow, "SECONDS"), (alone, "MEMORY_MB"), (together, "MEMORY_MB")):
            failed = awaited(server, diagnosis_id)
            assert (failed["state"], failed["report"]) == ("failed", None)
            assert f"(UNDERSKIN_DIAGNOSIS_{setting})" in failed["reason"]
            assert diagnosis_id != slow or failed["reason"].startswith("it takes more than 2 s on a processor (")


def test_a_campaign_that_cannot_be_diagnosed_says_why(working: Server) -> None:
    document = campaign("cylinder")
    document["skin"] = {"poisson_ratio": 0.5}
    curve = {"displacement_mm": [0.0, 0.0, 0.0], "force_n": [0.0, 0.0, 0.0]}
    document["recordings"] = [
        {"id": "c1", "kind": "compression", "sample_height_mm": 10.0, "sample_diameter_mm": 20.0, **curve}
    ]
    diagnosis = awaited(working, asked(working, sent(working, document)))
    assert (diagnosis["verdict"] == "insufficient_data") or diagnosis["reason"], diagnosis


def test_servers_that_claim_at_once_get_different_ones(server: Server) -> None:
    ids = [asked(server, sent(server, campaign(str(number), sensors=1))) for number in range(12)]
    claimed: list[str] = []
    together = threading.Barrier(4)

    def claim(name: str) -> None:
        with closing(database(server.place.database_url, server.place.folder)) as own:
            together.wait()
            mine: list[str] = []
            while len(mine) < len(ids) // 4:
                with own.writing() as connection:
                    row = diagnoses.claim(connection, name, diagnoses.Basis(table().sha256, __version__))
                mine += [] if row is None else [row.id]
            claimed.extend(mine)

    threads = [threading.Thread(target=claim, args=(f"server {number}",)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(claimed) == sorted(ids)


def test_a_silent_server_loses_what_it_was_at_and_cannot_end_it(server: Server) -> None:
    asked(server, sent(server, campaign("array")))
    store = database(server.place.database_url, server.place.folder)
    with closing(store), store.writing() as connection:
        row = diagnoses.claim(connection, "first", diagnoses.Basis("table", "1"))
        assert row is not None
        assert diagnoses.claim(connection, "second", diagnoses.Basis("table", "1")) is None
        late = table_of_diagnoses.c.alive_at - diagnoses.HEARTBEAT_TIMEOUT_S - 1
        connection.execute(table_of_diagnoses.update().values(alive_at=late))
        assert diagnoses.claim(connection, "first", diagnoses.Basis("table", "1"), [row.number]) is None
        taken = diagnoses.claim(connection, "second", diagnoses.Basis("other", "2"))
        assert taken is not None
        assert (taken.id, taken.table_sha256, taken.version) == (row.id, "other", "2")
        assert not diagnoses.keep_alive(connection, row.number, "first", 0.5)
        assert not diagnoses.finish(connection, row.number, "first", report())
        assert not diagnoses.fail(connection, row.number, "first", "no")
        assert diagnoses.keep_alive(connection, row.number, "second", 0.5)
        assert diagnoses.finish(connection, row.number, "second", report())
        assert not diagnoses.fail(connection, row.number, "second", "no")
        assert diagnoses.find(connection, row.id).state == "done"


def test_no_clock_that_is_wrong_takes_a_diagnosis_over(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that runs an hour ahead takes nothing; where the clock was set back, a killed server is told in time."""
    asked(server, sent(server, campaign("array")))
    true, alive_at = time.time(), table_of_diagnoses.c.alive_at
    store = database(server.place.database_url, server.place.folder)
    with closing(store), store.writing() as connection:
        row = diagnoses.claim(connection, "first", diagnoses.Basis("table", "1"))
        assert row is not None
        with monkeypatch.context() as ahead:
            ahead.setattr(time, "time", lambda: true + 3600)
            assert diagnoses.claim(connection, "second", diagnoses.Basis("table", "1")) is None
            assert diagnoses.keep_alive(connection, row.number, "first", 0.5)
        assert abs(diagnoses.find(connection, row.id).alive_at - true) < 60
        connection.execute(table_of_diagnoses.update().values(alive_at=alive_at + 3600))
        assert diagnoses.claim(connection, "second", diagnoses.Basis("table", "1")) is None
        assert diagnoses.keep_alive(connection, row.number, "first", 0.5), "a server that runs goes on"
        connection.execute(table_of_diagnoses.update().values(alive_at=alive_at + 3600))
        assert diagnoses.claim(connection, "second", diagnoses.Basis("table", "1")) is None
        waited_s = diagnoses.HEARTBEAT_TIMEOUT_S + 1
        connection.execute(table_of_diagnoses.update().values(alive_at=alive_at - waited_s))
        taken = diagnoses.claim(connection, "second", diagnoses.Basis("table", "1"))
        assert taken is not None
        assert taken.id == row.id
