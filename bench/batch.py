"""POST /v1/sigma with 100,000 rows on one core, from sending to the last byte of the answer: as JSON, as NumPy's .npz,
and beside a plain FastAPI route that calls SciPy's spline.
"""

import http.client
import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from statistics import median
from typing import Any

import numpy as np
import orjson

from bench import servers
from bench.figures import Figure, interleaved, ratio, seconds
from underskin.units import Floats

ROWS = 100_000
ROUNDS = 15
_JSON, _NPZ = "application/json", "application/x-npz"


@dataclass(frozen=True)
class _Contestant:
    """One request, again and again over one connection."""

    connection: http.client.HTTPConnection
    path: str
    body: bytes
    media_type: str

    def answer(self) -> bytes:
        self.connection.request(
            "POST", self.path, self.body, {"Content-Type": self.media_type, "Accept": self.media_type}
        )
        response = self.connection.getresponse()
        answer = response.read()
        if response.status != 200:
            raise RuntimeError(f"{response.status}: {answer[:500].decode()}")
        return answer


def measure() -> list[Figure]:
    """Rows a second of each, for random rows over the whole domain with all digits of a double, and the ratios."""
    columns = _columns()
    json = orjson.dumps(columns, option=orjson.OPT_SERIALIZE_NUMPY)
    with servers.underskin() as ours, servers.plain_sigma() as plain:
        contestants = {
            "JSON": _Contestant(_connected(ours), "/v1/sigma", json, _JSON),
            "npz": _Contestant(_connected(ours), "/v1/sigma", _npz(columns), _NPZ),
            "plain": _Contestant(_connected(plain), "/sigma", json, _JSON),
        }
        os.sched_setaffinity(0, {servers.LOAD_CORE})
        _check_same_answers({name: contestant.answer() for name, contestant in contestants.items()})
        times = interleaved(
            {name: partial(seconds, contestant.answer) for name, contestant in contestants.items()}, ROUNDS
        )
    over = "over a plain FastAPI route with SciPy"
    return [
        Figure(f"POST /v1/sigma, {ROWS:,} rows", ROWS / median(times["JSON"]), "rows/s", 1e6),
        Figure("the same as .npz", ROWS / median(times["npz"]), "rows/s"),
        Figure("a plain FastAPI route with SciPy", ROWS / median(times["plain"]), "rows/s"),
        Figure(f"POST /v1/sigma {over}", ratio(times["plain"], times["JSON"]), "×", 2.0),
        Figure(f"POST /v1/sigma as .npz {over}", ratio(times["plain"], times["npz"]), "×", 5.0),
    ]


def _columns() -> dict[str, Floats]:
    random = np.random.default_rng(2)
    limits = {"a_over_h": 3.0, "rt_over_h": 3.0, "load_parameter": 0.1}
    return {name: random.uniform(0, high, ROWS) for name, high in limits.items()}


def _npz(columns: Mapping[str, Floats]) -> bytes:
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **columns)
    return file.getvalue()


def _connected(server: servers.Server) -> http.client.HTTPConnection:
    return http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)


def _check_same_answers(answers: Mapping[str, bytes]) -> None:
    """All must give the same σ, or the comparison would not be fair."""
    read: dict[str, Mapping[str, Any]] = {
        "JSON": orjson.loads(answers["JSON"]),
        "npz": np.load(io.BytesIO(answers["npz"])),
        "plain": orjson.loads(answers["plain"]),
    }
    for name in ("JSON", "npz"):
        if list(read[name]["status"]) != ["ok"] * ROWS:
            raise RuntimeError("a row of the batch was refused")
        np.testing.assert_allclose(read[name]["sigma"], read["plain"]["sigma"], rtol=1e-12)
