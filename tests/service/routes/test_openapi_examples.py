"""Every request and every answer of the OpenAPI document has an example: valid, and what a real server answers."""

from collections.abc import Iterator
from typing import Any

import httpx
import jsonschema_rs
import orjson
import pytest

from scripts.openapi_examples import FILE
from service.schemas.report import Report
from tests.support.document_schemas import closed

STORED = orjson.loads(FILE.read_bytes())
# Without an example: arrays and files, and answers that are the document itself or never come.
WORKBOOKS = (
    "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    "application/vnd.ms-excel.sheet.macroEnabled.12",
)
BINARY = ("application/x-npz", "application/x-hdf5", "application/octet-stream", *WORKBOOKS)
NO_ANSWER = ("openapi", "umbridge_apply_hessian")


@pytest.fixture(scope="module")
def document(http: httpx.Client) -> dict[str, Any]:
    described: dict[str, Any] = http.get("/openapi.json").json()
    return described


def operations(document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for methods in document["paths"].values():
        yield from methods.values()


def contents(operation: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Where, media type and content of each body of an operation."""
    for media_type, content in operation.get("requestBody", {}).get("content", {}).items():
        yield "request", media_type, content
    for status, answer in operation["responses"].items():
        for media_type, content in answer["content"].items():
            yield status, media_type, content


def test_every_request_and_every_answer_has_a_valid_example(document: dict[str, Any]) -> None:
    checked = 0
    for operation in operations(document):
        for where, media_type, content in contents(operation):
            place = f"{operation['operationId']} {where} {media_type}"
            if "example" not in content:
                never = operation["operationId"] in NO_ANSWER and where.startswith("2")
                assert never or media_type in BINARY, place
            elif media_type.endswith("json"):
                checked += 1
                schema = content["schema"] | {"components": document["components"]}
                jsonschema_rs.Draft202012Validator(schema).validate(content["example"])
    assert checked > 120


def test_every_parameter_that_is_required_has_an_example(document: dict[str, Any]) -> None:
    required = [
        parameter
        for operation in operations(document)
        for parameter in operation.get("parameters", [])
        if parameter["required"]
    ]
    assert len(required) > 20
    assert [parameter["name"] for parameter in required if "example" not in parameter] == []


def test_every_property_of_every_schema_is_described(document: dict[str, Any]) -> None:
    described = 0
    for name, schema in document["components"]["schemas"].items():
        assert schema.get("description"), name
        for own, entry in schema.get("properties", {}).items():
            described += 1
            assert "$ref" in entry or entry["description"], f"{name}.{own}"
    assert described > 500


def test_example_report_valid() -> None:
    """The report of the example is a `report/1`, without further fields."""
    report = STORED["diagnosis"]["answer"]["report"]
    jsonschema_rs.Draft202012Validator(closed(Report.model_json_schema())).validate(report)
