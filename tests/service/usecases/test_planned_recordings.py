"""Planned recordings: each one's rig description reads its file, and what arrives is ticked off once."""

from collections.abc import Iterator
from typing import Any

import orjson
import pytest
import yaml

from service.store import Database, campaigns, database, diagnoses, skins
from service.usecases import planned_recordings
from tests.support.diagnosed import diagnosed, report, resonant
from tests.support.store_server import Place, Server, running

_FORCE = {"dynamic_force_n": 0.05}
PLANNED: list[dict[str, Any]] = [
    {"sensor": "s1", "indenter_radius_mm": 4.0, "preload_n": 1.5, **_FORCE, "position_mm": [], "repeats": 2},
    {"sensor": "s2", "indenter_radius_mm": 8.0, "preload_n": 3.0, **_FORCE, "position_mm": [9.0, 0.0], "repeats": 1},
]
LINES = "frequency_hz,frf_re_pc_per_n,frf_im_pc_per_n\n10,7,0\n20,7,0\n40,7.{},0\n"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Server, Database, str, str]]:
    """A server, its store, and the ids of a campaign and of its diagnosis."""
    place = Place(tmp_path_factory.mktemp("planned"))
    with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        ids = diagnosed(server, resonant("measured"), report())
        store = database("", place.folder)
        yield server, store, *ids
        store.close()


def arrived(store: Database, diagnosis_id: str) -> list[int]:
    with store.reading() as connection:
        return planned_recordings.arrived(connection, diagnoses.find(connection, diagnosis_id), PLANNED)


def sent(server: Server, rig: dict[str, Any], number: int) -> str:
    files = {
        "file": (f"planned-{number}.csv", LINES.format(number).encode()),
        "rig": ("rig.yaml", yaml.safe_dump(rig).encode()),
    }
    answer = server.http.post("/v1/campaigns?skin=palm", files=files)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["campaigns"][0]["id"])


def test_rows_are_ticked_off_as_their_recordings_arrive(lab: tuple[Server, Database, str, str]) -> None:
    server, store, campaign_id, diagnosis_id = lab
    assert arrived(store, diagnosis_id) == [0, 0]  # those that were diagnosed do not count
    with store.reading() as connection:
        row = campaigns.find(connection, campaign_id)
        rigs = [planned_recordings.rig_description(connection, row, entry) for entry in PLANNED]
    assert rigs[1]["recording"]["position_mm"] == [9.0, 0.0]
    first = sent(server, rigs[0], 1)
    assert arrived(store, diagnosis_id) == [1, 0]
    near = {**rigs[0], "recording": {**rigs[0]["recording"], "preload_n": 1.53}}
    sent(server, near, 2)
    assert arrived(store, diagnosis_id) == [2, 0]
    sent(server, near, 3)  # more than was planned
    far = {**rigs[1], "recording": {**rigs[1]["recording"], "position_mm": [8.0, 0.0]}}
    sent(server, far, 4)
    del far["recording"]["position_mm"]  # on the sensor, which lies at 8 mm
    sent(server, far, 6)
    assert arrived(store, diagnosis_id) == [2, 0]
    sent(server, rigs[1], 5)
    assert arrived(store, diagnosis_id) == [2, 1]
    server.http.post(f"/v1/campaigns/{first}/withdraw", json={"reason": "loose"}).raise_for_status()
    assert arrived(store, diagnosis_id) == [2, 1]  # the third takes its place
    kept = orjson.loads(server.http.get(f"/v1/campaigns/{first}/document").content)
    assert kept["recordings"][0]["preload_n"] == 1.5


def test_a_rig_of_curves_does_not_tell_how_frfs_are_read(lab: tuple[Server, Database, str, str]) -> None:
    server, store, campaign_id, _ = lab
    of_curves = {
        "schema": "rig/1",
        "kind": "indentation",
        "recording": {"indenter_radius_mm": 2.0},
        "channels": {name: {"channel": name} for name in ("displacement_mm", "force_n")},
        "curves": {"baseline": "off"},
    }
    with store.writing() as connection:
        row = campaigns.find(connection, campaign_id)
        skins.keep_rig(connection, row.skin_id, orjson.dumps(of_curves).decode())
        rig = planned_recordings.rig_description(connection, row, PLANNED[0])
    assert rig["kind"] == "frf"
    sent(server, rig, 7)
