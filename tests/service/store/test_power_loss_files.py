"""Power cuts right after something was said to be done: keys, backups, restores, mechanisms, a watch's journal."""

import os
import random
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.auth.keys import KeyStore
from service.store import backup, database, migrate
from tests.service.routes.test_mechanisms import WARM
from tests.support.power.disk import Disk, powered
from tests.support.store_server import Place, campaign, running
from tests.support.streams import all_campaigns
from underskin.client.watch import Journal, Target

pytestmark = pytest.mark.slow

TARGET = Target("http://bench", "palm", "terms")
ADDS = """
import sys
from itertools import count
from pathlib import Path
from underskin.client.watch import Journal, Target
journal = Journal(Path(sys.argv[1]))
for number in count():
    journal.add(Target(*sys.argv[2:]), str(number), f"{number}.csv", ["c-1"])
    print(number, flush=True)
"""


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Disk]:
    """Of a folder with a store, `first`, that holds a campaign, and an empty folder, `watched`."""
    place = Place(tmp_path / "lab" / "first")
    place.folder.mkdir(parents=True)
    with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        server.http.post("/v1/campaigns", json=campaign("kept")).raise_for_status()
    (tmp_path / "lab" / "watched").mkdir()
    with powered(tmp_path / "lab") as made:
        yield made


def run(disk: Disk, place: Place, *arguments: str | Path) -> None:
    """A command that ends well, and a power cut right after it."""
    done = place.command(*map(str, arguments), **disk.environment)
    assert done.returncode == 0, done.stderr
    disk.cut()


def names(place: Place) -> list[str]:
    """Of the campaigns that a store has."""
    with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        return [entry["name"] for entry in all_campaigns(server).values()]


def test_a_key_of_a_new_folder_is_kept(disk: Disk) -> None:
    place = Place(disk.folder / "labs" / "new")
    run(disk, place, "key", "create", "bench")
    assert [key.name for key in KeyStore(place.folder).entries()] == ["bench"]


def test_a_backup_into_a_new_folder_is_kept(disk: Disk) -> None:
    place = Place(disk.folder / "first")
    file = disk.folder / "backups" / "today" / "store.sqlite3"
    run(disk, place, "backup", file)
    store = database("", place.folder)
    assert backup.verify(store, file) == migrate.VERSIONS[-1]
    store.close()


def test_a_restore_into_a_new_folder_is_kept(disk: Disk) -> None:
    file = disk.folder / "store.sqlite3"
    run(disk, Place(disk.folder / "first"), "backup", file)
    second = Place(disk.folder / "labs" / "second")
    run(disk, second, "restore", file)
    assert names(second) == ["kept"]


def test_a_mechanism_is_kept(disk: Disk) -> None:
    place, own = Place(disk.folder / "first"), disk.folder / "own" / "mechanisms"
    settings = {"UNDERSKIN_MECHANISMS": str(own), "UNDERSKIN_DIAGNOSIS_WORKERS": "0"}
    with running(place, **settings, **disk.environment) as server:
        server.http.post("/v1/mechanisms", content=WARM).raise_for_status()
        server.kill()
    disk.cut()
    assert [file.read_text() for file in own.glob("*.yaml")] == [WARM]


def test_what_the_journal_of_a_watched_folder_has_said_is_kept(disk: Disk) -> None:
    folder = disk.folder / "watched"
    moments = random.Random(3)
    for partly in (None, random.Random(1), random.Random(2)):
        command = [sys.executable, "-c", ADDS, str(folder), TARGET.url, TARGET.skin, TARGET.terms]
        adding = subprocess.Popen(command, env=os.environ | disk.environment, stdout=subprocess.PIPE)
        assert adding.stdout is not None
        said = [adding.stdout.readline() for _ in range(moments.randint(1, 40))]
        adding.send_signal(signal.SIGKILL)
        said += adding.stdout.readlines()
        adding.stdout.close()
        adding.wait()
        disk.cut(partly)
        journal = Journal(folder)
        assert all(journal.find(TARGET, line.decode().strip()) for line in said if line.endswith(b"\n"))
        journal.close()
