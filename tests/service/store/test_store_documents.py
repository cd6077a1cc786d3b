"""Documents of campaigns: whole, whatever their size, and with little of them in memory."""

import io
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import orjson
import pytest

from service.store import Database, campaigns, open_store
from service.store.tables import AnyRow
from service.usecases import campaigns as usecase
from tests.service.backends import on
from tests.support.store_server import Place, Server, campaign
from underskin.recordings.campaign import parse, to_dict
from underskin.recordings.readers import hdf5_file

BACKEND = "sqlite"
RECORDINGS, SAMPLES = 60, 20_000
ONE = SAMPLES * 8 * 2  # bytes of a recording's two arrays


def large() -> dict[str, object]:
    """A campaign of long time series."""
    generator = np.random.default_rng(1)
    document = campaign("large", sensors=1)
    scalars = {name: document["recordings"][0][name] for name in ("sensor", "indenter_radius_mm", "preload_n")}
    document["recordings"] = [
        {
            **scalars,
            "id": f"r{number}",
            "dynamic_force_n": 0.1,
            "sample_rate_hz": 1000.0,
            "force_n": generator.normal(size=SAMPLES),
            "charge_pc": generator.normal(size=SAMPLES),
        }
        for number in range(RECORDINGS)
    ]
    return document


def peak(work: Callable[[], object]) -> int:
    """The most memory that `work` held at once."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def consume(store: Database, row: AnyRow) -> None:
    for _ in usecase.json_parts(store, row):
        pass


@pytest.mark.slow
@on("postgresql")
def test_a_document_takes_the_memory_of_a_few_recordings(place: Place, tmp_path: Path) -> None:
    store = open_store(place.database_url, place.folder)
    sent = parse(large())
    with store.writing() as connection:
        campaign_id, _ = campaigns.add(connection, campaigns.NewCampaign(sent, "palm"))
        row = campaigns.find(connection, campaign_id)
    assert orjson.loads(b"".join(usecase.json_parts(store, row))) == to_dict(sent)
    assert peak(lambda: consume(store, row)) < RECORDINGS / 2 * ONE
    file = tmp_path / "large.h5"
    assert peak(lambda: usecase.write_hdf5(store, row, file)) < RECORDINGS / 2 * ONE
    with file.open("rb") as stream:
        assert to_dict(parse(hdf5_file.read(stream, ""))) == to_dict(sent)
    store.close()


@pytest.mark.parametrize("count", [1, 8, 9, 17])
def test_documents_of_any_number_of_recordings_are_whole(server: Server, count: int) -> None:
    document = {**campaign("many", sensors=9, lines=3, id="palm"), "units_checked": True}
    document["recordings"] = document["recordings"][:count]
    document["recordings"][0] |= {"position_mm": [0.1, 0.2], "load_cycles": 3}
    sent = to_dict(parse(document))
    name = server.http.post("/v1/campaigns", json=document).json()["id"]
    assert server.http.get(f"/v1/campaigns/{name}/document").json() == sent
    answer = server.http.get(f"/v1/campaigns/{name}/document?format=hdf5")
    assert to_dict(parse(hdf5_file.read(io.BytesIO(answer.content), ""))) == sent
    with h5py.File(io.BytesIO(answer.content)) as file:
        assert len(file["recordings"]) == count
    deadline = time.monotonic() + 240  # the file goes once the answer is sent
    while (left := list(server.place.folder.glob("uploads/*/tmp*"))) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert left == []
