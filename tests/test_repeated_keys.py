"""A key that comes twice in one object of a JSON or YAML document is refused, wherever such a document comes in."""

import json
from pathlib import Path
from typing import Any

import httpx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.soak import SOAK
from tests.support import preloaded
from tests.support.repository import ROOT
from underskin.errors import FileError
from underskin.recordings import rig_description
from underskin.recordings.readers.json_file import repeated_key

EXAMPLES = ROOT / "examples" / "formats"
CAMPAIGN = (EXAMPLES / "template.json").read_text()
TWICE = CAMPAIGN.replace('"thickness_mm"', '"thickness_mm": 5,\n "thickness_mm"', 1)

KEYS = st.sampled_from(["a", "b", '"', "\\", 'x":{', "é", "\u2028", "}", ""])
LEAVES = st.one_of(st.integers(), st.booleans(), st.none(), KEYS)
# An object as the list of its entries, in which a key may come again.
DOCUMENTS = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4).map(lambda items: ("list", items)),
        st.lists(st.tuples(KEYS, inner), max_size=4).map(lambda items: ("object", items)),
    ),
    max_leaves=25,
)


def written(document: Any, blank: str, ascii_only: bool) -> str:
    """A document of DOCUMENTS as JSON."""
    match document:
        case ("list", items):
            return "[" + f"{blank},".join(written(item, blank, ascii_only) for item in items) + blank + "]"
        case ("object", items):
            entries = [
                f"{blank}{json.dumps(key, ensure_ascii=ascii_only)}{blank}:{written(value, blank, ascii_only)}"
                for key, value in items
            ]
            return "{" + ",".join(entries) + blank + "}"
        case _:
            return json.dumps(document, ensure_ascii=ascii_only)


def has_repeated(text: str) -> bool:
    """The same by Python's own parser, which hands over every entry."""
    repeated = []

    def entries(pairs: list[tuple[str, Any]]) -> None:
        repeated.append(len(dict(pairs)) < len(pairs))

    json.loads(text, object_pairs_hook=entries)
    return any(repeated)


@pytest.mark.slow
@settings(max_examples=300 if SOAK else 100)
@given(DOCUMENTS, st.sampled_from(["", " ", "\n\t "]), st.booleans(), st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]))
def test_a_repeated_key_is_seen_wherever_it_is(document: Any, blank: str, ascii_only: bool, encoding: str) -> None:
    text = written(document, blank, ascii_only)
    assert (repeated_key(text.encode(encoding)) is not None) == has_repeated(text)


@pytest.mark.parametrize(
    ("text", "key", "line", "column"),
    [
        ('{"a": 1, "a": 2}', "a", 1, 10),
        ('{"é": [{"b": "\\"{"}, {"b": 1}],\n "ü": 1, "\\u00e9": 2}', "é", 2, 10),
        ('[{"a": {}, "b": {"a": 1},\r\n"c": {"x": 1, "y": {}, "x": 2}}]', "x", 2, 24),
    ],
)
def test_its_line_and_column_are_told(text: str, key: str, line: int, column: int) -> None:
    assert repeated_key(text.encode()) == (key, f"line {line}, column {column}")


def test_every_route_that_takes_json_refuses_a_repeated_key(http: httpx.Client) -> None:
    paths = http.get("/openapi.json").json()["paths"]
    routes = [
        (method, path.replace("{", "").replace("}", ""))
        for path, operations in paths.items()
        for method, operation in operations.items()
        if "application/json" in operation.get("requestBody", {}).get("content", {})
    ]
    assert {"/v1/sigma", "/v1/campaigns", "/v1/skins/skin_id/join", "/umbridge/Evaluate"} <= {
        path for _, path in routes
    }
    for method, path in routes:
        body = '{"name": "a",\n "name": "b"}'
        answer = http.request(method, path, content=body, headers={"Content-Type": "application/json"})
        assert answer.status_code == (400 if path.startswith("/umbridge") else 422), (path, answer.text)
        assert "must be given once in its object; it comes again at line 2, column 2" in answer.text, path


def test_um_bridge_tells_it_in_its_own_shape(http: httpx.Client) -> None:
    body = '{"name": "sigma", "input": [[0.3, 0.6, 0.01]], "input": [[0.3, 0.6, 0.05]]}'
    answer = http.post("/umbridge/Evaluate", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 400
    assert answer.json()["error"]["type"] == "InvalidInput"
    assert "it comes again at line 1, column 48" in answer.json()["error"]["message"]


def test_a_form_tells_it_of_its_file(http: httpx.Client) -> None:
    answer = http.post("/v1/campaigns", files=[("file", ("monday.json", TWICE.encode()))])
    (error,) = answer.json()["errors"]
    assert answer.status_code == 422
    assert (error["field"], error["value"]) == ("thickness_mm", None)
    assert error["allowed"].startswith("is given twice: must be given once in its object; it comes again at line ")


def test_a_problem_says_what_comes_twice(http: httpx.Client) -> None:
    body = '{"thickness_mm": 2.5, "thickness_mm": 5}'
    problem = http.post("/v1/frf", content=body, headers={"Content-Type": "application/json"}).json()
    said = "is given twice: must be given once in its object; it comes again at line 1, column 23"
    assert problem["detail"] == f"thickness_mm {said}"
    assert problem["errors"] == [
        {"code": "not_unique", "field": "thickness_mm", "index": None, "value": None, "allowed": said}
    ]


@pytest.mark.slow
def test_the_command_line_names_file_line_and_column(tmp_path: Path) -> None:
    (tmp_path / "monday.json").write_text(TWICE)
    found = preloaded.run("d33", "monday.json", folder=tmp_path)
    assert found.returncode == 2
    line = TWICE[: TWICE.rindex('"thickness_mm"')].count("\n") + 1
    expected = f"monday.json: line {line}, column 2: the key 'thickness_mm' must be given once in its object"
    assert expected in found.stderr


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("schema: rig/1\nskin: {thickness_mm: 8,\n  thickness_mm: 9}\n", r"line 3: .*'thickness_mm' \(column 3\)"),
        ("schema: rig/1\nkind: frf\nschema: rig/1\n", r"line 3: .*'schema' \(column 1\)"),
        ('{"schema": "rig/1",\n "kind": "frf", "kind": "indentation"}', "line 2, column 17: the key 'kind'"),
    ],
)
def test_a_rig_description_has_each_key_once(text: str, place: str) -> None:
    with pytest.raises(FileError, match=rf"rig\.yaml: {place}.* must be given once"):
        rig_description.parse(text.encode(), "rig.yaml")
