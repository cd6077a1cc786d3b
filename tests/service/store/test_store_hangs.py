"""A database that does not answer keeps those waiting who ask it, and nobody else."""

import time
from concurrent.futures import ThreadPoolExecutor

import httpx
import psycopg
import pytest

from tests.service.pages.forms import BROWSING, token_of
from tests.support.store_server import Server


@pytest.mark.parametrize("server", ["postgresql"], indirect=True)
def test_others_are_answered_while_the_example_waits_for_the_store(server: Server) -> None:
    with (
        httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as browser,
        psycopg.connect(server.place.database_url) as locking,
        ThreadPoolExecutor(1) as pool,
    ):
        form = {"form_token": token_of(browser.get("/").text)}
        locking.execute("LOCK TABLE skins IN ACCESS EXCLUSIVE MODE")
        loading = pool.submit(browser.post, "/example", data=form)
        time.sleep(0.5)
        assert not loading.done()
        for path in ("/health", "/v1/sigma?a_over_h=0.3&rt_over_h=0.6"):
            assert server.http.get(path, timeout=240).status_code == 200
        assert not loading.done()  # it waits for the lock, which these did not
        locking.rollback()
        assert loading.result().status_code == 303
