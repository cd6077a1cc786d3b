"""What is refused, and how it is said: RFC 9457 problems in one shape over all routes."""

import asyncio
import json
import math
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.service.in_process import in_process
from tests.service.requests import D33, FRF, SIGMA, all_routes, problem_of

LINES: dict[str, Any] = {
    **{name: D33[name] for name in D33 if name != "frf_pc_per_n"},
    "frequency_hz": [10, 20],
    "band_hz": [1, 100],
    "frf_re_pc_per_n": [[7, 7.1], [8, 8.1]],
}


@pytest.mark.parametrize("path", ["/", "/health", "/v1/skins", "/v1/sigma?a_over_h=0.3&rt_over_h=0.6", "/openapi.json"])
def test_head_has_the_headers_of_get_and_no_body(http: httpx.Client, path: str) -> None:
    asked, whole = http.head(path), http.get(path)
    assert asked.status_code == whole.status_code == 200
    assert asked.content == b""
    for name in ("content-type", "content-length"):
        assert asked.headers.get(name) == whole.headers.get(name)


def test_every_route_refuses_in_the_same_shape(http: httpx.Client) -> None:
    for method, path in all_routes(http):
        problem_of(http.request(method, path, headers={"Host": "evil.example"}), 421)
        allowed = {other for other, same in all_routes(http) if same == path}
        refused = http.request("PUT", path)
        problem_of(refused, 405)
        assert set(refused.headers["allow"].split(", ")) == allowed
        problem_of(http.request(method, path + "/nothing/here"), 404)
        if method == "POST" and not path.endswith(("/diagnosis", "/undo")):  # which take none, or need none
            invalid = 400 if path.startswith("/umbridge/") else 422
            problem_of(http.post(path, json={}), invalid)
            problem_of(http.post(path, json=[1, 2]), invalid)
            problem_of(http.post(path, headers={"Origin": "http://evil.example"}, json={}), 403)
            unreadable = http.post(path, content=b"{", headers={"Content-Type": "application/json"})
            problem_of(unreadable, 422 if path == "/v1/skins/import" else 400)  # which takes HDF5 alone
            if not path.startswith("/umbridge/"):
                form = http.post(path, content=b"a=1", headers={"Content-Type": "application/x-www-form-urlencoded"})
                problem_of(form, 422 if "{" in path else 415)


@pytest.mark.parametrize(
    ("path", "good", "wrong", "field", "index"),
    [
        ("/v1/sigma", SIGMA, {"a_over_h": [0.3, -0.1]}, "a_over_h", 1),
        ("/v1/sigma", SIGMA, {"a_over_h": [0.3, math.nan]}, "a_over_h", 1),
        ("/v1/sigma", SIGMA, {"a_over_h": [0.3, None]}, "a_over_h", 1),
        ("/v1/sigma", SIGMA, {"a_over_h": [True, 0.6]}, "a_over_h", 0),
        ("/v1/sigma", SIGMA, {"a_over_h": [[0.3], 0.6]}, "a_over_h", 0),
        ("/v1/sigma", SIGMA, {"rt_over_h": [0.6, 0.6, 0.6]}, "rt_over_h", None),
        ("/v1/sigma", SIGMA, {"load_paramter": 0.1}, "load_paramter", None),
        ("/v1/sigma", SIGMA, {"model": "sphere"}, "model", None),
        ("/v1/sigma", SIGMA, {"a_over_h": 10**400}, "a_over_h", None),
        ("/v1/frf", FRF, {"preload_n": [1.0, 0.0]}, "preload_n", 1),
        ("/v1/frf", FRF, {"youngs_modulus_mpa": math.nan}, "youngs_modulus_mpa", None),
        ("/v1/frf", FRF, {"d33_pc_per_n": 0.0}, "d33_pc_per_n", None),
        ("/v1/frf", FRF, {"poisson_ratio": 0.51}, "poisson_ratio", None),
        ("/v1/frf", FRF, {"frequency_hz": [10.0, -1.0]}, "frequency_hz", 1),
        ("/v1/frf", FRF, {"frequency_hz": [1.0] * 500_001}, "frequency_hz", None),
        ("/v1/frf", FRF, {"model": "adopted"}, "skin_id", None),
        ("/v1/d33", D33, {"frf_pc_per_n": [1.0, math.nan]}, "frf_pc_per_n", 1),
        ("/v1/d33", D33, {"frf_uncertainty_pc_per_n": -0.1}, "frf_uncertainty_pc_per_n", None),
        ("/v1/d33", D33, {"band_hz": [1, 2]}, "band_hz", None),
        ("/v1/d33", LINES, {"frf_re_pc_per_n": [[7, 7.1], [8]]}, "frf_re_pc_per_n", 1),
        ("/v1/d33", LINES, {"frf_re_pc_per_n": [[7, 7.1], [8, math.inf]]}, "frf_re_pc_per_n", 1),
        ("/v1/d33", LINES, {"frf_im_pc_per_n": [[7, 7.1], [8, None]]}, "frf_im_pc_per_n", 1),
    ],
)
def test_wrong_value_is_named_with_its_row(
    http: httpx.Client, path: str, good: dict[str, Any], wrong: dict[str, Any], field: str, index: int | None
) -> None:
    assert http.post(path, json=good).status_code == 200
    body = json.dumps({**good, **wrong})  # httpx would refuse NaN; MATLAB and Python's own clients send it
    document = problem_of(http.post(path, content=body, headers={"Content-Type": "application/json"}), 422)
    (error,) = document["errors"]
    assert (error["field"], error["index"]) == (field, index)
    assert error["allowed"]
    assert field in document["detail"]


