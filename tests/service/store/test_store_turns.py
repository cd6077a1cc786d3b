"""Writers that wait for another's lock: readers are answered meanwhile, and nobody waits for ever."""

import fcntl
import io
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import httpx
import pytest
from openpyxl import Workbook
from sqlalchemy import text
from sqlalchemy.exc import OperationalError

from service.routes.columns_body import XLSX
from service.store import Database, open_store, write_turns
from tests.service.backends import BACKENDS
from tests.support.store_server import Place, Server, campaign

BACKEND = "postgresql"
WRITERS = 45


@contextmanager
def locked(place: Place) -> Iterator[None]:
    """While another process has what a restore has."""
    with closing(store_of(place)) as store, store.without_writers():
        yield


def store_of(place: Place) -> Database:
    return open_store(place.database_url, place.folder)


def test_readers_are_answered_while_writers_wait(server: Server) -> None:
    sent = server.http.post("/v1/campaigns", json=campaign("excluded")).json()
    path = f"{server.http.base_url}/v1/campaigns/{sent['id']}/exclusions"
    document = {"recording": campaign("excluded")["recordings"][0]["id"], "reason": "slipped"}

    def write() -> int:
        return httpx.post(path, json=document, timeout=300).status_code

    with ThreadPoolExecutor(WRITERS) as pool:
        with locked(server.place):
            waiting = [pool.submit(write) for _ in range(WRITERS)]
            time.sleep(1.0)
            assert not any(one.done() for one in waiting)
            for read in ("/ready", "/health", "/v1/campaigns", "/v1/skins", "/"):
                assert server.http.get(read).status_code == 200
            assert not any(one.done() for one in waiting)
        answers = [one.result() for one in waiting]
    assert {200, 201} & set(answers)
    assert max(answers) < 500


def test_files_are_read_while_uploads_wait_for_other_writers(server: Server) -> None:
    book = io.BytesIO()
    save_workbook(book)
    url = str(server.http.base_url)

    def send(number: int) -> int:
        return httpx.post(f"{url}/v1/campaigns", json=campaign(f"waiting {number}"), timeout=300).status_code

    with ThreadPoolExecutor(WRITERS) as pool:
        with locked(server.place):
            waiting = [pool.submit(send, number) for number in range(4)]
            time.sleep(1.0)
            assert not any(one.done() for one in waiting)
            answer = server.http.post("/v1/sigma", content=book.getvalue(), headers={"Content-Type": XLSX})
            assert answer.status_code == 200, answer.text
        assert [one.result() for one in waiting] == [201] * 4


def test_nothing_long_begins_while_others_wait_to_write_in_vain(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(write_turns, "WAIT_S", 0.3)
    monkeypatch.setattr("service.store.engine.WAIT_S", 0.3)
    with closing(store_of(place)) as store:
        store.require_hope()
        with locked(place), pytest.raises(OperationalError), store.writing():
            raise AssertionError("nobody else may write")
        with pytest.raises(OperationalError):
            store.require_hope()
        with store.writing() as connection:
            connection.execute(text("SELECT 1"))
        store.require_hope()
        with locked(place), pytest.raises(OperationalError), store.writing():
            raise AssertionError("nobody else may write")
        monkeypatch.setattr(write_turns, "VAIN_S", 0.0)
        store.require_hope()


def save_workbook(file: io.BytesIO) -> None:
    """Points of sigma."""
    book = Workbook()
    sheet = book.active
    assert sheet is not None
    for row in (("a_over_h", "rt_over_h"), (0.3, 0.6), (0.5, 0.6)):
        sheet.append(row)
    book.save(file)


@pytest.mark.parametrize("place", BACKENDS, indirect=True)
def test_of_many_that_wait_in_vain_each_is_told_so(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    """More than a pool has connections."""
    monkeypatch.setattr(write_turns, "WAIT_S", 0.6)
    monkeypatch.setattr("service.store.engine.WAIT_S", 0.6)
    monkeypatch.setattr("service.store.engine.CONNECTION_WAIT_S", 0.3)
    with closing(store_of(place)) as store, ThreadPoolExecutor(WRITERS) as pool:

        def write() -> None:
            with store.writing():
                raise AssertionError("nobody else may write")

        def waited_s(count: int) -> float:
            began = time.monotonic()
            errors = [one.exception() for one in [pool.submit(write) for _ in range(count)]]
            assert {type(error) for error in errors} == {OperationalError}
            return time.monotonic() - began

        with locked(place):
            assert waited_s(WRITERS) < WRITERS / 2 * waited_s(1), "they wait one after the other"


@pytest.mark.parametrize("place", BACKENDS, indirect=True)
def test_a_reader_without_a_connection_is_told_so(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.store.engine.CONNECTION_WAIT_S", 0.3)
    with closing(store_of(place)) as store, ExitStack() as stack:
        for _ in range(15):  # all that its pool may have
            stack.enter_context(store.reading())
        with pytest.raises(OperationalError):
            stack.enter_context(store.reading())


@pytest.mark.parametrize("place", BACKENDS, indirect=True)
def test_readers_that_hold_all_connections_keep_no_writer_waiting(place: Place) -> None:
    with closing(store_of(place)) as store, ExitStack() as stack:
        for _ in range(15):
            stack.enter_context(store.reading())
        with store.writing() as connection:
            assert connection.execute(text("SELECT 1")).scalar() == 1


def test_turns_are_taken_one_at_a_time(tmp_path: Path) -> None:
    turns, inside, most = write_turns.WriteTurns(), [], []

    def write() -> None:
        with turns.slot(), turns.sole(tmp_path / "lock", write_turns.WAIT_S):
            inside.append(threading.get_ident())
            most.append(len(inside))
            time.sleep(0.002)
            inside.pop()

    writers = [threading.Thread(target=write) for _ in range(20)]
    for one in writers:
        one.start()
    for one in writers:
        one.join()
    assert most == [1] * 20
    with (tmp_path / "lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # free again
