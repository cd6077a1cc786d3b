"""σ over HTTP: the library's numbers on every path, row by row, in JSON and CSV."""

import math
from typing import Any
from urllib.parse import urlencode

import httpx
import numpy as np
import pytest

from tests.support.oracle import linear_layer_values
from underskin import load_table
from underskin.physics import half_space
from underskin.units import Floats

TABLE = load_table()
GENERATOR = np.random.default_rng(459)


def posted(http: httpx.Client, **columns: Any) -> dict[str, Any]:
    body = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in columns.items()}
    reply = http.post("/v1/sigma", json=body)
    assert reply.status_code == 200, reply.text
    answer: dict[str, Any] = reply.json()
    return answer


def floats(values: list[float | None]) -> Floats:
    return np.array(values, dtype=float)


def same(found: float | None, expected: float | None) -> bool:
    """Both null, or equal to rounding: single points are summed in another order than columns."""
    return found == (None if expected is None else pytest.approx(expected, rel=1e-13))


def random_points(count: int, beyond: float = 1.0) -> dict[str, Floats]:
    return {name: GENERATOR.uniform(low, high * beyond, count) for name, (low, high) in TABLE.domain.items()}


def test_one_point_is_the_same_alone_and_in_columns(http: httpx.Client) -> None:
    """Also where it is read differently: with `model` spelled out the API answers, without it the shorter path."""
    points = random_points(100, beyond=1.05)
    columns = posted(http, **points)
    for row in range(100):
        query = urlencode({name: float(values[row]) for name, values in points.items()})
        short, long = (http.get(f"/v1/sigma?{query}{more}").json() for more in ("", "&model=layer"))
        for alone in (short, long):
            assert same(alone["sigma"], columns["sigma"][row])
            assert alone["rel_error"] == columns["rel_error"][row]
            assert alone["status"] == columns["status"][row]
        assert list(short) == list(long)
    assert set(columns["status"]) == {"ok", "out_of_domain"}


PLAIN = ["0.3", "3", "0", "-0", "-0.0", "3e-1", "3E-1", "0.30", "1e400", "1e-400", "-1", "3.0000001", "4"]
ODD = ["00.3", ".3", "3.", "+0.3", "%2B0.3", "%30.3", "%200.3", "1_0", "0x1", "0,3", "０.３", "{}", "[0.3]", '"0.3"']
NONE = ["NaN", "nan", "Infinity", "-inf", "true", "null", ""]


@pytest.mark.parametrize("spelled", [*PLAIN, *ODD, *NONE])
def test_both_paths_read_a_number_alike(http: httpx.Client, spelled: str) -> None:
    query = f"/v1/sigma?rt_over_h=0.6&load_parameter=0.01&a_over_h={spelled}"
    short, long = http.get(query), http.get(f"{query}&model=layer")
    assert short.status_code == long.status_code
    if short.status_code == 200:
        assert same(short.json()["sigma"], long.json()["sigma"])
        assert short.json() | {"sigma": 0} == long.json() | {"sigma": 0}
    else:
        assert short.json()["errors"] == long.json()["errors"]


@pytest.mark.parametrize(
    "query",
    [
        "a_over_h=0.3&rt_over_h=0.6&a_over_h=0.5",
        "a_over_h=0.3&rt_over_h=0.6&",
        "&a_over_h=0.3&rt_over_h=0.6",
        "a_over_h=0.3&rt_over_h=0.6&load_parameter",
        "a_over_h=0.3&rt_over_h=0.6&depth=1",
        "a_over_h=0.3;rt_over_h=0.6",
        "a%5Fover%5Fh=0.3&rt_over_h=0.6",
        "a_over_h=0.3",
        "",
    ],
)
def test_both_paths_read_a_query_alike(http: httpx.Client, query: str) -> None:
    short, long = http.get(f"/v1/sigma?{query}"), http.get(f"/v1/sigma?model=layer&{query}")
    assert short.status_code == long.status_code
    if short.status_code == 200:
        assert same(short.json()["sigma"], long.json()["sigma"])
    else:
        assert short.json()["errors"] == long.json()["errors"]


