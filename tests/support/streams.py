"""Streams of batches to a server, and what must be kept of them whatever ends the server."""

import threading
from collections.abc import Sequence
from typing import Any

import httpx

from tests.support.store_server import Server, campaign

BATCH = 4


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


def check_kept(server: Server, streams: Sequence[Stream], least: int) -> None:
    """All that was acknowledged is there, once and whole, at least so many campaigns; a batch that nobody acknowledged
    is there whole or not at all."""
    kept = all_campaigns(server)
    names = [entry["name"] for entry in kept.values()]
    assert len(names) == len(set(names)), "a campaign is there twice"
    for stream in streams:
        for name, campaign_id in stream.acknowledged.items():
            assert kept[campaign_id]["name"] == name, "an acknowledged campaign is gone"
    assert len(names) >= least, "the stream hardly flowed"
    in_flight = {document["name"] for stream in streams for document in stream.in_flight or ()}
    acknowledged = {name for stream in streams for name in stream.acknowledged}
    assert set(names) <= acknowledged | in_flight
    for stream in streams:
        of_batch = {document["name"] for document in stream.in_flight or ()} & set(names)
        assert len(of_batch) in (0, BATCH)
    for campaign_id, entry in kept.items():
        sent = campaign(entry["name"], lines=60)
        sent["skin"]["d33_pc_per_n"] = None
        assert server.http.get(f"/v1/campaigns/{campaign_id}/document").json() == sent, "a campaign is not whole"


def all_campaigns(server: Server) -> dict[str, dict[str, Any]]:
    """Every campaign kept, by id."""
    kept: dict[str, dict[str, Any]] = {}
    cursor: dict[str, str] = {}
    while True:
        page = server.http.get("/v1/campaigns", params={"state": "all", "limit": "200", **cursor}).json()
        kept |= {entry["id"]: entry for entry in page["campaigns"]}
        if page["next"] is None:
            return kept
        cursor = {"cursor": page["next"]}
