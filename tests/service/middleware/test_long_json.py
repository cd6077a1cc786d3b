"""Bodies of JSON and CSV as large as they may be: the others are answered meanwhile, and they take little memory."""

import json
import os
import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Self

import httpx
import pytest

from tests.service.requests import problem_of
from tests.support.cases import first
from tests.support.process_memory import memory_bytes
from tests.support.server import Server, running
from tests.support.store_server import campaign

pytestmark = pytest.mark.slow

LARGE = 10_000_000  # bytes; the limit is 64 MB
SHORT = 900_000
MOST_HELD_S = 0.5  # of the server's processor time within another request; a parser in its process took seconds
MOST_MEMORY = 6  # times the body, of the server's process and the one that parses, beside what their programs take
PROGRAMS = 100_000_000  # bytes: the interpreter and NumPy of the one, what the first batch loads of the other
JSON = {"Content-Type": "application/json"}
CSV = {"Content-Type": "text/csv"}
POINTS = "a_over_h,rt_over_h\n"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One for all tests here."""
    with running(tmp_path_factory.mktemp("long"), {"UNDERSKIN_DIAGNOSIS_WORKERS": "0"}) as started:
        yield started


def filled(start: str, entry: str, end: str, length: int = LARGE) -> bytes:
    """A body of so many bytes whose middle is one entry again and again."""
    return f"{start}{entry * ((length - len(start) - len(end)) // len(entry))}{end}".encode()


def of_campaign(**fields: Any) -> bytes:
    """A campaign of 5 MB: many recordings, all good."""
    document = campaign("large", sensors=1, lines=200) | fields
    one = document["recordings"][0]
    count = LARGE // 2 // len(json.dumps(one))
    document["recordings"] = [{**one, "id": f"r{number}"} for number in range(count)]
    return json.dumps(document).encode()


def processor_s(pid: int) -> float:
    """Processor time of a process so far, without those that it started: it does not depend on the machine's load."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Beside:
    """What happens beside a request: the most processor time that the server spent on something else while `/health`
    waited, and the memory that it takes more."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._ending = threading.Event()
        self._before = memory_bytes(server.process.pid)
        self.held_s = 0.0
        self.asked = 0
        self.memory = 0
        self._threads = [threading.Thread(target=run) for run in (self._ask, self._look)]

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        for thread in self._threads:
            thread.join()

    def _ask(self) -> None:
        with httpx.Client(base_url=self._server.url, timeout=300) as client:
            while not self._ending.is_set():
                start = processor_s(self._server.process.pid)
                assert client.get("/health").status_code == 200
                self.held_s = max(self.held_s, processor_s(self._server.process.pid) - start)
                self.asked += 1
                time.sleep(0.01)

    def _look(self) -> None:
        while not self._ending.wait(0.02):
            self.memory = max(self.memory, memory_bytes(self._server.process.pid) - self._before)


def attacked(server: Server, path: str, body: bytes) -> httpx.Response:
    """The answer to a body, beside which all must be well."""
    with Beside(server) as beside:
        answer = httpx.post(server.url + path, content=body, headers=JSON, timeout=300)
    assert beside.asked > 0
    assert beside.held_s < MOST_HELD_S
    assert beside.memory < PROGRAMS + MOST_MEMORY * len(body)
    return answer


def test_a_batch_in_all_digits_is_answered(server: Server) -> None:
    numbers = ", ".join(["0.30000000000000004", "1.7000000000000002"] * (LARGE // 42))
    answer = attacked(server, "/v1/sigma", f'{{"a_over_h": [{numbers}], "rt_over_h": 0.6}}'.encode())
    found = answer.raise_for_status().json()
    short = httpx.post(
        server.url + "/v1/sigma", json={"a_over_h": [0.30000000000000004, 1.7000000000000002], "rt_over_h": 0.6}
    )
    assert found["sigma"][:2] == pytest.approx(short.json()["sigma"], rel=1e-12)
    assert found["sigma"] == found["sigma"][:2] * (LARGE // 42)
    assert set(found["status"]) == {"ok"}


Body = Callable[[], bytes]
COLUMN = '{"rt_over_h": 1, "a_over_h": ['
NUMBER = "0.25000000000000, "
POINT = '{"name": "sigma", "input": [['
REFUSED: dict[str, tuple[str, Body, int]] = {
    "nested": ("/v1/sigma", lambda: filled(COLUMN, "[],", "[]]}"), 413),
    "a key twice": ("/v1/sigma", lambda: filled(COLUMN, NUMBER, '1], "rt_over_h": 1}'), 422),
    "a long vector": ("/umbridge/Evaluate", lambda: filled(POINT, NUMBER, "1]]}"), 400),
    "a campaign's name": ("/v1/campaigns", lambda: filled('{"schema": "campaign/1", "name": [', "{},", "1]}"), 413),
    "null": ("/v1/d33", lambda: filled('{"thickness_mm": [', "null,", "1]}"), 413),
    "short numbers": ("/v1/sigma", lambda: filled(COLUMN, "1,", "1]}"), 413),
    "a config": ("/umbridge/Evaluate", lambda: filled(f'{POINT}1, 1, 0]], "config": {{"x": [', "{},", "1]}}"), 413),
}


@pytest.mark.parametrize("case", first(3, REFUSED))
def test_what_takes_much_memory_is_refused(server: Server, case: str) -> None:
    path, body, status = REFUSED[case]
    answer = attacked(server, path, body())
    problem_of(answer, status)
    assert len(answer.content) < 2000


# Too short to be parsed apart: each of their entries was an error of its own.
WRONG: dict[str, tuple[str, Body, int]] = {
    "words in a vector": ("/umbridge/Evaluate", lambda: filled(POINT, '"a",', "1]]}", SHORT), 400),
    "words for vectors": (
        "/umbridge/Evaluate",
        lambda: filled('{"name": "sigma", "input": [', '"a",', "1]}", SHORT),
        400,
    ),
    "words in a column": ("/v1/sigma", lambda: filled(COLUMN, '"a",', "1]}", SHORT), 422),
    "words for ids": ("/v1/fleets/diagnosis", lambda: filled('{"name": "a", "skins": [', "1,", "1]}", SHORT), 422),
    **{
        f"unknown fields to {path}": (
            path,
            lambda: json.dumps({f"f{n}": 0 for n in range(SHORT // 13)}).encode(),
            status,
        )
        for path, status in (
            ("/v1/sigma", 422),
            ("/v1/fleets/diagnosis", 422),
            ("/v1/design", 422),
            ("/v1/campaigns", 422),
        )
    },
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_throughout_is_refused_at_once(server: Server, case: str) -> None:
    path, body, status = WRONG[case]
    before_s, before = processor_s(server.process.pid), memory_bytes(server.process.pid)
    answer = httpx.post(server.url + path, content=body(), headers=JSON, timeout=300)
    assert processor_s(server.process.pid) - before_s < MOST_HELD_S
    assert memory_bytes(server.process.pid) - before < PROGRAMS
    problem_of(answer, status)
    assert len(answer.content) < 30_000


def test_a_large_campaign_is_kept(server: Server) -> None:
    body = of_campaign()
    answer = attacked(server, "/v1/campaigns", body)
    assert answer.status_code == 201
    entries = answer.json()["recordings"]
    assert {entry["status"] for entry in entries} == {"ok"}
    kept = httpx.get(f"{server.url}/v1/campaigns/{answer.json()['id']}/document", timeout=300).json()
    sent = {entry["id"]: entry for entry in json.loads(body)["recordings"]}
    assert len(kept["recordings"]) == len(sent)
    for entry in kept["recordings"][::100]:
        assert entry["frf_re_pc_per_n"] == sent[entry["id"]]["frf_re_pc_per_n"]


@pytest.mark.parametrize("wrong", first(3, ["1,, 2", "1, null", "01", ".5", "1, NaN", "+1", "1 2", ""]))
def test_what_is_no_number_is_found_where_it_is(server: Server, wrong: str) -> None:
    """As in a short body, which other tests look at."""
    numbers = "0.25, " * 250_000
    body = f'{{"rt_over_h": 0.6,\n "a_over_h": [{numbers}{wrong}]}}'.encode()
    problem = problem_of(
        httpx.post(server.url + "/v1/sigma", content=body, headers=JSON, timeout=300), 422 if "null" in wrong else 400
    )
    place = len(' "a_over_h": [') + len(numbers)
    if "null" in wrong:
        assert problem["errors"][0]["field"] == "a_over_h"
        assert problem["errors"][0]["index"] == 250_001
    else:
        found = re.search(r"line 2, column (\d+)", problem["detail"])
        assert found
        assert abs(int(found[1]) - place) < 8


def test_fields_beside_a_long_column_mean_the_same(server: Server) -> None:
    """Texts that look like lists, escapes, short lists, single numbers, blanks."""
    column = ", ".join(["0.2500000000000"] * 60_000)
    good = f'\n{{ "model" : "half_space", "a_over_h": [{column}], "rt_over_h":0.6, "load_parameter": 0 }} '
    found = httpx.post(server.url + "/v1/sigma", content=good, headers=JSON, timeout=300).raise_for_status().json()
    assert (found["model"], len(found["sigma"]), len(set(found["sigma"]))) == ("half_space", 60_000, 1)
    odd = f'{{"a_over_h": [{column}], "rt_over_h": 0.6, "model": "\\"[{column}]"}}'
    errors = problem_of(httpx.post(server.url + "/v1/sigma", content=odd, headers=JSON, timeout=300), 422)["errors"]
    assert [error["field"] for error in errors] == ["model"]


@pytest.mark.parametrize("cells", first(2, ["0.3,0.6\n", ";", "0.3,", "\n"]))
def test_csv_of_very_many_cells_is_refused(server: Server, cells: str) -> None:
    with Beside(server) as beside:
        answer = httpx.post(f"{server.url}/v1/sigma", content=filled(POINTS, cells, "0.3,0.6\n"), headers=CSV)
    assert "500,000 may be in one" in problem_of(answer, 413)["detail"]
    assert beside.memory < MOST_MEMORY * LARGE


def test_csv_of_many_cells_is_answered(server: Server) -> None:
    rows = 249_000
    with Beside(server) as beside:
        body = POINTS.encode() + b"0.3,0.6\n" * rows
        answer = httpx.post(f"{server.url}/v1/sigma", content=body, headers=CSV, timeout=300)
    assert len(answer.raise_for_status().json()["sigma"]) == rows
    assert beside.asked > 0
    assert beside.held_s < MOST_HELD_S
    assert beside.memory < 2 * PROGRAMS
