"""What takes long and many ask for at once is made a few at a time, and other pages are answered meanwhile."""

import socket
import time
from contextlib import ExitStack
from pathlib import Path
from statistics import median

import pytest

from service.store.write_turns import THREADS
from tests.support.store_server import Place, campaign, running


@pytest.mark.soak
@pytest.mark.alone
@pytest.mark.parametrize("path", ["/campaigns/{id}/frf.xlsx", "/design/search", "/design/search/region.csv"])
def test_many_long_answers_leave_threads_for_other_pages(tmp_path: Path, path: str) -> None:
    with running(Place(tmp_path), UNDERSKIN_DIAGNOSIS_WORKERS="0") as server, ExitStack() as stack:
        path = path.format(**server.http.post("/v1/campaigns", json=campaign("long", lines=1000)).json())
        times = []
        for _ in range(6):
            begun = time.monotonic()
            assert server.http.get(path, headers={"Accept": "text/html"}).raise_for_status().content
            times.append(time.monotonic() - begun)
        of_one_s = median(times[1:])  # the first one loads what computes them
        place = (server.http.base_url.host, server.http.base_url.port)
        for _ in range(THREADS + 10):
            connection = stack.enter_context(socket.create_connection(place))
            connection.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        begun = time.monotonic()
        for _ in range(5):
            assert server.http.get("/v1/skins").status_code == 200
        assert time.monotonic() - begun < 40 * of_one_s
