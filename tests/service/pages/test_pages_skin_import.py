"""An exported skin on the upload page: seen, brought in once, refused where it is damaged or contradicts the store."""

import io
from collections.abc import Callable, Iterator
from urllib.parse import quote

import h5py
import httpx
import pytest

from tests.service.conftest import emptied
from tests.service.pages.forms import BROWSING, token_of
from tests.service.pages.uploads import as_json
from tests.support.cases import first
from tests.support.diagnosed import diagnosed, report, resonant
from tests.support.store_server import Server, campaign

SKIN = 'palm "3" <b>'
PATH = quote(SKIN, safe="")


@pytest.fixture(scope="module")
def export(server: Server) -> bytes:
    """A skin of three campaigns, one with an excluded recording, one diagnosed; its model was adopted and withdrawn.

    The server where it was has nothing of it any more.
    """
    http = server.http
    for name in ("monday", "tuesday"):
        kept = http.post("/v1/campaigns", json=campaign(name), params={"skin": SKIN}).json()["id"]
    left_out = {"recording": "s1-2N", "reason": "cable loose"}
    assert http.post(f"/v1/campaigns/{kept}/exclusions", json=left_out).status_code == 200
    _, diagnosis_id = diagnosed(server, resonant("array"), report(), SKIN)
    adopted = http.post(f"/v1/skins/{PATH}/model", json={"diagnosis_id": diagnosis_id})
    assert adopted.is_success, adopted.text
    withdrawn = http.delete(f"/v1/skins/{PATH}/model", params={"reason": "wrong diagnosis"})
    assert withdrawn.is_success, withdrawn.text
    exported = http.get(f"/v1/skins/{PATH}/export").content
    emptied(server)
    return exported


@pytest.fixture
def empty(server: Server, export: bytes) -> Server:
    """Where nothing came in."""
    assert export
    return emptied(server)


@pytest.fixture
def sender(empty: Server) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=empty.http.base_url, headers=BROWSING, timeout=300) as client:
        yield client


def kept(server: Server) -> list[str]:
    return [entry["name"] for entry in server.http.get("/v1/campaigns", params={"state": "all"}).json()["campaigns"]]


def looked_at(client: httpx.Client, content: bytes) -> str:
    """The page of an upload."""
    form = {"form_token": token_of(client.get("/upload").text)}
    answer = client.post("/upload", data=form, files={"file": ("skin.h5", content)}, follow_redirects=True)
    assert answer.status_code == 200, answer.text
    return answer.text


def _cut(content: bytes) -> bytes:
    return content[: len(content) // 2]


def _newer(content: bytes) -> bytes:
    held = io.BytesIO(content)
    with h5py.File(held, "r+") as opened:
        opened.attrs["schema"] = "skin-export/2"
    return held.getvalue()


def _spoilt(content: bytes) -> bytes:
    held = io.BytesIO(content)
    with h5py.File(held, "r+") as opened:
        name = sorted(opened["campaigns"])[0]
        opened[f"campaigns/{name}/arrays/frf_re_pc_per_n"][0] = float("nan")
    return held.getvalue()


def _other(_content: bytes) -> bytes:
    held = io.BytesIO()
    with h5py.File(held, "w") as opened:
        opened["pressure"] = [1.0, 2.0]
    return held.getvalue()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "told"),
    first(
        2,
        [
            (_spoilt, "frf_re_pc_per_n"),
            (_cut, "was cut off"),
            (_newer, "skin-export/2; this one reads skin-export/1"),
            (_other, "no campaign"),
        ],
    ),
)
def test_a_file_that_cannot_come_in_says_what_is_wrong_with_it(
    sender: httpx.Client, empty: Server, export: bytes, spoil: Callable[[bytes], bytes], told: str
) -> None:
    shown = looked_at(sender, spoil(export))
    assert "It cannot be read" in shown
    assert told in shown
    assert "Bring it in" not in shown
    assert kept(empty) == []


def test_an_exported_skin_comes_alone(sender: httpx.Client, export: bytes) -> None:
    form = {"form_token": token_of(sender.get("/upload").text)}
    both = [("file", ("a.json", as_json(campaign("beside")).encode())), ("file", ("skin.h5", export))]
    both_seen = sender.post("/upload", data=form, files=both, follow_redirects=True)
    assert "it comes in alone" in both_seen.text
    shown = sender.get(both_seen.url.copy_with(query=b"file=1")).text
    assert "it comes in alone" in shown
    assert "Nothing is wrong with the file" in shown
    assert "Put it right in the file" not in shown


@pytest.mark.slow
def test_bringing_a_skin_in_needs_the_sessions_own_form_and_is_done_once(empty: Server, export: bytes) -> None:
    server = empty
    with (
        httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as own,
        httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as other,
    ):
        form, stolen = ({"form_token": token_of(client.get("/upload").text)} for client in (own, other))
        place = own.post("/upload", data=form, files={"file": ("skin.h5", export)}).headers["location"]
        assert own.post(f"{place}/skin", data={"form_token": "x"}).status_code == 403
        other_site = {"Origin": "https://example.org"}
        assert own.post(f"{place}/skin", data=form, headers=other_site).status_code == 403
        assert other.post(f"{place}/skin", data=stolen).status_code == 404
        assert kept(server) == []
        one, again = (own.post(f"{place}/skin", data=form) for _ in range(2))
        assert one.headers["location"] == again.headers["location"] == f"/skins/{PATH}"
        assert len(kept(server)) == 3
        plain = own.post("/upload", data=form, files={"file": ("a.json", as_json(campaign("plain")))})
        assert own.post(f"{plain.headers['location']}/skin", data=form).status_code == 404
