"""The watcher in this process, with a stand-in for the service and a clock that is set by hand."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import orjson
import pytest

from tests.support.store_server import campaign
from underskin.client.service_client import Client
from underskin.client.watch.folder import WatchedFolder
from underskin.client.watch.journal import Journal
from underskin.client.watch.watcher import Watcher

SETTLE_S = 5.0


@dataclass
class Service:
    """Keeps every file, with the content at the time; `at_post` is called before, and may raise a refusal."""

    at_post: Callable[[Path], object] = lambda _: None
    kept: list[tuple[str, bytes]] = field(default_factory=list)
    posts: int = 0

    @property
    def campaigns(self) -> "Service":
        return self

    def post_files(self, files: Sequence[Path], **_: Any) -> list[dict[str, Any]]:
        (path,) = files
        self.posts += 1
        self.at_post(path)
        self.kept.append((path.name, path.read_bytes()))
        return [{"id": f"c-{self.posts}"}]


@dataclass
class Bench:
    """A watched folder, what was told, and the time."""

    folder: Path
    service: Service
    told: list[str]
    clock: list[float]
    watcher: Watcher

    def save(self, name: str) -> Path:
        file = self.folder / name
        file.write_bytes(orjson.dumps(campaign(name, sensors=1, lines=5)))
        return file

    def step(self, after_s: float = SETTLE_S) -> float:
        """A look after so many seconds."""
        self.clock[0] += after_s
        return self.watcher.step()


@contextmanager
def watched(folder: Path, service: Service, clock: list[float]) -> Iterator[Bench]:
    journal = Journal(folder)
    told: list[str] = []
    watcher = Watcher(
        cast(Client, service),
        WatchedFolder(folder, SETTLE_S),
        journal,
        url="http://bench",
        skin="palm",
        rig=None,
        estimator=None,
        kept=lambda name, _: told.append(f"{name}: kept"),
        told=lambda _, words: told.append(words),
    )
    try:
        yield Bench(folder, service, told, clock, watcher)
    finally:
        journal.close()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [1000.0]
    monkeypatch.setattr("underskin.client.watch.folder.time.monotonic", lambda: now[0])
    return now


@pytest.fixture
def at(tmp_path: Path, clock: list[float]) -> Iterator[Bench]:
    with watched(tmp_path, Service(), clock) as bench:
        yield bench


def test_what_cannot_be_looked_at_is_told_once_and_the_others_are_sent(at: Bench) -> None:
    (at.folder / "loop.csv").symlink_to(at.folder / "loop.csv")
    (at.folder / "gone.csv").symlink_to(at.folder / "nothing.csv")
    inside = os.open(at.folder, os.O_RDONLY)
    for _ in range(20):  # deeper than a path may be long, which nobody can list by its name, root neither
        os.mkdir("d" * 250, dir_fd=inside)
        inner = os.open("d" * 250, os.O_RDONLY, dir_fd=inside)
        os.close(inside)
        inside = inner
    os.close(inside)
    at.save("good.json")
    for _ in range(4):
        at.step()
    assert [name for name, _ in at.service.kept] == ["good.json"]
    assert at.told.count("loop.csv: cannot be read: Too many levels of symbolic links; it is tried again") == 1
    assert len([words for words in at.told if "File name too long" in words]) == 1
    assert len(at.told) == 3, at.told


def test_a_watched_folder_that_is_gone_is_an_outage(at: Bench) -> None:
    moved = at.folder.with_name("moved")
    at.folder.rename(moved)
    assert [at.step(), at.step()] == [1.0, 2.0]
    moved.rename(at.folder)
    at.step()
    assert len(at.told) == 2, at.told
    assert "No such file or directory" in at.told[0]
    assert at.told[1] == "sending goes on"
