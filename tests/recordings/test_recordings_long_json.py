"""Long JSON documents, whose lists of numbers become arrays: refused where the same in short is."""

import io
import json
from typing import Any

import pytest

from tests.support.store_server import campaign
from underskin.errors import InvalidInput
from underskin.recordings.campaign import from_dict
from underskin.recordings.readers import long_json

NUMBERS = [1.5] * 100


def read(body: str) -> dict[str, Any]:
    return long_json.read(io.BytesIO(body.encode()), "1000000", "1000")


def test_a_list_in_place_of_a_schema_is_refused() -> None:
    document = read(json.dumps({**campaign("array"), "schema": NUMBERS}))["document"]
    with pytest.raises(InvalidInput, match="campaign/1"):
        from_dict(document)


def test_a_list_in_place_of_a_kind_refuses_its_recording() -> None:
    sent = campaign("array")
    first, second, *_ = sent["recordings"]
    document = read(json.dumps({**sent, "recordings": [{**first, "kind": NUMBERS}, second]}))["document"]
    read_campaign, problems = from_dict(document)
    assert [recording.id for recording in read_campaign.recordings] == [second["id"]]
    assert [problem.field for problem in problems] == ["kind"]


@pytest.mark.parametrize("colon", [":", " \n:"])
def test_a_list_in_place_of_a_key_is_no_json(colon: str) -> None:
    line, column, _ = read(f'{{"a": 1,\n{NUMBERS}{colon} 3}}')["invalid"]
    assert (line, column) == (2, 1)


def test_a_list_behind_a_key_becomes_an_array() -> None:
    assert read(f'{{"a": {NUMBERS}, "b": ":"}}')["document"]["a"].tolist() == NUMBERS
