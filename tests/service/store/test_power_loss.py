"""Power cuts: of what was acknowledged nothing is lost, though the disk forgets whatever was not synced."""

import json
import random
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest

from bench.figures import Figure
from bench.soak import SOAK, record
from tests.support import postgres
from tests.support.power.disk import powered
from tests.support.store_server import Place, campaign, running
from tests.support.streams import BATCH, Stream, check_kept

# In parts, so that an interrupted soak goes on with the next one.
PARTS = 10 if SOAK else 1
CUTS = {"sqlite": 5 if SOAK else 2, "postgresql": 5 if SOAK else 1}
NO_WORKERS = {"UNDERSKIN_DIAGNOSIS_WORKERS": "0"}


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_nothing_acknowledged_is_lost_on_sqlite(tmp_path: Path, part: int) -> None:
    with powered(tmp_path) as disk:
        survive(Place(disk.folder / "data"), dict(disk.environment), disk.cut, part)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_nothing_acknowledged_is_lost_on_postgresql(tmp_path: Path, part: int) -> None:
    if not postgres.available():
        pytest.skip("PostgreSQL (Debian's package postgresql) is not installed")
    folder = tmp_path / "server"
    folder.mkdir()
    with ExitStack() as stack:
        cluster = stack.enter_context(postgres.running(synced=True))
        place = Place(folder, cluster.new_database())
        with running(place, **NO_WORKERS):
            pass  # makes the tables
        cluster.stop()
        disk = stack.enter_context(powered(cluster.data))
        stack.callback(cluster.stop)  # before its disk goes
        cluster.start(**disk.environment)

        def cut(partly: random.Random | None) -> None:
            cluster.stop()
            disk.cut(partly)
            cluster.start(**disk.environment)

        survive(place, {}, cut, part)


def survive(place: Place, environment: dict[str, str], cut: Callable[[random.Random | None], None], part: int) -> None:
    """Send campaigns, as documents and as files, and ask for diagnoses, while the power is cut again and again."""
    cuts = CUTS["postgresql" if place.database_url else "sqlite"]
    moments = random.Random(7 + part)
    streams = [Stream(sender) for sender in range(2)]
    sent: dict[str, str] = {}  # campaigns that were files, by their diagnosis
    for number in range(cuts):
        with running(place, **NO_WORKERS, **environment) as server:
            threads = [threading.Thread(target=stream.send, args=(server.http,)) for stream in streams]
            for thread in threads:
                thread.start()
            assert all(stream.flowing.wait(240) for stream in streams)
            file = {"file": (f"file-{number}.json", json.dumps(campaign(f"file-{number}", lines=60)).encode())}
            (kept,) = server.http.post("/v1/campaigns", files=file).raise_for_status().json()["campaigns"]
            asked = server.http.post(f"/v1/campaigns/{kept['id']}/diagnosis").raise_for_status().json()
            sent[asked["id"]] = kept["id"]
            streams[0].acknowledged[f"file-{number}"] = kept["id"]
            time.sleep(moments.uniform(0.0, 0.5))
            server.kill()
            for thread in threads:
                thread.join()
            for stream in streams:
                stream.flowing.clear()
        cut(moments if number % 2 else None)
    with running(place, **NO_WORKERS, **environment) as server:
        for diagnosis, campaign_id in sent.items():
            assert server.http.get(f"/v1/diagnoses/{diagnosis}").raise_for_status().json()["campaign_id"] == campaign_id
        check_kept(server, streams, BATCH * cuts)
    backend = "PostgreSQL" if place.database_url else "SQLite"
    record(Figure(f"Power cuts with nothing acknowledged lost, {backend}", cuts, "", 50))
