"""Sessions of browsers: listed for their key, ended one by one, on the page, by a logout and by the command line."""

import sqlite3
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from hashlib import sha256
from pathlib import Path

import httpx
import pytest

from service.auth.keys import Key, KeyStore
from service.auth.session import COOKIE, logged_in
from service.auth.sessions import Sessions
from service.store import database, open_store
from service.store import sessions as noted
from service.store.engine import SQLITE_FILE
from service.store.tables import sessions as session_rows
from tests.service.pages.forms import BROWSING, token_of
from tests.service.waiting import until
from tests.support.store_server import Place, Server, running

LOGIN_FIRST = 303  # a page sends who is not logged in to the login

Browser = Callable[..., httpx.Client]


@pytest.fixture(scope="module")
def started(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Server, dict[str, str]]]:
    """A server with two keys."""
    place = Place(tmp_path_factory.mktemp("sessions") / "data")
    keys = {name: KeyStore(place.folder).create(name, "write") for name in ("mara", "otto")}
    with running(place, key=keys["mara"], UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        yield server, keys


@pytest.fixture
def keyed(started: tuple[Server, dict[str, str]]) -> tuple[Server, dict[str, str]]:
    """The same, without a session."""
    with closing(database("", started[0].place.folder)) as store, store.writing() as connection:
        connection.execute(session_rows.delete())
    return started


@pytest.fixture
def log_in(keyed: tuple[Server, dict[str, str]]) -> Iterator[Browser]:
    """A browser of some name in which the key of a name was typed, at that server or another."""
    server, keys = keyed
    with ExitStack() as stack:

        def logged_in(name: str, browser: str, at: Server = server) -> httpx.Client:
            headers = {**BROWSING, "User-Agent": browser, "Origin": str(at.http.base_url).rstrip("/")}
            client = stack.enter_context(httpx.Client(base_url=at.http.base_url, headers=headers, timeout=300))
            form = {"form_token": token_of(client.get("/login").text), "key": keys[name]}
            assert client.post("/login", data=form).status_code == 303
            assert client.get("/").status_code == 200
            return client

        yield logged_in


def listed(place: Place) -> dict[str, list[str]]:
    """What the command line lists, by the browser's name: id, key, start, end, address."""
    rows = [line.split("\t") for line in place.command("key", "sessions").stdout.splitlines()]
    return {row[5]: row[:5] for row in rows}


def post(browser: httpx.Client, path: str) -> int:
    """The status of a form of the page of sessions."""
    return browser.post(path, data={"form_token": token_of(browser.get("/sessions").text)}).status_code


def test_session_listed_ended_key(keyed: tuple[Server, dict[str, str]], log_in: Browser) -> None:
    """A session is listed and ended by another of its key."""
    server, _ = keyed
    lost, own, other = log_in("mara", "the lost one"), log_in("mara", "at home"), log_in("otto", "otto's")
    rows = listed(server.place)
    assert {name: (row[1], row[4]) for name, row in rows.items()} == {
        "the lost one": ("mara", "127.0.0.1"),
        "at home": ("mara", "127.0.0.1"),
        "otto's": ("otto", "127.0.0.1"),
    }
    page = own.get("/sessions").text
    assert ("the lost one" in page, "at home" in page, "otto" in page) == (True, True, False)
    end = f"/sessions/{rows['the lost one'][0]}/end"
    assert post(other, end) == 404  # not of its key
    assert own.post(end, data={"form_token": token_of(other.get("/sessions").text)}).status_code == 403
    assert lost.get("/").status_code == 200
    assert post(own, end) == 303
    assert lost.get("/").status_code == LOGIN_FIRST  # at once on the server that was asked
    assert post(own, end) == 404
    assert (own.get("/").status_code, other.get("/").status_code) == (200, 200)
    assert set(listed(server.place)) == {"at home", "otto's"}


def test_a_logout_ends_copies_of_the_cookie_too(keyed: tuple[Server, dict[str, str]], log_in: Browser) -> None:
    server, _ = keyed
    browser = log_in("mara", "at home")
    stolen = {**BROWSING, "Cookie": f"{COOKIE}={browser.cookies[COOKIE]}"}
    address = str(server.http.base_url)
    assert httpx.get(address, headers=stolen).status_code == 200
    assert post(browser, "/logout") == 303
    assert httpx.get(address, headers=stolen).status_code == LOGIN_FIRST
    assert listed(server.place) == {}


def test_command_line_ends_session_every_server(keyed: tuple[Server, dict[str, str]], log_in: Browser) -> None:
    """The command line ends a session on every server also after a restart."""
    server, keys = keyed
    place = server.place
    lost, kept = log_in("mara", "the lost one"), log_in("mara", "at home")
    session_id = listed(place)["the lost one"][0]
    ended = place.command("key", "end-session", session_id)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "", "")
    until(lambda: lost.get("/").status_code == LOGIN_FIRST, "the session goes on")
    assert kept.get("/").status_code == 200
    with running(place, key=keys["mara"], UNDERSKIN_DIAGNOSIS_WORKERS="0") as second:
        cookies = {name: f"{COOKIE}={one.cookies[COOKIE]}" for name, one in (("lost", lost), ("kept", kept))}
        found = {
            name: httpx.get(str(second.http.base_url), headers={**BROWSING, "Cookie": cookie}).status_code
            for name, cookie in cookies.items()
        }
    assert found == {"lost": LOGIN_FIRST, "kept": 200}
    again = place.command("key", "end-session", session_id)
    assert (again.returncode, again.stderr) == (2, f"underskin: There is no open session '{session_id}'.\n")


