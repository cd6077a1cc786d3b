"""Once a key was made the service stays closed, whatever becomes of keys.json, until `underskin key open --yes`."""

import shutil
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import httpx
import pytest

from service.store import database, key_requirement, open_store
from tests.service.waiting import until
from tests.support.store_server import Place, Server, campaign, running

BACKEND = "sqlite"
on_sqlite = pytest.mark.parametrize("place", ["sqlite"], indirect=True)  # what no database does otherwise
QUIET = {"UNDERSKIN_DIAGNOSIS_WORKERS": "0"}


STRANGER = httpx.Client(timeout=300)


def anonymous(server: Server, path: str = "/v1/skins", accept: str = "*/*") -> httpx.Response:
    return STRANGER.get(server.http.base_url.join(path), headers={"Accept": accept})


def require_status(server: Server, expected: int) -> None:
    """Wait until a request without a key is answered with this status."""
    until(lambda: anonymous(server).status_code == expected, f"never {expected}")


def require_known(server: Server, token: str) -> None:
    """Wait until a request with this key is answered."""
    headers = {"Authorization": f"Bearer {token}"}
    until(lambda: server.http.get("/v1/skins", headers=headers).status_code == 200, "the key is not known")


def make_key(place: Place, name: str = "lab") -> str:
    done = place.command("key", "create", name, "--scope", "write")
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.strip()


def assert_closed(server: Server) -> None:
    """Without keys.json."""
    for path in ("/v1/skins", "/v1/sigma?a_over_h=0.3&rt_over_h=0.6", "/metrics", "/umbridge/Info"):
        assert anonymous(server, path).status_code == 401, path
    refused = anonymous(server)
    assert "keys.json is missing from its data folder" in refused.json()["detail"]
    assert "underskin key create NAME" in refused.json()["detail"]
    post = httpx.post(server.http.base_url.join("/v1/campaigns"), json=campaign("anonymous"))
    assert post.status_code == 401
    assert anonymous(server, "/", "text/html").headers["location"] == "/login?next=/"
    assert "is missing" in anonymous(server, "/login", "text/html").text
    assert anonymous(server, "/health").status_code == anonymous(server, "/ready").status_code == 200


@on_sqlite
def test_a_running_server_stays_closed_until_a_command_opens_it(place: Place, tmp_path: Path) -> None:
    """Whatever becomes of its file meanwhile: gone, put back, damaged, or on a disk that has an error."""
    there, aside = place.folder / "keys.json", tmp_path / "aside"
    log = place.folder.parent / f"{place.folder.name}.log"
    with running(place, **QUIET) as server:
        assert anonymous(server).status_code == 200
        token = make_key(place)
        require_status(server, 401)
        there.rename(aside)
        for _ in range(10):  # the file is looked at twice a second
            assert anonymous(server).status_code == 401
            time.sleep(0.15)
        assert_closed(server)
        aside.rename(there)
        require_known(server, token)
        asked = place.command("key", "open")
        assert (asked.returncode, asked.stdout) == (2, "")
        assert "revokes all keys" in asked.stderr
        assert "--yes" in asked.stderr
        assert anonymous(server).status_code == 401
        done = place.command("key", "open", "--yes")
        assert (done.returncode, done.stderr) == (0, "")
        assert "all keys are revoked" in done.stdout
        require_status(server, 200)
        time.sleep(1.2)
        assert anonymous(server).status_code == 200
        assert not there.exists()
        make_key(place)
        require_status(server, 401)
        shutil.copy2(there, aside)
        link = tmp_path / "link"
        link.symlink_to("x" * 300)  # a name that is too long
        link.replace(there)  # in one step, as below
        until(lambda: "whether keys are needed cannot be looked up: " in log.read_text())
        aside.replace(there)  # at once, or the server may look while there is none
        there.write_text("{")
        require_status(server, 503)
        assert place.command("key", "open", "--yes").returncode == 0
        require_status(server, 200)
    assert log.read_text().count("keys.json is missing: put it back") == 1
    assert log.read_text().count("whether keys are needed cannot be looked up: ") == 1


def test_a_restart_opens_nothing(place: Place) -> None:
    """Also where the key was made before the store."""
    make_key(place)
    with running(place, **QUIET):
        pass
    (place.folder / "keys.json").unlink()
    with running(place, **QUIET) as server:
        assert_closed(server)
        token = make_key(place, "new")
        require_known(server, token)
        assert anonymous(server).status_code == 401


