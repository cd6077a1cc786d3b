"""Two servers on one PostgreSQL: one is killed, nothing is lost, and the other takes over what it was diagnosing."""

import threading
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.service.waiting import until
from tests.support.diagnosed import awaited, begun, found, small, small_report
from tests.support.lean_reports import BESIDE_SKINS
from tests.support.postgres import Cluster
from tests.support.store_server import Place, running
from tests.support.streams import BATCH, Stream, check_kept

_ONE = {"UNDERSKIN_DIAGNOSIS_WORKERS": "1"}
_NONE = {"UNDERSKIN_DIAGNOSIS_WORKERS": "0"}


@pytest.fixture
def places(cluster: Cluster, tmp_path: Path) -> list[Place]:
    """Of two servers, each with a folder of its own, on one database."""
    url = cluster.new_database()
    folders = [tmp_path / name for name in ("first", "second")]
    for folder in folders:
        folder.mkdir()
    return [Place(folder, url) for folder in folders]


def test_what_either_acknowledged_is_kept_when_one_is_killed(places: list[Place]) -> None:
    streams = [Stream(number) for number in range(2)]
    with ExitStack() as stack:
        servers = [stack.enter_context(running(place, **_NONE)) for place in places]
        threads = [
            threading.Thread(target=stream.send, args=(server.http,))
            for stream, server in zip(streams, servers, strict=True)
        ]
        for thread in threads:
            thread.start()
        until(lambda: min(len(stream.acknowledged) for stream in streams) >= 2 * BATCH, "no server answers")
        servers[0].kill()
        threads[0].join()
        before = len(streams[1].acknowledged)
        until(lambda: len(streams[1].acknowledged) > before, "the other server no longer answers")
        servers[1].kill()
        threads[1].join()
    with running(places[1], **_NONE) as server:
        check_kept(server, streams, 4 * BATCH)


@pytest.mark.soak
def test_a_diagnosis_of_a_killed_server_is_taken_over(places: list[Place]) -> None:
    with running(places[0], **_ONE) as first:
        diagnosis_id = begun(first, small(), without=BESIDE_SKINS)
        awaited(first, diagnosis_id, "running")
        first.kill()
    with running(places[1], **_ONE) as second:
        assert found(second, diagnosis_id)["state"] == "running"
        done = awaited(second, diagnosis_id)
        assert (done["state"], done["report"]) == ("done", small_report(BESIDE_SKINS))
