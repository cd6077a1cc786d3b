"""Who may call: known hosts, own pages, holders of a key."""

import json
import os
import subprocess
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import httpx
import pytest

from service.auth.keys import KeyStore, KeysUnreadable
from service.auth.session import COOKIE, logged_in
from tests.service.connections import BODIES
from tests.service.requests import SIGMA, all_routes, problem_of
from tests.service.waiting import until
from tests.support import preloaded
from tests.support.server import Server, running
from tests.support.store_server import campaign
from underskin import InvalidInput

OPEN = {"/health", "/ready"}
ONE_SIGMA = "/v1/sigma?a_over_h=0.3&rt_over_h=0.6"
FOREIGN = ["http://evil.example", "https://evil.example:8000", "null", "http://127.0.0.1:1", "file://"]


def command(folder: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """`underskin` on the data of the server in `folder`."""
    settings = {**os.environ, "UNDERSKIN_DATA": str(folder / "data"), **environment}
    return preloaded.run(*arguments, environment=settings)


def keys_in(folder: Path) -> KeyStore:
    """What `underskin key` works on."""
    return KeyStore(folder / "data")


def refusal(folder: Path, *arguments: str, **environment: str) -> str:
    """The one line with which a command ends."""
    ended = command(folder, *arguments, **environment)
    assert (ended.returncode, ended.stdout) == (2, "")
    (line,) = ended.stderr.splitlines()
    assert line.startswith("underskin: ")
    return line


def bearer(token: str) -> dict[str, str]:
    """The header that carries a key."""
    return {"Authorization": f"Bearer {token}"}


def require_status(url: str, headers: Mapping[str, str], expected: int) -> None:
    """Wait until a request is answered with this status: a server looks at its keys twice a second."""
    until(lambda: httpx.get(url + ONE_SIGMA, headers=headers).status_code == expected, f"never {expected}")


@dataclass(frozen=True)
class Keyed:
    """A server with keys, in front of which a proxy is said to stand."""

    server: Server
    folder: Path
    tokens: dict[str, str]


@pytest.fixture(scope="module")
def keyed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Keyed]:
    """One for all tests that leave its two keys as they are."""
    folder = tmp_path_factory.mktemp("keyed")
    tokens = {"lab": keys_in(folder).create("lab", "read"), "robot": keys_in(folder).create("robot", "write")}
    with running(folder, {"UNDERSKIN_HOSTS": "skin.example.org, Other.Example.org"}) as started:
        yield Keyed(started, folder, tokens)


@pytest.fixture
def locked(keyed: Keyed) -> Iterator[httpx.Client]:
    """A client of it without a key."""
    with httpx.Client(base_url=keyed.server.url, timeout=300) as client:
        yield client


# Host and Origin


@pytest.mark.parametrize("path", ["/health", ONE_SIGMA, "/umbridge/Info", "/nothing"])
@pytest.mark.parametrize("host", ["evil.example", "evil.example:8000", "localhost.evil.example", "127.0.0.2", ""])
def test_an_unknown_host_is_refused(http: httpx.Client, host: str, path: str) -> None:
    problem_of(http.get(path, headers={"Host": host}), 421)


@pytest.mark.parametrize("host", ["localhost", "LocalHost:8000", "127.0.0.1", "127.0.0.1:1", "[::1]", "[::1]:8000"])
def test_every_name_of_the_loopback_is_known(http: httpx.Client, host: str) -> None:
    assert http.get(ONE_SIGMA, headers={"Host": host}).status_code == 200


@pytest.mark.parametrize("host", ["skin.example.org", "SKIN.example.org:443", "other.example.org", "localhost"])
def test_names_in_the_setting_are_known(keyed: Keyed, locked: httpx.Client, host: str) -> None:
    headers = {"Host": host, **bearer(keyed.tokens["lab"])}
    assert locked.get(ONE_SIGMA, headers=headers).status_code == 200


@pytest.mark.parametrize("origin", FOREIGN)
@pytest.mark.parametrize("path", BODIES)
def test_a_page_of_another_origin_cannot_post(http: httpx.Client, path: str, origin: str) -> None:
    problem_of(http.post(path, json=BODIES[path], headers={"Origin": origin}), 403)


@pytest.mark.parametrize("method", ["PUT", "PATCH", "DELETE"])
def test_other_methods_that_change_something_are_refused_as_well(http: httpx.Client, method: str) -> None:
    problem_of(http.request(method, "/v1/sigma", headers={"Origin": FOREIGN[0]}), 403)


@pytest.mark.parametrize("origin", FOREIGN)
def test_get_does_not_ask_for_the_origin(http: httpx.Client, origin: str) -> None:
    answer = http.get(ONE_SIGMA, headers={"Origin": origin})
    assert answer.status_code == 200
    assert "access-control-allow-origin" not in answer.headers  # so that the page cannot read it


