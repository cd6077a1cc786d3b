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
from underskin.client.watch import NAME, Journal, Target, WatchedFolder, Watcher
from underskin.errors import ServiceError, UnderskinError

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
        on_stored=lambda name, _: told.append(f"{name}: kept"),
        on_message=lambda _, words: told.append(words),
    )
    try:
        yield Bench(folder, service, told, clock, watcher)
    finally:
        journal.close()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [1000.0]
    monkeypatch.setattr("underskin.client.watch.time.monotonic", lambda: now[0])
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


def test_a_file_that_changes_while_another_one_is_sent_waits_until_it_is_complete(at: Bench) -> None:
    complete = at.save("slow.json").read_bytes()
    os.utime(at.folder / "slow.json", (2000, 2000))
    at.save("first.json")
    os.utime(at.folder / "first.json", (1000, 1000))  # which is sent first, as the older one

    def go_on_writing(path: Path) -> None:
        if path.name == "first.json":
            (at.folder / "slow.json").write_bytes(complete + b" ")

    at.service.at_post = go_on_writing
    at.step(0)
    at.step()
    assert [name for name, _ in at.service.kept] == ["first.json"]
    at.step()
    assert [name for name, _ in at.service.kept] == ["first.json"]
    at.step()
    assert at.service.kept[1:] == [("slow.json", complete + b" ")]
    assert at.told == ["first.json: kept", "slow.json: kept"]


def _refused(status: int, allowed: str) -> ServiceError:
    """As the service refuses a file."""
    kind = {"type": "urn:underskin:problem:invalid-input", "title": "Invalid input", "detail": allowed}
    return ServiceError(status, {**kind, "errors": [{"allowed": allowed}]})


@pytest.mark.parametrize(
    "error",
    [
        _refused(422, "reading it as HDF5 took more than 60 s and was stopped (UNDERSKIN_READING_SECONDS)"),
        _refused(422, "reading it takes more than 1000 MB of memory (UNDERSKIN_READING_MEMORY_MB)"),
        _refused(413, "The body exceeds 100 MB; send less."),
        ServiceError(400, {"title": "Bad Request", "detail": "not an answer of underskin: 'proxy'"}),
        ServiceError(422, {"title": "Unprocessable Content", "detail": "not an answer of underskin: 'filter'"}),
    ],
    ids=lambda error: str(error)[:60],
)
def test_a_refusal_that_may_pass_is_no_final_one_and_stops_no_other_file(at: Bench, error: ServiceError) -> None:
    def refuse(path: Path) -> None:
        if path.name == "large.json":
            raise error

    at.service.at_post = refuse
    at.save("large.json")
    at.save("small.json")
    at.step(0)
    at.step()
    assert [name for name, _ in at.service.kept] == ["small.json"]
    assert f"large.json: {error}; it is sent again in 60 s" in at.told
    at.step(59)
    assert at.service.posts == 2
    at.step(1)
    assert at.service.posts == 3
    assert f"large.json: {error}; it is sent again in 240 s" in at.told
    at.service.at_post = lambda _: None
    at.step(240)
    assert [name for name, _ in at.service.kept] == ["small.json", "large.json"]


def test_retries_end_and_a_restart_sends_again_what_is_not_in_the_journal(tmp_path: Path, clock: list[float]) -> None:
    def refuse(path: Path) -> None:
        if path.name == "large.json":
            raise _refused(413, "The body exceeds 100 MB; send less.")
        raise _refused(422, "must be finite and greater than 0 (N)")

    with watched(tmp_path, Service(refuse), clock) as at:
        at.save("spoilt.json")
        at.save("large.json")
        at.step(0)
        for _ in range(10):
            at.step(100_000)
        assert at.service.posts == 1 + 6
        assert len([words for words in at.told if words.startswith("spoilt.json: ")]) == 1
        assert at.told[-1].endswith("it is left, and sent again once it has changed or at the next start")
    with watched(tmp_path, Service(), clock) as again:
        again.step(0)
        again.step()
        assert [name for name, _ in again.service.kept] == ["large.json"]


def test_a_line_that_a_power_cut_left_unfinished_costs_itself_alone(tmp_path: Path) -> None:
    """The journal is read without it, and what is added next stands on a line of its own."""
    target = Target("http://bench", "palm", "terms")

    def known(*digests: str, added: str | None = None) -> list[bool]:
        journal = Journal(tmp_path)
        if added is not None:
            journal.add(target, added, "file.csv", ["c-1"])
        journal.close()
        journal = Journal(tmp_path)
        journal.close()
        return [journal.find(target, digest) is not None for digest in digests]

    assert known("a", added="a") == [True]
    first = (tmp_path / NAME).stat().st_size
    assert known("a", "b", added="b") == [True, True]
    whole = (tmp_path / NAME).read_bytes()
    for cut in range(first, len(whole)):
        (tmp_path / NAME).write_bytes(whole[:cut])
        assert known("a", "b") == [True, False]
        assert known("a", "b", "c", added="c") == [True, False, True]


@pytest.mark.parametrize("text", ["", "{", '{"schema": "watch/3"}\n', '{"schema": "watch/2"}\n{"sha256": 1}\n'])
def test_a_journal_that_cannot_be_understood_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / NAME).write_text(text)
    with pytest.raises(UnderskinError, match=r"cannot be read: .*move it away"):
        Journal(tmp_path)