@on_sqlite
def test_other_machines_need_a_key_all_the_same(place: Place) -> None:
    token = make_key(place)
    with running(place, key=token, UNDERSKIN_HOSTS="skin.example.org", **QUIET) as server:
        assert place.command("key", "open", "--yes").returncode == 0
        time.sleep(1.2)
        assert anonymous(server).status_code == 401


def test_a_restore_opens_nothing_and_says_where_keys_are_needed(place: Place, tmp_path: Path) -> None:
    """Of a store that never had a key it says nothing of them; the server runs meanwhile."""
    before, kept = tmp_path / "before", tmp_path / "kept"
    with running(place, **QUIET) as server:
        assert place.command("backup", str(before)).returncode == 0
        assert "keys" not in place.command("restore", str(before)).stdout.replace(str(tmp_path), "")
        make_key(place)
        require_status(server, 401)
        (place.folder / "keys.json").unlink()
        assert "keys are needed" in place.command("restore", str(before)).stdout
        time.sleep(1.2)
        assert_closed(server)
    assert place.command("backup", str(kept)).returncode == 0
    other = Place(tmp_path / "other", place.database_url)
    done = other.command("restore", str(kept))
    assert done.returncode == 0, done.stderr
    assert f"keys are needed, and {other.folder / 'keys.json'}" in done.stdout
    assert "underskin key create NAME" in done.stdout
    with running(other, **QUIET) as server:
        assert_closed(server)
    make_key(other)
    told = other.command("restore", str(kept)).stdout
    assert f"keys are needed: those in {other.folder / 'keys.json'}" in told


def test_a_key_is_made_though_the_store_cannot_note_it(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "underskin.sqlite3").write_text("no database")
    done = Place(tmp_path / "data").command("key", "create", "lab")
    assert (done.returncode, done.stdout.startswith("us_")) == (0, True)
    assert "the key is made; the store will note it" in done.stderr


def test_servers_of_one_database_are_closed_together(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    url = request.getfixturevalue("cluster").new_database()
    first, second = Place(tmp_path / "first", url), Place(tmp_path / "second", url)
    with running(first, **QUIET) as one, running(second, **QUIET) as two:
        make_key(first)
        require_status(one, 401)
        require_status(two, 401)
        assert_closed(two)
        assert first.command("key", "open", "--yes").returncode == 0
        require_status(one, 200)
        require_status(two, 200)


def test_what_is_noted_stays_noted_from_when_it_was(place: Place) -> None:
    store = open_store(place.database_url, place.folder)
    noted = []
    for change in (key_requirement.require, key_requirement.require, key_requirement.lift, key_requirement.lift):
        with store.writing() as connection:
            change(connection)
        with store.reading() as connection:
            noted.append(key_requirement.find(connection))
        assert store.read(key_requirement.is_needed) == (change is key_requirement.require)
    store.close()
    assert noted[0] == noted[1]
    assert database(place.database_url, place.folder).is_made()


def test_commands_say_that_the_file_of_keys_is_missing(place: Place) -> None:
    never = place.command("key", "list")
    assert (never.returncode, never.stdout, never.stderr) == (0, "", "")
    with closing(open_store(place.database_url, place.folder)):
        make_key(place)
        listed = place.command("key", "list")
        assert (listed.stdout.split("\t")[:2], listed.stderr) == (["lab", "write"], "")
        (place.folder / "keys.json").unlink()
        missing = place.command("key", "list")
        assert (missing.returncode, missing.stdout) == (0, "")
        assert f"keys are needed, and {place.folder / 'keys.json'}" in missing.stderr
        assert "is missing" in missing.stderr
        assert "underskin key create NAME" in missing.stderr
        for said in (place.command("key", "open").stderr, place.command("key", "open", "--yes").stdout):
            assert f"there is no {place.folder / 'keys.json'}" in said
            assert "all keys" not in said
            assert "revokes" not in said
        lifted = place.command("key", "list")
        assert (lifted.returncode, lifted.stdout, lifted.stderr) == (0, "", "")


def test_several_that_note_it_at_once_all_do(place: Place) -> None:
    """A server and `underskin key create` do, each in a transaction of its own."""
    store = open_store(place.database_url, place.folder)
    ready = threading.Barrier(8)

    def note() -> None:
        ready.wait()
        with store.writing() as connection:
            key_requirement.require(connection)

    with ThreadPoolExecutor(8) as threads:
        outcomes = [threads.submit(note) for _ in range(8)]
    with store.reading() as connection:
        needed = key_requirement.is_needed(connection)
    store.close()
    assert [outcome.exception() for outcome in outcomes] == [None] * 8
    assert needed