def test_own_pages_may_post(http: httpx.Client) -> None:
    own = str(http.base_url).rstrip("/")
    assert http.post("/v1/sigma", json=SIGMA, headers={"Origin": own}).status_code == 200
    named = {"Host": "localhost:8000", "Origin": "http://LOCALHOST:8000"}
    assert http.post("/v1/sigma", json=SIGMA, headers=named).status_code == 200


def test_no_page_is_told_that_it_may_call(http: httpx.Client) -> None:
    asked = {"Origin": FOREIGN[0], "Access-Control-Request-Method": "POST"}
    answer = http.options("/v1/sigma", headers=asked)
    problem_of(answer, 405)
    assert not any(name.startswith("access-control") for name in answer.headers)


# Keys


def test_every_route_but_health_needs_a_key(keyed: Keyed, locked: httpx.Client) -> None:
    with httpx.Client(base_url=keyed.server.url, headers=bearer(keyed.tokens["lab"]), timeout=300) as holder:
        routes = all_routes(holder)
        document = holder.get("/openapi.json").json()
    assert document["security"] == [{"key": []}]
    assert {path for _, path in routes} >= OPEN | set(BODIES)
    for method, path in [*routes, ("GET", "/nothing"), ("PUT", "/v1/sigma")]:
        answer = locked.request(method, path, json=BODIES.get(path, {}))
        if path in OPEN:
            assert answer.status_code == 200
            assert document["paths"][path][method.lower()]["security"] == []
        else:
            problem_of(answer, 401)
            assert answer.headers["www-authenticate"] == "Bearer"


def test_a_change_needs_a_key_of_scope_write(keyed: Keyed, locked: httpx.Client) -> None:
    """By every route that changes what is kept, and who has sent a campaign is told."""
    computed = {*BODIES, "/v1/stress", "/v1/design"}
    changes = [
        (method, path)
        for method, path in all_routes(locked, bearer(keyed.tokens["lab"]))
        if method != "GET" and path not in computed and not path.startswith("/umbridge/")
    ]
    assert len(changes) > 15
    for method, path in changes:
        problem_of(locked.request(method, path, json={}, headers=bearer(keyed.tokens["lab"])), 403)
        assert locked.request(method, path, json={}, headers=bearer(keyed.tokens["robot"])).status_code in (404, 422)
    sent = locked.post("/v1/campaigns", json=campaign("sent"), headers=bearer(keyed.tokens["robot"])).raise_for_status()
    kept = locked.get(f"/v1/campaigns/{sent.json()['id']}", headers=bearer(keyed.tokens["lab"]))
    assert kept.json()["received_from"] == "robot"


@pytest.mark.parametrize("name", ["lab", "robot"])
def test_a_key_of_either_scope_may_compute(keyed: Keyed, locked: httpx.Client, name: str) -> None:
    headers = bearer(keyed.tokens[name])
    for path, body in BODIES.items():
        assert locked.post(path, json=body, headers=headers).status_code == 200, path
    for path in (ONE_SIGMA, "/v1/tables", "/umbridge/Info", "/metrics", "/openapi.json"):
        assert locked.get(path, headers=headers).status_code == 200, path


@pytest.mark.parametrize(
    "spoiled", ["{}", "Basic {}", "Bearer", "Bearer {}x", "Bearer x{}", "Bearer {} {}", "Bearer us_", "é"]
)
def test_what_is_not_a_key_is_refused(keyed: Keyed, locked: httpx.Client, spoiled: str) -> None:
    sent = spoiled.replace("{}", keyed.tokens["lab"])
    problem_of(locked.get(ONE_SIGMA, headers=[(b"Authorization", sent.encode("latin-1"))]), 401)


def test_neither_the_name_nor_the_hash_of_a_key_is_a_key(keyed: Keyed, locked: httpx.Client) -> None:
    for sent in [part for entry in keys_in(keyed.folder).entries() for part in (entry.name, entry.sha256)]:
        problem_of(locked.get(ONE_SIGMA, headers=bearer(sent)), 401)


def test_tokens_are_kept_nowhere(keyed: Keyed, locked: httpx.Client) -> None:
    for token in keyed.tokens.values():
        assert locked.get(ONE_SIGMA, headers=bearer(token)).status_code == 200
        locked.get(ONE_SIGMA, headers=bearer(f"{token}x"))
    kept = keyed.folder / "data" / "keys.json"
    assert kept.stat().st_mode & 0o777 == 0o600
    assert sha256(keyed.tokens["lab"].encode()).hexdigest() in kept.read_text()
    listed = command(keyed.folder, "key", "list").stdout
    assert [line.split("\t")[:2] for line in listed.splitlines()] == [["lab", "read"], ["robot", "write"]]
    until(lambda: "/v1/sigma" in keyed.server.log.read_text())
    written = [path.read_bytes() for path in keyed.folder.rglob("*") if path.is_file()]
    for token in keyed.tokens.values():
        assert not any(token.encode() in text for text in [*written, listed.encode()])


