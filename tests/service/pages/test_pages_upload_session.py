"""Uploads by hand-made requests: kept once, each its session's own, and none of whom may not, or beyond the limits."""

import csv
from collections.abc import Iterator

import httpx
import pytest

from tests.service.pages.forms import BROWSING, token_of
from tests.service.pages.uploads import as_json, campaigns_of
from tests.support.store_server import Server, campaign


@pytest.fixture
def sender(server: Server) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as client:
        yield client


def posted(client: httpx.Client, name: str = "by hand") -> str:
    """The address of an upload."""
    form = {"form_token": token_of(client.get("/upload").text), "skin": name}
    answer = client.post("/upload", data=form, files={"file": ("a.json", as_json(campaign(name)))})
    assert answer.status_code == 303, answer.text
    return answer.headers["location"]


def test_kept_twice_is_kept_once_and_what_is_discarded_can_be_taken_back(sender: httpx.Client, server: Server) -> None:
    place = posted(sender, "twice")
    form = {"form_token": token_of(sender.get(place).text), "skin": "twice"}
    first, second = (sender.post(f"{place}/keep", data=form) for _ in range(2))
    assert first.headers["location"] == second.headers["location"]
    assert len(campaigns_of(server, "twice")) == 1
    assert sender.get(place).headers["location"] == first.headers["location"]
    place = posted(sender, "discarded")
    assert sender.post(f"{place}/discard", data=form).status_code == 303
    for answer in (sender.get(place), sender.post(f"{place}/keep", data=form)):
        assert answer.status_code == 404
        assert "can be taken back" in answer.text
    assert campaigns_of(server, "discarded") == []
    assert f'action="{place}/restore"' in sender.get("/upload").text
    assert sender.post(f"{place}/restore", data=form).headers["location"] == place
    assert sender.get(place).status_code == 200
    assert f'action="{place}/restore"' not in sender.get("/upload").text


def test_an_upload_is_its_session_s_own(sender: httpx.Client, server: Server) -> None:
    place = posted(sender)
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as other:
        form = {"form_token": token_of(other.get("/upload").text), "skin": "stolen"}
        assert other.get(place).status_code == 404
        for path in ("keep", "discard", "restore", "mapping"):
            assert other.post(f"{place}/{path}", data=form).status_code == 404
        assert other.get(f"{place}/0/frf.csv").status_code == 404
    rows = list(csv.DictReader(sender.get(f"{place}/0/frf.csv").text.splitlines()))
    assert len(rows) == 6 * 20
    assert sender.get(f"{place}/1/frf.csv").status_code == 404