@pytest.mark.parametrize(
    ("field", "value", "guess"),
    [("thickness_mm", 0.0025, "m"), ("thickness_mm", 2500.0, "µm"), ("youngs_modulus_mpa", 16e6, "Pa")],
)
def test_slip_of_units_is_guessed_and_can_be_meant(http: httpx.Client, field: str, value: float, guess: str) -> None:
    fields = {**FRF, field: value}
    (error,) = problem_of(http.post("/v1/frf", json=fields), 422)["errors"]
    assert error["field"] == field
    assert f"given in {guess}?" in error["allowed"]
    assert http.post("/v1/frf", json={**fields, "units_checked": True}).status_code == 200


def test_a_skin_without_an_adopted_model_is_not_found(http: httpx.Client) -> None:
    for path, good in (("/v1/frf", FRF), ("/v1/d33", D33)):
        answer = http.post(path, json={**good, "model": "adopted", "skin_id": "palm-3"})
        assert "'palm-3' has no adopted model" in problem_of(answer, 404)["detail"]


@pytest.mark.parametrize(
    ("body", "status", "says"),
    [
        (b"", 400, "header"),
        (b"a_over_h,rt_over_h\n", 400, "at least one row"),
        (b"a_over_h,rt_over_h\n0.3\n", 400, "on line 2"),
        (b"a_over_h,a_over_h\n0.3,0.3\n", 400, "twice"),
        (b"\xff\xfea", 400, "UTF-16"),
        (b'a_over_h,rt_over_h\n"0.3,0.6\n', 400, "CSV"),
        (b"a_over_h,rt_over_h\n0.3,0.6\n0.3,x\n", 422, "rt_over_h[1]"),
        (b"a_over_h,rt_over_h\n0.3,0.6\n0.3,x\n", 422, "must be a number (line 3)"),
        (b"a_over_h,rt_over_h\n0.3,NaN\n", 422, "rt_over_h[0]"),
        (b"a_over_h,rt_over_h,model\n0.3,0.6,layer\n0.3,0.6,half_space\n", 422, "model[1]"),
    ],
)
def test_csv_that_is_not_understood(http: httpx.Client, body: bytes, status: int, says: str) -> None:
    answer = http.post("/v1/sigma", content=body, headers={"Content-Type": "text/csv"})
    assert says in problem_of(answer, status)["detail"]


def test_nobody_expected_problem_traceback_log(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """What nobody expected is a problem with the traceback in the log."""
    with in_process(tmp_path) as service:

        @service.api.get("/fails")
        async def fails() -> None:
            raise ZeroDivisionError("a bug")

        async def ask() -> httpx.Response:
            async with service.client() as client:
                return await client.get("/fails")

        document = problem_of(asyncio.run(ask()), 500)
    assert "a bug" not in document["detail"]
    (record,) = [record for record in caplog.records if record.exc_info]
    assert getattr(record, "fields", {}) == {"request_id": document["request_id"]}
