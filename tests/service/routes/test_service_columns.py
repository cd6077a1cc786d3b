"""FRF and d33 over HTTP: columns in, columns out, as JSON and as CSV."""

import csv
import io
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import numpy as np
import pytest

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


def test_csv_names_frequency_column_spectra(http: httpx.Client) -> None:
    """Csv names the frequency of each column of spectra."""
    fields = {**SKIN, "preload_n": [1, 3], "d33_pc_per_n": 14, "frequency_hz": [10, 20.5]}
    columns = read_csv(http.post("/v1/frf", json=fields, headers={"Accept": "text/csv"}).text)
    assert columns["frf_re_pc_per_n[10.0 Hz]"] == columns["frf_re_pc_per_n[20.5 Hz]"] == columns["frf_pc_per_n"]
    assert columns["frf_im_pc_per_n[20.5 Hz]"] == ["0.0", "0.0"]


def test_spectra_flat_real_null_outside(http: httpx.Client) -> None:
    """Spectra are flat and real and null outside."""
    answer = post(http, "/v1/frf", **SKIN, preload_n=[1, 300], d33_pc_per_n=-14, frequency_hz=[1, 10, 100])
    assert answer["frequency_hz"] == [1, 10, 100]
    assert answer["frf_pc_per_n"][0] < 0
    assert answer["frf_re_pc_per_n"] == [[answer["frf_pc_per_n"][0]] * 3, [None] * 3]
    assert answer["frf_im_pc_per_n"] == [[0.0] * 3, [None] * 3]


def test_rows_poisson_ratio_outside(http: httpx.Client) -> None:
    """Rows of another poisson ratio are outside."""
    answer = post(http, "/v1/frf", **SKIN, preload_n=1, d33_pc_per_n=14, poisson_ratio=[0.5, 0.45])
    assert answer["status"] == ["ok", "out_of_domain"]
    assert answer["frf_pc_per_n"][1] is None
    assert answer["contact_radius_mm"][1] > 0


def test_d33_lines_mean_band(http: httpx.Client) -> None:
    """D33 from lines is that of their mean in the band."""
    lines = [[7.0, 7.2, 7.4, 99.0], [8.0, 8.0, 8.3, -5.0]]
    imaginary = [[0.7, 0.6, 0.8, 5.0], [0.1, 0.2, 0.3, 5.0]]
    common = {**SKIN, "preload_n": [1, 3]}
    spectra = {"frequency_hz": [10, 20, 130, 131], "band_hz": [10, 130], "frf_re_pc_per_n": lines}
    answer = post(http, "/v1/d33", **common, **spectra, frf_im_pc_per_n=imaginary)
    measured = np.array(lines)[:, :3]
    mean, error = measured.mean(axis=1), measured.std(axis=1, ddof=1) / np.sqrt(3)
    assert answer["frf_pc_per_n"] == pytest.approx(mean)
    assert answer["frf_uncertainty_pc_per_n"] == pytest.approx(error)
    assert answer["frf_im_pc_per_n"] == pytest.approx([0.7, 0.2])
    plateau = post(http, "/v1/d33", **common, frf_pc_per_n=mean.tolist(), frf_uncertainty_pc_per_n=error.tolist())
    for name in ("d33_pc_per_n", "d33_uncertainty_pc_per_n", "sigma"):
        assert answer[name] == pytest.approx(plateau[name], rel=1e-12), name
    stated = post(http, "/v1/d33", **common, **spectra, frf_uncertainty_pc_per_n=0.5)
    assert stated["frf_uncertainty_pc_per_n"] == [0.5, 0.5]


def test_health_answered_large_batch_computed(server_url: str) -> None:
    """Health is answered while a large batch is computed."""
    rows = 400_000
    body = {"a_over_h": np.linspace(0, 3, rows).tolist(), "rt_over_h": 0.6, "load_parameter": 0.01}
    with ThreadPoolExecutor(1) as threads, httpx.Client(base_url=server_url, timeout=300) as client:
        batch = threads.submit(httpx.post, f"{server_url}/v1/sigma", json=body, timeout=300)
        answered = 0
        while not batch.done():
            answered += client.get("/health").status_code == 200
    assert len(batch.result().json()["sigma"]) == rows
    assert answered >= 3
