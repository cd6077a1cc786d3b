"""Diagnoses of several campaigns in exports and backups: elsewhere as they were here, and spoilt ones refused."""

import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import orjson
import pytest

from tests.support.cases import first
from tests.support.diagnosed import finished, sent
from tests.support.store_server import Server, campaign
from underskin import Client
from underskin.client.documents import Diagnosis

BACKEND = "sqlite"
Rows = list[dict[str, Any]]


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with Client(str(server.http.base_url)) as opened:
        yield opened


def diagnosed_together(server: Server, client: Client) -> tuple[list[str], str]:
    """Ids of diagnoses of the skin `palm`, of all, of two and of one of its campaigns, and of one of a fleet."""
    ids = [
        sent(server, campaign(name, sensors=1), skin) for name, skin in (("a", "palm"), ("b", "palm-b"), ("c", "palm"))
    ]
    for skin in ("finger", "thumb"):
        sent(server, campaign(skin, sensors=1), skin)
    client.skins.join("palm", "palm-b", "one skin, two labels")
    client.campaigns.exclude(ids[0], "s0-1N", "cable loose")
    own = [
        client.skins.diagnose("palm", without=["adhesion"]),
        client.skins.diagnose("palm", ids[:2], "two"),
        client.diagnoses.start(ids[2]),
    ]
    fleet = client.fleets.diagnose(["palm", "finger", "thumb"], "batch 7")
    finished(server)
    return [one["id"] for one in own], fleet["id"]


def told(client: Client, ids: list[str]) -> list[Diagnosis]:
    return [client.diagnoses.get(diagnosis_id) for diagnosis_id in ids]


def test_they_are_elsewhere_as_they_were_here(
    server: Server, elsewhere: Server, client: Client, tmp_path: Path
) -> None:
    own, fleet = diagnosed_together(server, client)
    file = tmp_path / "palm.h5"
    client.skins.export("palm", file)
    with Client(str(elsewhere.http.base_url)) as there:
        for kept, present in ((3, 0), (0, 3)):
            answer = there.skins.load(file)
            assert (answer["kept"], answer["present"]) == (kept, present)
        assert told(there, own) == told(client, own)
        listed = [entry["id"] for entry in there.diagnoses.all()]
        assert (sorted(listed), fleet in listed) == (sorted(own), False)
        # The same request elsewhere is answered with the diagnosis that came.
        assert there.skins.diagnose("palm", without=["adhesion"]) == {"id": own[0], "state": "done"}
        added = sent(elsewhere, campaign("new", sensors=1), "palm")
        assert there.diagnoses.get(own[0])["outdated"] == f"campaign {added} was added"
        assert there.diagnoses.get(own[1])["outdated"] is None


def changed(**values: Any) -> Callable[[Rows], None]:
    def spoil(rows: Rows) -> None:
        rows[0].update(values)

    return spoil


def of_one_member(rows: Rows) -> None:
    rows[0]["members"] = rows[0]["members"][:1]


def of_a_foreign_campaign(rows: Rows) -> None:
    rows[0]["members"][0]["campaign_id"] = "c-0000000000000000"


def of_a_foreign_skin(rows: Rows) -> None:
    rows[0]["members"][0]["skin_id"] = "finger"


def without_its_latest(rows: Rows) -> None:
    rows[0]["campaign_id"] = rows[1]["members"][0]["campaign_id"]
    rows[0]["members"] = [one for one in rows[0]["members"] if one["campaign_id"] != rows[0]["campaign_id"]]


SPOILT = (
    changed(kind="campaign"),
    changed(name=None),
    changed(all_of=["finger"]),
    of_one_member,
    of_a_foreign_campaign,
    of_a_foreign_skin,
    without_its_latest,
    changed(kind="herd"),
    changed(members=[]),
    changed(members=None),
)


def test_spoilt_ones_are_refused(server: Server, elsewhere: Server, client: Client, tmp_path: Path) -> None:
    diagnosed_together(server, client)
    file = tmp_path / "palm.h5"
    client.skins.export("palm", file)
    for number, spoil in enumerate(first(6, SPOILT)):
        content = io.BytesIO(file.read_bytes())
        with h5py.File(content, "r+") as opened:
            rows = orjson.loads(opened["diagnoses"][()].tobytes())
            spoil(rows)
            del opened["diagnoses"]
            opened["diagnoses"] = np.frombuffer(orjson.dumps(rows), np.uint8)
        headers = {"Content-Type": "application/octet-stream"}
        answer = elsewhere.http.post("/v1/skins/import", content=content.getvalue(), headers=headers)
        assert answer.status_code == 422, f"{number}: {answer.text}"
        assert elsewhere.http.get("/v1/diagnoses").json()["diagnoses"] == []
