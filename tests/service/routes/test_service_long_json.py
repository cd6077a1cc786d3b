"""Long bodies of JSON, whose columns are read as arrays, are answered and refused as the same in short."""

import json
from typing import Any

import httpx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

LONG = 20_000  # bytes


def both(http: httpx.Client, path: str, body: bytes) -> list[dict[str, Any]]:
    """Status and document of the answer to a body, and to the same with many blanks after it."""
    answers = []
    for sent in (body, body.ljust(LONG)):
        answer = http.post(path, content=sent, headers={"Content-Type": "application/json"})
        answers.append({"status_code": answer.status_code, **answer.json()})
        answers[-1].pop("request_id", None)
    return answers


def sigma(a: str, rest: str = "") -> bytes:
    return f'{{"a_over_h": {a}, "rt_over_h": 0.6{rest}}}'.encode()


@pytest.mark.parametrize(
    "body",
    [
        sigma("[0.3, 0.6]"),
        sigma("[0, 1, -0, -0.0, 3e0, 1e-400]"),
        sigma("[0.1, 0.30000000000000004, 2.2250738585072011e-308, 0.5000000000000000277555756156289135]"),
        sigma("[9007199254740993, 18446744073709551615, 18446744073709551616, 1]"),
        sigma("[1e400, 1]"),
        sigma("[1" + "0" * 400 + "]"),
        sigma("0.3", ', "load_parameter": [0.01, 0.02], "model": "layer"'),
        sigma("[0.3, NaN]"),
        sigma("[0.3, null]"),
        sigma('[0.3, "0.6"]'),
        sigma("[[0.3, 0.6]]"),
        sigma("[[], [0.3, 0.6]]"),
        sigma("[0.3, {}]"),
        sigma("[]"),
        sigma('{"a": [0.3]}'),
        sigma("[0.3, 0.6]", ', "load_parameter": [0.1, 0.1, 0.1]'),
        sigma("[0.3, 0.6]", ', "model": "sphere"'),
        sigma("[0.3, 0.6]", ', "loads[0]": 0.1'),
        sigma("[0.3, 0.6]", ', "a_over_h": [0.3, 0.7]'),
        sigma("[0.3, 0.6]", ', "a\\u005fover_h": [0.3, 0.7]'),
        sigma("[0.3, 0.6]", ', "\\ud800": 1'),
        sigma("[0.3, 0.6]", ","),
        sigma("[0.3, 0.6]") + b"}",
        b" \n" + sigma("[0.3, 0.6]"),
        b"\xef\xbb\xbf" + sigma("[0.3, 0.6]"),
        sigma("[0.3, 0.6]", ', "é": 1').decode().encode("latin-1"),
        sigma("[0.3, 0.6]").decode().encode("utf-16"),
        b"[0.3, 0.6]",
        b"{}",
    ],
)
def test_sigma(http: httpx.Client, body: bytes) -> None:
    short, long = both(http, "/v1/sigma", body)
    assert long == short


NUMBERS = st.one_of(st.floats(), st.integers(-(2**70), 2**70), st.floats(0, 3))
ODD: st.SearchStrategy[Any] = st.one_of(
    st.none(), st.booleans(), st.text(max_size=3), st.lists(NUMBERS, max_size=2), st.just({})
)
VALUES = st.one_of(
    st.floats(0, 3),
    st.lists(st.floats(0, 3), min_size=2, max_size=2),
    st.lists(st.one_of(NUMBERS, ODD), max_size=3),
    ODD,
)
NAMES = st.sampled_from(["a_over_h", "rt_over_h", "load_parameter", "model", "other"])


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(entries=st.lists(st.tuples(NAMES, VALUES), max_size=5))
def test_any_document(http: httpx.Client, entries: list[tuple[str, Any]]) -> None:
    body = "{" + ", ".join(f"{json.dumps(name)}: {json.dumps(value)}" for name, value in entries) + "}"
    short, long = both(http, "/v1/sigma", body.encode())
    assert long == short
