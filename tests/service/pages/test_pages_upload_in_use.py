"""An upload that makes room for another while its files are read, or kept: the files stay until that has ended."""

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import httpx
import orjson
import pytest

from tests.service.pages.forms import BROWSING, token_of
from tests.service.waiting import until
from tests.support.file_readers import readers
from tests.support.store_server import Place, Server, campaign, running

FILES = 4  # each read in a process of its own
ROOM_MB = 0.6  # for all uploads: that of the other one leaves none
OTHER_BYTES = 550_000


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with running(Place(tmp_path_factory.mktemp("small") / "data"), UNDERSKIN_MAX_UPLOAD_MB=str(ROOM_MB)) as server:
        yield server


@contextmanager
def browser(server: Server) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as client:
        yield client


def send(client: httpx.Client, files: list[tuple[str, bytes]]) -> httpx.Response:
    form = {"form_token": token_of(client.get("/upload").text)}
    return client.post("/upload", data=form, files=[("file", file) for file in files])


def send_other(server: Server) -> None:
    """As soon as a file is read, somebody else's upload takes all the room."""
    until(lambda: readers(server.process.pid), "no file is read")
    with browser(server) as other:
        content = orjson.dumps(campaign("other"))
        assert send(other, [("other.json", content + b" " * (OTHER_BYTES - len(content)))]).status_code == 303


def binary(server: Server, skin: str) -> list[tuple[str, bytes]]:
    sent = server.http.post("/v1/campaigns", json=campaign(skin), params={"skin": skin}).json()
    content = server.http.get(f"/v1/campaigns/{sent['id']}/document?format=hdf5").content
    assert FILES * len(content) < 1e6 * ROOM_MB
    return [(f"{number}.h5", content) for number in range(FILES)]


def test_files_that_are_read_while_their_upload_makes_room_are_read(small: Server) -> None:
    files = binary(small, "read")
    with browser(small) as client, ThreadPoolExecutor(1) as pool:
        sending = pool.submit(send, client, files)
        send_other(small)
        answer = sending.result()
        assert answer.status_code == 303
        gone = client.get(answer.headers["location"])
        assert gone.status_code == 404
        assert "not here any more" in gone.text


@pytest.mark.soak
def test_what_is_being_kept_while_its_upload_makes_room_is_kept(small: Server) -> None:
    files = binary(small, "kept")
    with browser(small) as client, ThreadPoolExecutor(1) as pool:
        place = send(client, files).headers["location"]
        form = {"form_token": token_of(client.get(place).text), "skin": "kept"}
        keeping = pool.submit(client.post, f"{place}/keep", data=form)
        send_other(small)
        assert keeping.result().headers["location"] == "/skins/kept"
    listed = small.http.get("/v1/campaigns", params={"skin": "kept"}).json()["campaigns"]
    assert len(listed) == 1 + FILES
    end = time.monotonic() + 240
    while len(shelves := list((small.place.folder / "uploads").glob("*/shelf-*"))) > 1:  # that of the other one
        assert time.monotonic() < end, shelves
        time.sleep(0.05)


def test_an_upload_beyond_the_limit_is_refused_on_a_page(small: Server) -> None:
    with browser(small) as client:
        answer = send(client, [("a.csv", b"1,2\n" * 200_000)])
    assert answer.status_code == 413
    assert "UNDERSKIN_MAX_UPLOAD_MB" in answer.text
    assert "<h1>" in answer.text
