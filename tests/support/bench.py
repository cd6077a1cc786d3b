"""A bench: a folder with `underskin watch` on it, and a network between it and the server that can fail."""

import json
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import httpx
import orjson

from tests.support import preloaded

SETTLE_S = 0.3
JOURNAL = ".underskin-watch.json"


@dataclass
class Bench:
    """A folder, and the watch on it."""

    folder: Path
    log: Path
    url: str
    skin: str
    options: tuple[str, ...] = ()
    process: preloaded.Process | None = None

    def save(self, name: str, document: dict[str, Any]) -> Path:
        """As an instrument that writes its file at once."""
        file = self.folder / name
        file.parent.mkdir(exist_ok=True)
        file.write_bytes(orjson.dumps(document))
        return file

    def start(self, *options: str) -> preloaded.Process:
        """Start the watch."""
        words = ["watch", str(self.folder), "--skin", self.skin, "--url", self.url, "--settle-s", str(SETTLE_S)]
        with self.log.open("ab") as log:
            files = (0, log.fileno(), log.fileno())
            self.process = preloaded.start([*words, *self.options, *options], dict(os.environ), files)
        return self.process

    @property
    def told(self) -> str:
        """All that it has printed, from the first start on."""
        return self.log.read_text() if self.log.exists() else ""

    def wait_for(self, text: str, count: int = 1) -> None:
        """Until it has printed a text so many times."""
        deadline = time.monotonic() + 240  # a machine may be busy
        while self.told.count(text) < count:
            assert time.monotonic() < deadline, f"{text!r} not {count} times in\n{self.told}"
            assert self.process is None or self.process.poll() is None, self.told
            time.sleep(0.05)

    def end(self, number: signal.Signals = signal.SIGTERM) -> int:
        """End the watch; its exit status."""
        assert self.process is not None
        self.process.send_signal(number)
        return self.process.wait(240)  # ends a hang

    def journal(self) -> list[dict[str, Any]]:
        """The entries of the journal."""
        _, *entries = (self.folder / JOURNAL).read_text().splitlines()
        return [json.loads(entry) for entry in entries]


@contextmanager
def bench(tmp_path: Path, url: str, skin: str, *options: str) -> Iterator[Bench]:
    """A bench with an empty folder; its watch, where it runs, is ended."""
    folder = tmp_path / "saved"
    folder.mkdir()
    made = Bench(folder, tmp_path / "watch.log", url, skin, options)
    try:
        yield made
    finally:
        if made.process is not None:
            made.process.kill()


@dataclass
class Network:
    """Between watch and server: passes requests on, and can be cut, or cut the watch off before an answer; `status`
    is what it answers to files itself, as a server whose disk is full."""

    server: str = ""
    status: int | None = None
    kill_at_answer: list[preloaded.Process] = field(default_factory=list)
    posts: int = 0


@contextmanager
def network(through: Network) -> Iterator[str]:
    """The address of the network."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_: object) -> None:
            pass

        def _pass_on(self) -> None:
            body = self.rfile.read(int(self.headers.get("content-length", 0)))
            headers = {
                name: value for name, value in self.headers.items() if name.lower() not in ("host", "accept-encoding")
            }
            try:
                answer = httpx.request(
                    self.command, through.server + self.path, content=body, headers=headers, timeout=240
                )
            except (httpx.TransportError, httpx.UnsupportedProtocol):
                self.close_connection = True  # without an answer
                return
            if self.command == "POST":
                through.posts += 1
                if through.status is not None:
                    self.send_error(through.status, "not now")
                    return
                while through.kill_at_answer:
                    through.kill_at_answer.pop().kill()
                    self.close_connection = True
                    return
            self.send_response(answer.status_code)
            for name in ("content-type", "idempotency-replayed"):
                if name in answer.headers:
                    self.send_header(name, answer.headers[name])
            self.send_header("content-length", str(len(answer.content)))
            self.end_headers()
            self.wfile.write(answer.content)

        do_GET = do_POST = _pass_on

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as listening:
        listening.daemon_threads = True
        thread = threading.Thread(target=listening.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{listening.server_address[1]}"
        finally:
            listening.shutdown()
            thread.join()
