"""A PostgreSQL server that is gone without a word, or takes no writes: requests are told so, and all goes on later."""

from pathlib import Path

import httpx
import pytest

from tests.service.store.scheduled import NO_WORKERS
from tests.service.waiting import until
from tests.support.own_network import own_network
from tests.support.postgres import Cluster
from tests.support.store_server import Place, campaign, running

NOTICED_S = 240  # by the system's own limits it would be a quarter of an hour


def test_of_a_standby_writers_are_told_to_come_again(cluster: Cluster, tmp_path: Path) -> None:
    """As after a failover, until it is promoted."""
    url = cluster.new_database()
    name = url.rpartition("/")[2]

    def take_writes(*, readily: bool) -> None:
        cluster.run_sql("postgres", f"ALTER DATABASE {name} SET default_transaction_read_only = {not readily}")
        ended = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname"
        cluster.run_sql("postgres", f"{ended} = '{name}'")

    with running(Place(tmp_path, url), **NO_WORKERS) as server:
        take_writes(readily=False)
        refused = server.http.post("/v1/campaigns", json=campaign("refused"))
        assert refused.status_code == 503
        assert int(refused.headers["Retry-After"]) > 0
        assert server.http.get("/v1/campaigns").json()["campaigns"] == []
        take_writes(readily=True)
        assert server.http.post("/v1/campaigns", json=campaign("kept")).status_code == 201


@pytest.mark.slow
def test_it_is_noticed_and_taken_up_again(cluster: Cluster, tmp_path: Path) -> None:
    with own_network(next(cluster.folder.glob(".s.PGSQL.*[0-9]"))) as network:
        if network is None:
            pytest.skip(
                "no network of the test's own can be made here (Debian's package iproute2, and the rights of root)"
            )
        with running(Place(tmp_path, network.url(cluster.new_database())), **NO_WORKERS) as server:
            sent = server.http.post("/v1/campaigns", json=campaign("before"))
            assert sent.status_code == 201
            network.cut()
            url = str(server.http.base_url)
            for path in ("/ready", "/v1/campaigns"):
                assert httpx.get(f"{url}{path}", timeout=NOTICED_S).status_code == 503, path
            assert httpx.post(f"{url}/v1/campaigns", json=campaign("lost"), timeout=NOTICED_S).status_code == 503
            network.mend()
            until(lambda: httpx.get(f"{url}/ready", timeout=300).status_code == 200)
            assert server.http.post("/v1/campaigns", json=campaign("after")).status_code == 201
            names = [entry["name"] for entry in server.http.get("/v1/campaigns").json()["campaigns"]]
    assert sorted(names) == ["after", "before"]
