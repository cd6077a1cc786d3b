"""What old stores hold, and what is asked of them: by the server that made them, and by that of today."""

import json
import lzma
import subprocess
import time
from pathlib import Path
from typing import Any

import httpx

from tests.support.diagnosed import resonant
from tests.support.store_server import Place, campaign

FOLDER = Path(__file__).parent

LANDED = {
    "0001": "c20fd198",
    "0002": "07dfb07e",
    "0003": "550870a8",
    "0004": "c046cd63",
    "0005": "6bfaad12",
    "0006": "f1d91014",
    "0007": "0546589a",
    "0008": "64fd93ec",
    "0009": "93342cce",
    "0010": "c01b6c7f",
    "0011": "7dad4974",
    "0012": "25818550",
    "0013": "286d4cef",
}
"""The first commit on the main branch whose server runs and fills a store of each version of the schema."""

WITH_THE_NEXT = ("0014", "0015")  # versions that the one after them followed within the hour: no lab had them alone

DIAGNOSES_SINCE = "0003"
FIRST, SECOND = "palm", "finger"  # skins


def fill(client: httpx.Client, version: str) -> None:
    """A diagnosed skin with a model adopted, where the version has them; a campaign withdrawn, a recording excluded."""
    explained = _sent(client, FIRST, resonant("explained"))
    gone = _sent(client, SECOND, campaign("gone"))
    stays = _sent(client, SECOND, campaign("stays"))
    _post(client, f"/v1/campaigns/{gone}/withdraw", {"reason": "wrong sphere"})
    _post(client, f"/v1/campaigns/{stays}/exclusions", {"recording": "s0-1N", "reason": "loose cable"})
    if version >= DIAGNOSES_SINCE:
        diagnosis = _post(client, f"/v1/campaigns/{explained}/diagnosis", None)["id"]
        _await_end(client, f"/v1/diagnoses/{diagnosis}")
        _post(client, f"/v1/skins/{FIRST}/model", {"diagnosis_id": diagnosis})


def asked_of(client: httpx.Client) -> list[str]:
    """Paths of all that a store keeps, with the identifiers that it has."""
    campaigns = client.get("/v1/campaigns?state=all").raise_for_status().json()["campaigns"]
    diagnoses = client.get("/v1/diagnoses")
    found = diagnoses.json()["diagnoses"] if diagnoses.status_code == 200 else []
    return [
        "/v1/campaigns?state=all",
        *(f"/v1/campaigns/{entry['id']}/{part}" for entry in campaigns for part in ("document", "d33")),
        *(f"/v1/skins/{skin}/history" for skin in (FIRST, SECOND)),
        *(f"/v1/diagnoses/{entry['id']}" for entry in found),
        *([f"/v1/skins/{FIRST}/model"] if found else []),
    ]


def take_over(place: Place, version: str) -> None:
    """Put an old store into an empty place."""
    if place.database_url:
        command = ["psql", "--dbname", place.database_url, "--quiet", "--no-psqlrc", "--set=ON_ERROR_STOP=1"]
        subprocess.run(command, input=_packed(_name(place, version)), check=True, capture_output=True)
    else:
        (place.folder / "underskin.sqlite3").write_bytes(_packed(_name(place, version)))


def answers(place: Place, version: str) -> dict[str, Any]:
    """What the old server answered over it, by path."""
    return dict(json.loads(_packed(f"{_name(place, version)}.answers")))


def _name(place: Place, version: str) -> str:
    return f"{version}.{'sql' if place.database_url else 'sqlite3'}"


def _packed(name: str) -> bytes:
    """The content of a file beside this one, by its name without `.xz`."""
    return lzma.decompress((FOLDER / f"{name}.xz").read_bytes())


def _sent(client: httpx.Client, skin: str, document: dict[str, Any]) -> str:
    return str(_post(client, f"/v1/campaigns?skin={skin}", document)["id"])


def _post(client: httpx.Client, path: str, body: Any) -> dict[str, Any]:
    answer = client.post(path) if body is None else client.post(path, json=body)
    assert answer.is_success, (path, answer.text)
    return dict(answer.json())


def _await_end(client: httpx.Client, path: str) -> None:
    deadline = time.monotonic() + 1500
    while (state := client.get(path).raise_for_status().json()["state"]) in ("queued", "running"):
        assert time.monotonic() < deadline, state
        time.sleep(0.2)
    assert state == "done", state
