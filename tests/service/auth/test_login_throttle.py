"""Keys that are guessed on the login page: a few at once, then one every few seconds."""

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from service.auth.keys import KeyStore
from service.auth.login_throttle import AT_ONCE, SECONDS, LoginThrottle
from tests.service.pages.forms import BROWSING, token_of
from tests.support.server import running


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[tuple[str, str]]:
    """The address of a server that needs a key, and the key."""
    key = KeyStore(tmp_path / "data").create("lab", "read")
    with running(tmp_path) as server:
        yield server.url, key


def tried(url: str, key: str) -> httpx.Response:
    """The answer to the login page's form with this key."""
    with httpx.Client(base_url=url, headers={"Origin": url, **BROWSING}, timeout=60) as browser:
        form = browser.get("/login")
        return browser.post("/login", data={"key": key, "form_token": token_of(form.text)})


def test_who_guesses_keys_has_to_wait_and_who_has_one_logs_in_before(guarded: tuple[str, str]) -> None:
    url, key = guarded
    assert [tried(url, f"us_{number:032d}").status_code for number in range(AT_ONCE)] == [401] * AT_ONCE
    refused = tried(url, key)
    assert refused.status_code == 429
    assert 1 <= int(refused.headers["retry-after"]) <= SECONDS
    assert httpx.get(f"{url}/v1/tables", headers={"Authorization": f"Bearer {key}"}).status_code == 200


def test_a_right_key_counts_as_no_try(guarded: tuple[str, str]) -> None:
    url, key = guarded
    for _ in range(AT_ONCE + 5):
        assert tried(url, key).status_code == 303


def test_tries_are_counted_by_address_and_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 1000.0
    monkeypatch.setattr("service.auth.login_throttle.time.monotonic", lambda: now)
    throttle = LoginThrottle()
    for _ in range(AT_ONCE):
        assert throttle.wait_s("a") == 0
        throttle.failed("a")
    assert throttle.wait_s("a") == pytest.approx(SECONDS)
    assert throttle.wait_s("b") == 0
    now += SECONDS
    assert throttle.wait_s("a") == pytest.approx(0.0)
    throttle.failed("a")
    assert throttle.wait_s("a") == pytest.approx(SECONDS)
    now += 100 * SECONDS
    throttle.failed("a")
    assert throttle.wait_s("a") == 0
