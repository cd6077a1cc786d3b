"""The journal of a watched folder: what is in it after an end of any kind."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from underskin.client.watch import NAME, Journal, Target
from underskin.errors import UnderskinError

TARGET = Target("http://bench", "palm", "terms")


@contextmanager
def opened(folder: Path) -> Iterator[Journal]:
    journal = Journal(folder)
    try:
        yield journal
    finally:
        journal.close()


def known(folder: Path, *digests: str) -> list[bool]:
    with opened(folder) as journal:
        return [journal.find(TARGET, digest) is not None for digest in digests]


def test_an_entry_is_appended_and_read_again(tmp_path: Path) -> None:
    for number in range(4):
        with opened(tmp_path) as journal:
            journal.add(TARGET, f"a{number}", os.fsdecode(b"\xfcber Nacht.csv"), ["c-1"])
            journal.add(TARGET, f"b{number}", "refused.csv", [])
        lines = (tmp_path / NAME).read_text().splitlines(keepends=True)
        assert len(lines) == 1 + 2 * (number + 1)
    assert known(tmp_path, "a0", "b0", "a3", "b3", "c0") == [True, True, True, True, False]
    with opened(tmp_path) as journal:
        entry = journal.find(TARGET, "a2")
        assert entry is not None
        assert entry.file == os.fsdecode(b"\xfcber Nacht.csv")


def test_line_power_cut_left_unfinished_ignored(tmp_path: Path) -> None:
    """A line that a power cut left unfinished is ignored."""
    with opened(tmp_path) as journal:
        for digest in ("a", "b"):
            journal.add(TARGET, digest, "file.csv", ["c-1"])
    whole = (tmp_path / NAME).read_bytes()
    for cut in range(whole.index(b"\n", 30) + 1, len(whole)):
        (tmp_path / NAME).write_bytes(whole[:cut])
        assert known(tmp_path, "a", "b") == [True, False]
        with opened(tmp_path) as journal:
            journal.add(TARGET, "c", "file.csv", ["c-2"])
        assert known(tmp_path, "a", "b", "c") == [True, False, True]


def test_journal_deleted_meanwhile_written(tmp_path: Path) -> None:
    """A journal that was deleted meanwhile is written again."""
    with opened(tmp_path) as journal:
        journal.add(TARGET, "a", "file.csv", ["c-1"])
        (tmp_path / NAME).unlink()
        journal.add(TARGET, "b", "file.csv", ["c-1"])
    assert known(tmp_path, "a", "b") == [True, True]


@pytest.mark.parametrize("text", ["", "{", '{"schema": "watch/3"}\n', '{"schema": "watch/2"}\n{"sha256": 1}\n'])
def test_journal_cannot_understood_refused(tmp_path: Path, text: str) -> None:
    """A journal that cannot be understood is refused."""
    (tmp_path / NAME).write_text(text)
    with pytest.raises(UnderskinError, match=r"cannot be read: .*move it away"):
        Journal(tmp_path)


def test_added_disk_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was added is on the disk with its name."""
    synced: list[Path] = []
    sync = os.fsync

    def noted(descriptor: int) -> None:
        synced.append(Path(f"/proc/self/fd/{descriptor}").readlink())
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", noted)
    with opened(tmp_path) as journal:
        journal.add(TARGET, "a", "file.csv", ["c-1"])
        assert synced == [tmp_path / f"{NAME}.part", tmp_path]
        journal.add(TARGET, "b", "file.csv", ["c-1"])
        assert synced[2:] == [tmp_path / NAME]