def test_a_running_server_follows_the_command_line(tmp_path: Path) -> None:
    with running(tmp_path) as started:
        assert httpx.get(started.url + ONE_SIGMA).status_code == 200
        made = command(tmp_path, "key", "create", "first")
        assert (made.returncode, made.stderr) == (0, "")
        token = made.stdout.strip()
        require_status(started.url, {}, 401)
        require_status(started.url, bearer(token), 200)
        assert command(tmp_path, "key", "revoke", "first").returncode == 0
        require_status(started.url, bearer(token), 401)
        assert httpx.get(started.url + ONE_SIGMA).status_code == 401  # the last revoked key opens nothing


def test_keys_made_at_the_same_time_are_all_kept(tmp_path: Path) -> None:
    names = [f"bench-{number}" for number in range(16)]
    with ThreadPoolExecutor(8) as threads:
        tokens = list(threads.map(lambda name: keys_in(tmp_path).create(name, "read"), names))
    kept = {(entry.name, entry.sha256) for entry in keys_in(tmp_path).entries()}
    assert kept == {(name, sha256(token.encode()).hexdigest()) for name, token in zip(names, tokens, strict=True)}


def test_keys_are_told_apart_by_name(keyed: Keyed) -> None:
    assert "'lab'" in refusal(keyed.folder, "key", "create", "lab")
    with pytest.raises(InvalidInput, match="'nobody'"):
        keys_in(keyed.folder).revoke("nobody")


def test_a_revoked_key_leaves_the_others(tmp_path: Path) -> None:
    """And a file of keys of another shape holds none: nothing is let in."""
    keys = keys_in(tmp_path)
    tokens = [keys.create(name, "read").encode() for name in ("lab", "guest")]
    keys.revoke("guest")
    assert [key and key.name for key in map(keys_in(tmp_path).find, tokens)] == ["lab", None]
    for text in ("{}", "[]", "null", '{"keys": [1]}', '{"keys": [{"name": "a", "scope": "read"}]}'):
        keys.path.write_text(text)
        with pytest.raises(KeysUnreadable):
            keys_in(tmp_path).find(tokens[0])


def test_a_damaged_file_of_keys_opens_nothing(tmp_path: Path) -> None:
    token = keys_in(tmp_path).create("lab", "read")
    kept = tmp_path / "data" / "keys.json"
    (key,) = keys_in(tmp_path).entries()
    cookie = logged_in(key)
    with running(tmp_path) as started:
        text = kept.read_text()
        kept.write_text(text[: len(text) // 2])
        require_status(started.url, bearer(token), 503)
        for headers in (bearer(token), bearer("x"), {}, {"Cookie": f"{COOKIE}={cookie}"}):
            refused = httpx.get(started.url + ONE_SIGMA, headers=headers)
            assert refused.headers["retry-after"] == "5"
            assert "keys of this service cannot be read" in problem_of(refused, 503)["detail"]
        for path in ("/health", "/ready", "/login", "/static/underskin.css"):
            assert httpx.get(started.url + path, headers={"Cookie": f"{COOKIE}={cookie}"}).status_code == 200, path
        time.sleep(1.2)  # the file is looked at again
        problem_of(httpx.get(started.url + ONE_SIGMA), 503)
        kept.write_text(text)
        require_status(started.url, bearer(token), 200)
    records = [json.loads(line) for line in started.log.read_text().splitlines() if line.startswith("{")]
    (record,) = [each for each in records if each["level"] == "error"]
    assert f"the keys in {kept} cannot be read" in record["message"]
    assert "Traceback" not in started.log.read_text()


# Reached from other machines


def test_without_keys_other_machines_are_not_let_in(tmp_path: Path) -> None:
    assert "on 0.0.0.0 without API keys" in refusal(tmp_path, "serve", "--host", "0.0.0.0", "--port", "0")
    names = "skin.example.org"
    assert f"as {names} without API keys" in refusal(tmp_path, "serve", "--port", "0", UNDERSKIN_HOSTS=names)


def test_with_a_key_other_machines_are_let_in(tmp_path: Path) -> None:
    token = keys_in(tmp_path).create("lab", "read")
    with running(tmp_path, {}, "--host", "0.0.0.0") as started:
        assert httpx.get(started.url + ONE_SIGMA, headers=bearer(token)).status_code == 200
        problem_of(httpx.get(started.url + ONE_SIGMA), 401)
        (tmp_path / "data" / "keys.json").unlink()
        require_status(started.url, bearer(token), 401)
        problem_of(httpx.get(started.url + ONE_SIGMA), 401)