def test_linear_limit_equals_the_exact_values(http: httpx.Client) -> None:
    rho, a, offset, value = linear_layer_values("sigma_hertz")
    used = (offset == 0) & (value > 0.01) & (a <= 3) & (rho <= 3)
    assert used.sum() > 50
    answer = posted(http, a_over_h=a[used], rt_over_h=rho[used], load_parameter=0)
    assert answer["sigma"] == pytest.approx(value[used], rel=1e-5)


def test_rows_outside_are_null_and_spoil_no_other(http: httpx.Client) -> None:
    a, rho, load = [0.3, 3.01, 0.3, 0.3, 1e308, 3.0], [0.6, 0.6, 3.01, 0.6, 0.6, 3.0], [0.01, 0.01, 0.01, 0.101, 0, 0.1]
    answer = posted(http, a_over_h=a, rt_over_h=rho, load_parameter=load)
    outside = [False, True, True, True, True, False]
    assert answer["status"] == ["out_of_domain" if row else "ok" for row in outside]
    for name in ("sigma", "rel_error"):
        assert [value is None for value in answer[name]] == outside
    for row in (0, 5):
        alone = posted(http, a_over_h=a[row], rt_over_h=rho[row], load_parameter=load[row])
        assert (alone["sigma"], alone["rel_error"]) == ([answer["sigma"][row]], [answer["rel_error"][row]])


def test_a_hundred_thousand_rows(http: httpx.Client) -> None:
    points = random_points(100_000, beyond=1.1)
    answer = posted(http, **points)
    expected = TABLE.sigma(**points)
    assert np.array_equal(floats(answer["sigma"]), expected.sigma, equal_nan=True)
    assert np.array_equal(floats(answer["rel_error"]), expected.rel_error, equal_nan=True)
    assert [status == "ok" for status in answer["status"]] == expected.inside.tolist()
    assert 60_000 < expected.inside.sum() < 90_000


@pytest.mark.parametrize("ends", ["\r\n", "\n"])
def test_csv_in_is_read_like_json(http: httpx.Client, ends: str) -> None:
    lines = [
        "\ufeffa_over_h, rt_over_h,load_parameter,model",
        "0.3,0.6,0.01,layer",
        "4,0.6,0,layer",
        '"1.7",6e-1,0,layer',
    ]
    reply = http.post("/v1/sigma", content=ends.join([*lines, ""]).encode(), headers={"Content-Type": "text/csv"})
    assert reply.status_code == 200, reply.text
    assert reply.json() == posted(http, a_over_h=[0.3, 4, 1.7], rt_over_h=0.6, load_parameter=[0.01, 0, 0])


def test_the_tables_route_describes_the_table(http: httpx.Client) -> None:
    table, *others = http.get("/v1/tables").json()["tables"]
    assert [other["name"] for other in others] == ["influence", "contact"]
    assert (table["name"], table["table_sha256"]) == ("sigma", TABLE.sha256)
    assert {axis["name"]: (axis["low"], axis["high"]) for axis in table["axes"]} == TABLE.domain
    assert [axis["nodes"] for axis in table["axes"]] == [len(axis) for axis in TABLE.axes]
    assert {"mesh", "solver", "material", "poisson_ratio"} <= set(table["about"])
    assert http.get("/ready").json() == {"status": "ready", "table_sha256": TABLE.sha256}


def test_the_half_space_ends_and_knows_no_strain(http: httpx.Client) -> None:
    beyond = math.nextafter(half_space.DOMAIN_END, math.inf)
    answer = posted(
        http, a_over_h=[10, beyond, 1, 1], rt_over_h=[10, 1, beyond, 1], load_parameter=9, model="half_space"
    )
    assert answer["status"] == ["ok", "out_of_domain", "out_of_domain", "ok"]
    assert answer["sigma"][1:3] == answer["rel_error"][1:3] == [None, None]
    assert answer["sigma"][3] == pytest.approx(float(half_space.sigma(1, 1)), rel=1e-12)
    query = urlencode({"a_over_h": 1, "rt_over_h": 1, "model": "half_space"})
    assert http.get(f"/v1/sigma?{query}").json()["sigma"] == pytest.approx(answer["sigma"][3], rel=1e-12)
