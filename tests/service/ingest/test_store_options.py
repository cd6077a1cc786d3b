"""What is said of campaigns beside them: in the query or as fields of the form, never ignored."""

from typing import Any

import httpx
import orjson
import pytest

from tests.support.store_server import Server, campaign

BACKEND = "sqlite"
Fields = list[tuple[str, Any]]


def send(server: Server, fields: dict[str, Any], query: str = "", **more: Any) -> httpx.Response:
    """A form with one campaign in it, on skin `own` by what it says itself, and the fields as `curl -F` sends them."""
    parts: Fields = [("file", ("monday.json", orjson.dumps(campaign("monday", id="own"))))]
    parts += [
        (name, (None, value)) for name, one in fields.items() for value in (one if isinstance(one, list) else [one])
    ]
    return server.http.post(f"/v1/campaigns{query}", files=parts, **more)


def refused(answer: httpx.Response) -> list[tuple[str, str]]:
    assert answer.status_code == 422, answer.text
    return [(error["field"], error["allowed"]) for error in answer.json()["errors"]]


def kept(answer: httpx.Response) -> dict[str, Any]:
    assert answer.status_code == 201, answer.text
    (entry,) = answer.json()["campaigns"]
    return dict(entry)


def test_every_option_of_the_query_is_a_field_of_the_form_too(server: Server) -> None:
    first = kept(send(server, {"skin": "palm-3"}))
    assert first["skin_id"] == "palm-3"
    second = kept(send(server, {"corrects": first["id"], "reason": "cable", "together": "Monday"}))
    detail = server.http.get(f"/v1/campaigns/{second['id']}").json()
    assert (detail["corrects"], detail["correct_reason"], detail["name"]) == (first["id"], "cable", "Monday")
    spoilt = campaign("spoilt")
    spoilt["recordings"][0]["preload_n"] = -1.0
    files: Fields = [("file", ("a.json", orjson.dumps(spoilt))), ("all_or_nothing", (None, "true"))]
    answer = server.http.post("/v1/campaigns", files=files)
    assert answer.status_code == 422, answer.text
    assert kept(server.http.post("/v1/campaigns", files=files[:1]))["status"] == "ok"


@pytest.mark.parametrize(
    ("fields", "query", "field", "says"),
    [
        (
            {"skn": "palm-3"},
            "",
            "skn",
            "did you mean skin? Known: skin, corrects, reason, all_or_nothing, together, estimator, file",
        ),
        ({"campaign": "x"}, "?skin=palm-3", "campaign", "is not a form field of this request"),
        ({"skin": ["a", "b"]}, "", "skin", "must be given once"),
        ({"skin": "a"}, "?skin=b", "skin", "must be 'b', as in the query, or be given once"),
        ({"all_or_nothing": "perhaps"}, "", "all_or_nothing", "must be true or false"),
        ({"reason": "x" * 5000, "corrects": "c-1"}, "", "reason", "at most 4096 bytes"),
        ({"skin": b"\xff"}, "", "skin", "must be text in UTF-8"),
        ({"skin": "a/b"}, "", "skin", "without /"),
        ({"reason": "cable"}, "", "corrects", "corrects and reason go together"),
        ({"rig": ["a: 1", "b: 1"]}, "", "rig", "must be given once"),
    ],
)
def test_what_a_form_says_is_never_ignored(
    server: Server, fields: dict[str, Any], query: str, field: str, says: str
) -> None:
    ((name, allowed),) = refused(send(server, fields, query))
    assert name == field
    assert says in allowed
    assert server.http.get("/v1/campaigns").json()["campaigns"] == []


def test_an_option_is_no_file(server: Server) -> None:
    files: Fields = [("skin", ("palm-3.json", orjson.dumps(campaign("monday"))))]
    assert refused(server.http.post("/v1/campaigns", files=files)) == [("skin", "must be a text, not a file")]
    other: Fields = [("any name", ("palm-3.json", orjson.dumps(campaign("monday"))))]
    assert kept(server.http.post("/v1/campaigns?skin=palm-3", files=other))["skin_id"] == "palm-3"


def test_an_option_is_the_same_request_in_query_and_form(server: Server) -> None:
    headers = {"Idempotency-Key": "monday"}
    first = send(server, {"skin": "palm-3"}, headers=headers)
    again = send(server, {}, "?skin=palm-3", headers=headers)
    assert kept(again) == kept(first)
    assert again.headers["Idempotency-Replayed"] == "true"
    other = send(server, {"skin": "palm-4"}, headers=headers)
    assert (other.status_code, "used for another request" in other.json()["detail"]) == (422, True)


def test_an_import_takes_no_fields(server: Server) -> None:
    send(server, {"skin": "palm-3"})
    exported = server.http.get("/v1/skins/palm-3/export").content
    parts: Fields = [("file", ("palm-3.h5", exported)), ("skin", (None, "palm-4"))]
    ((name, allowed),) = refused(server.http.post("/v1/skins/import", files=parts))
    assert (name, "is not a form field of this request" in allowed) == ("skin", True)
    assert server.http.post("/v1/skins/import", files=parts[:1]).json() == {
        "skin_id": "palm-3", "kept": 0, "present": 1,
    }  # fmt: skip
