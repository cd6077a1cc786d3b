"""kill -9 of the server under a stream of batches: what was acknowledged is there, once and whole."""

import os
import random
import threading
import time
from typing import Any

import httpx

from tests.support.store_server import Place, Server, campaign, running

SOAK = os.environ.get("UNDERSKIN_SOAK") == "1"
KILLS = {"sqlite": 200 if SOAK else 10, "postgresql": 50 if SOAK else 3}
BATCH = 4
RECORDINGS = 6
SENDERS = 2


class Stream:
    """Sends batch after batch until the server is gone, and remembers what was acknowledged."""

    def __init__(self, sender: int) -> None:
        self._sender = sender
        self._count = 0
        self.acknowledged: dict[str, str] = {}  # name of a campaign, its id
        self.in_flight: list[dict[str, Any]] | None = None
        self.flowing = threading.Event()  # since this server's start, something was acknowledged
        self.key = ""

    def send(self, http: httpx.Client) -> None:
        """One after the other; returns when the server no longer answers."""
        while True:
            if self.in_flight is None:
                self._count += 1
                self.key = f"{self._sender}-{self._count}"
                names = [f"{self.key}-{number}" for number in range(BATCH)]
                self.in_flight = [campaign(name, lines=60) for name in names]
            try:
                answer = http.post("/v1/campaigns", json=self.in_flight, headers={"Idempotency-Key": self.key})
            except httpx.TransportError:
                return
            assert answer.status_code == 201, answer.text
            for document, result in zip(self.in_flight, answer.json()["campaigns"], strict=True):
                self.acknowledged[document["name"]] = result["id"]
            self.in_flight = None
            self.flowing.set()


def test_what_was_acknowledged_survives_any_kill(place: Place) -> None:
    backend = "postgresql" if place.database_url else "sqlite"
    moments = random.Random(7)
    streams = [Stream(sender) for sender in range(SENDERS)]
    for kill in range(KILLS[backend]):
        with running(place) as server:
            threads = [threading.Thread(target=stream.send, args=(server.http,)) for stream in streams]
            for thread in threads:
                thread.start()
            if kill % 4:  # mostly amid the stream, else before or as it sets in
                streams[0].flowing.wait(20)
            time.sleep(moments.uniform(0.0, 0.6))
            server.kill()
            for thread in threads:
                thread.join()
            for stream in streams:
                stream.flowing.clear()
    with running(place) as server:
        _check(server, streams, KILLS[backend])


def _check(server: Server, streams: list[Stream], kills: int) -> None:
    kept = _all_campaigns(server)
    names = [entry["name"] for entry in kept.values()]
    assert len(names) == len(set(names)), "a campaign is there twice"
    for stream in streams:
        for name, campaign_id in stream.acknowledged.items():
            assert kept[campaign_id]["name"] == name, "an acknowledged campaign is gone"
    assert len(names) >= BATCH * kills, "the stream hardly flowed"
    in_flight = {document["name"] for stream in streams for document in stream.in_flight or ()}
    acknowledged = {name for stream in streams for name in stream.acknowledged}
    assert set(names) <= acknowledged | in_flight
    for stream in streams:  # a batch that nobody acknowledged is there whole or not at all
        of_batch = {document["name"] for document in stream.in_flight or ()} & set(names)
        assert len(of_batch) in (0, BATCH)
    for campaign_id, entry in kept.items():
        sent = campaign(entry["name"], lines=60)
        sent["skin"]["d33_pc_per_n"] = None
        assert server.http.get(f"/v1/campaigns/{campaign_id}/document").json() == sent, "a campaign is not whole"


def _all_campaigns(server: Server) -> dict[str, dict[str, Any]]:
    kept: dict[str, dict[str, Any]] = {}
    cursor: dict[str, str] = {}
    while True:
        page = server.http.get("/v1/campaigns", params={"state": "all", "limit": "200", **cursor}).json()
        kept |= {entry["id"]: entry for entry in page["campaigns"]}
        if page["next"] is None:
            return kept
        cursor = {"cursor": page["next"]}
