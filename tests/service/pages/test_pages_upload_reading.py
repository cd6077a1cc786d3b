"""Files of an upload that are only looked at are read two at a time, however many ask, and others are answered."""

import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import httpx
import pytest

from tests.service.pages.forms import BROWSING, token_of
from tests.support.cases import first
from tests.support.file_readers import readers
from tests.support.store_server import Server, campaign

FILES = 8  # of which the figures of six are kept


@pytest.fixture
def upload(server: Server) -> Iterator[tuple[httpx.Client, str]]:
    """The session of an upload of binary files, which are read in processes of their own, and its address."""
    sent = server.http.post("/v1/campaigns", json=campaign("binary")).json()
    content = server.http.get(f"/v1/campaigns/{sent['id']}/document?format=hdf5").content
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as browser:
        form = {"form_token": token_of(browser.get("/upload").text)}
        files = [("file", (f"{number}.h5", content)) for number in range(FILES)]
        yield browser, browser.post("/upload", data=form, files=files).headers["location"]


@contextmanager
def counted(server: int) -> Iterator[list[int]]:
    """How many processes read files while the block lasts, again and again."""
    counts: list[int] = []
    ended = threading.Event()

    def count() -> None:
        while not ended.wait(0.02):
            counts.append(readers(server))

    counting = threading.Thread(target=count)
    counting.start()
    try:
        yield counts
    finally:
        ended.set()
        counting.join()


@pytest.mark.soak
@pytest.mark.parametrize(
    "paths", first(1, [["/0/frf.csv", "/0/traces.csv"], ["?file={}"], ["?first=1"], ["/0/frf.xlsx"]])
)
def test_two_files_time_read_looked(server: Server, upload: tuple[httpx.Client, str], paths: list[str]) -> None:
    """Two files at a time are read to be looked at."""
    browser, address = upload
    wanted = [address + paths[number % len(paths)].format(number) for number in range(FILES)]

    def get(path: str) -> int:
        return browser.get(path).status_code

    with counted(server.process.pid) as counts, ThreadPoolExecutor(FILES) as pool:
        waiting = [pool.submit(get, path) for path in wanted]
        time.sleep(0.3)
        assert server.http.get("/upload").status_code == 200
        assert {one.result() for one in waiting} == {200}
    assert 1 <= max(counts) <= 2
