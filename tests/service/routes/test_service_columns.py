"""FRF and d33 over HTTP: columns in, columns out, as JSON and as CSV."""

import csv
import io
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import numpy as np

SKIN: dict[str, Any] = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
}


def post(http: httpx.Client, path: str, **fields: Any) -> dict[str, Any]:
    """The answer to columns that are accepted."""
    answer = http.post(path, json=fields)
    assert answer.status_code == 200, answer.text
    document: dict[str, Any] = answer.json()
    return document


def read_csv(text: str) -> dict[str, list[str]]:
    """Columns by name."""
    header, *lines = csv.reader(io.StringIO(text))
    return dict(zip(header, map(list, zip(*lines, strict=True)), strict=True))


def test_csv_both_ways_is_the_json_answer(http: httpx.Client) -> None:
    header = [*SKIN, "preload_n", "d33_pc_per_n", "model"]
    lines = [header, *([*SKIN.values(), preload, 14.0, "paper"] for preload in (1.0, 3.0, 300.0))]
    body = "\r\n".join(",".join(map(str, line)) for line in lines)
    asked = {"Content-Type": "text/csv; charset=utf-8", "Accept": "text/csv"}
    answer = http.post("/v1/frf", content=body, headers=asked)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"].startswith("text/csv")
    columns = read_csv(answer.text)
    same = post(http, "/v1/frf", **SKIN, preload_n=[1, 3, 300], d33_pc_per_n=14)
    assert answer.headers["underskin-table-sha256"] == same["table_sha256"]
    assert answer.headers["underskin-model"] == same["model"] == "paper"
    assert columns.pop("status") == same["status"] == ["ok", "ok", "out_of_domain"]
    assert [words or None for words in columns.pop("limit")] == same["limit"]
    for name, cells in columns.items():
        expected = [np.nan if value is None else value for value in same[name]]
        np.testing.assert_array_equal([float(cell) for cell in cells], expected, err_msg=name)
    assert columns["sigma"][2] == "NaN"


def test_health_is_answered_while_a_large_batch_is_computed(server_url: str) -> None:
    rows = 400_000
    body = {"a_over_h": np.linspace(0, 3, rows).tolist(), "rt_over_h": 0.6, "load_parameter": 0.01}
    with ThreadPoolExecutor(1) as threads, httpx.Client(base_url=server_url, timeout=300) as client:
        batch = threads.submit(httpx.post, f"{server_url}/v1/sigma", json=body, timeout=300)
        answered = 0
        while not batch.done():
            answered += client.get("/health").status_code == 200
    assert len(batch.result().json()["sigma"]) == rows
    assert answered >= 1