def test_a_made_up_cookie_logs_nobody_in(keyed: tuple[Server, dict[str, str]]) -> None:
    """Times that are no numbers or have thousands of digits, signatures beyond ASCII, and what is no cookie of ours."""
    address = str(keyed[0].http.base_url).rstrip("/")
    for made_up in (f"a.b.{'9' * 5000}.c", "a.b.²³.c", "a..9999999999.é", "a.b.9999999999.", "...", "é", ""):
        cookie = {b"Cookie": f"{COOKIE}={made_up}".encode("latin-1")}
        for path, status in (("/v1/skins", 401), ("/login", 200)):
            assert httpx.get(f"{address}{path}", headers=cookie).status_code == status, made_up[:20]


def test_the_cookie_is_kept_nowhere(keyed: tuple[Server, dict[str, str]], log_in: Browser) -> None:
    server, _ = keyed
    cookie = log_in("mara", "at home").cookies[COOKIE]
    log = server.place.folder.parent / f"{server.place.folder.name}.log"
    until(lambda: "/login" in log.read_text())
    written = [path.read_bytes() for path in server.place.folder.parent.rglob("*") if path.is_file()]
    assert not any(part.encode() in text for text in written for part in (cookie, cookie.split(".")[0]))


def test_a_logout_during_a_look_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The store has no row of this session, so that this process alone knows that it was ended."""
    key = Key("mara", "write", "2026-01-01T00:00:00Z", 64 * "a")
    sessions, cookie = Sessions(open_store("", tmp_path)), logged_in(key)
    looking, logged_out = threading.Event(), threading.Event()

    def slowly(_: object) -> frozenset[str]:
        looking.set()
        assert logged_out.wait(240)
        return frozenset({"another"})

    monkeypatch.setattr(noted, "ended", slowly)
    look = threading.Thread(target=sessions.look)
    look.start()
    assert looking.wait(240)
    sessions.log_out(cookie, key)
    logged_out.set()
    look.join(240)
    assert sessions.has_ended(cookie)


def test_log_tells_nothing_key_store_fails(keyed: tuple[Server, dict[str, str]], log_in: Browser) -> None:
    """The log tells nothing of a key where the store fails.

    Whoever has a key's digest can sign cookies. The last test here, since the store is spoilt then.
    """
    server, keys = keyed
    browser = log_in("mara", "at home")
    token = token_of(browser.get("/sessions").text)
    with closing(sqlite3.connect(server.place.folder / SQLITE_FILE)) as store, store:
        store.execute("DROP TABLE sessions")
    assert browser.get("/sessions").status_code == 503
    assert browser.post("/logout", data={"form_token": token}).status_code == 303
    log = server.place.folder.parent / f"{server.place.folder.name}.log"
    until(lambda: "no such table" in log.read_text())
    assert sha256(keys["mara"].encode()).hexdigest() not in log.read_text()
