"""POST /v1/sigma with 100,000 rows of JSON on one core: rows a second, from sending to the last byte of the answer."""

import http.client
import os
from functools import partial
from statistics import median

import numpy as np
import orjson

from bench import servers
from bench.figures import Figure, seconds

ROWS = 100_000
ROUNDS = 15


def measure() -> list[Figure]:
    """Rows a second, for random rows over the whole domain with all digits of a double."""
    with servers.underskin() as server:
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
        body = _body()
        os.sched_setaffinity(0, {servers.LOAD_CORE})
        answer = orjson.loads(_post(connection, body))
        if answer["status"] != ["ok"] * ROWS:
            raise RuntimeError("a row of the batch was refused")
        times = [seconds(partial(_post, connection, body)) for _ in range(ROUNDS)]
        connection.close()
    return [Figure(f"POST /v1/sigma, {ROWS:,} rows", ROWS / median(times), "rows/s", 1e6)]


def _body() -> bytes:
    random = np.random.default_rng(2)
    limits = {"a_over_h": 3.0, "rt_over_h": 3.0, "load_parameter": 0.1}
    columns = {name: random.uniform(0, high, ROWS) for name, high in limits.items()}
    return orjson.dumps(columns, option=orjson.OPT_SERIALIZE_NUMPY)


def _post(connection: http.client.HTTPConnection, body: bytes) -> bytes:
    connection.request("POST", "/v1/sigma", body, {"Content-Type": "application/json"})
    response = connection.getresponse()
    answer = response.read()
    if response.status != 200:
        raise RuntimeError(f"{response.status}: {answer[:500].decode()}")
    return answer
