"""Keys that are guessed on the login page: a few at once, then one every few seconds."""

from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx
import pytest
from starlette.requests import Request

from service.auth.keys import KeyStore
from service.auth.login_throttle import AT_ONCE, SECONDS, LoginThrottle, client_address, network_of
from service.settings import Settings
from tests.service.pages.forms import BROWSING, token_of
from tests.support.server import running


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[tuple[str, str]]:
    """The address of a server that needs a key, and the key."""
    key = KeyStore(tmp_path / "data").create("lab", "read")
    with running(tmp_path) as server:
        yield server.url, key


def tried(url: str, key: str, forwarded: str | None = None) -> httpx.Response:
    """The answer to the login page's form with this key; `forwarded`: what a proxy says of whom it is for."""
    headers = {"Origin": url, **BROWSING, **({} if forwarded is None else {"X-Forwarded-For": forwarded})}
    with httpx.Client(base_url=url, headers=headers, timeout=300) as browser:
        form = browser.get("/login")
        return browser.post("/login", data={"key": key, "form_token": token_of(form.text)})


def test_who_guesses_keys_has_to_wait_and_who_has_one_logs_in_before(guarded: tuple[str, str]) -> None:
    url, key = guarded
    assert [tried(url, f"us_{number:032d}").status_code for number in range(AT_ONCE)] == [401] * AT_ONCE
    refused = tried(url, key)
    assert refused.status_code == 429
    assert 1 <= int(refused.headers["retry-after"]) <= SECONDS
    assert httpx.get(f"{url}/v1/tables", headers={"Authorization": f"Bearer {key}"}).status_code == 200


def test_tries_are_counted_by_address_and_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 1000.0
    monkeypatch.setattr("service.auth.login_throttle.time.monotonic", lambda: now)
    throttle = LoginThrottle()
    assert [throttle.begin("a") for _ in range(AT_ONCE)] == [0] * AT_ONCE
    assert throttle.begin("a") == pytest.approx(SECONDS)
    assert throttle.begin("b") == 0
    now += SECONDS
    assert throttle.begin("a") == 0
    assert throttle.begin("a") == pytest.approx(SECONDS)
    throttle.succeeded("a")
    assert throttle.begin("a") == 0
    now += 100 * SECONDS
    assert [throttle.begin("a") for _ in range(AT_ONCE)] == [0] * AT_ONCE


def test_tries_at_the_same_time_count_as_those_one_after_the_other(guarded: tuple[str, str]) -> None:
    url, _ = guarded
    with ThreadPoolExecutor(30) as senders:
        seen = Counter(answer.status_code for answer in senders.map(tried, [url] * 30, ["us_" + 32 * "0"] * 30))
    assert seen[401] <= AT_ONCE + 5  # another is free after each six seconds, should it take so long
    assert seen[401] + seen[429] == 30


def test_addresses_behind_a_proxy_on_this_machine_are_told_apart(guarded: tuple[str, str]) -> None:
    url, key = guarded
    wrong = "us_" + 32 * "0"
    for number in range(AT_ONCE):
        assert tried(url, wrong, f"203.0.113.9, 2001:db8::{number}").status_code == 401
    assert tried(url, key, "2001:db8::ffff").status_code == 429  # the same network
    assert tried(url, key, "2001:db8:0:1::1").status_code == 303
    assert tried(url, key, "198.51.100.7").status_code == 303
    assert tried(url, key, "nonsense").status_code == 303  # counts as the proxy itself


def test_of_proxies_elsewhere_those_that_are_named_are_believed() -> None:
    networks = Settings(proxies="172.16.0.0/12, 2001:db8:7::1").proxy_networks

    def seen(peer: str, forwarded: str) -> str:
        headers = [(b"x-forwarded-for", forwarded.encode())]
        return client_address(Request({"type": "http", "client": (peer, 1), "headers": headers}), networks)

    assert seen("172.18.0.1", "198.51.100.7") == "198.51.100.7"
    assert seen("::ffff:172.18.0.1", "203.0.113.9, 198.51.100.7") == "198.51.100.7"
    assert seen("2001:db8:7::1", "198.51.100.7") == "198.51.100.7"
    assert seen("127.0.0.1", "198.51.100.7") == "198.51.100.7"
    assert seen("172.32.0.1", "198.51.100.7") == "172.32.0.1"
    assert seen("2001:db8:7::2", "198.51.100.7") == "2001:db8:7::2"


def test_addresses_of_ipv4_are_told_apart_on_a_socket_of_ipv6() -> None:
    assert network_of("::ffff:192.0.2.7") == network_of("192.0.2.7") == "192.0.2.7"
    assert network_of("::ffff:192.0.2.8") == "192.0.2.8"
    assert network_of("2001:db8::7") == network_of("2001:db8::8") == "2001:db8::/64"
    assert network_of("") == ""
