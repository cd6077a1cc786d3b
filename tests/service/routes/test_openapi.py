"""The OpenAPI document: complete, true, and nothing for schemathesis to find."""

import importlib
import json
import os
import pkgutil
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import jsonschema_rs
import pytest
from fastapi.routing import APIRoute

from bench.figures import Figure
from bench.soak import SOAK, record
from service import routes
from service.auth.keys import KeyStore
from tests.support.repository import ROOT
from tests.support.server import Server, running

UNITS = {"_mm": "mm", "_mpa": "MPa", "_n": "N", "_pc_per_n": "pC/N", "_hz": "Hz"}
# Generated clients name their functions after these: to change one breaks them.
OPERATIONS = {
    ("get", "/v1/sigma"): "sigma_one",
    ("post", "/v1/sigma"): "sigma_columns",
    ("post", "/v1/frf"): "frf_columns",
    ("post", "/v1/d33"): "d33_columns",
    ("post", "/v1/stress"): "stress",
    ("get", "/v1/field"): "field",
    ("post", "/v1/design"): "design",
    ("get", "/v1/tables"): "tables",
    ("post", "/v1/campaigns"): "post_campaigns",
    ("get", "/v1/campaigns"): "campaigns",
    ("get", "/v1/campaigns/{campaign_id}"): "campaign",
    ("get", "/v1/campaigns/{campaign_id}/document"): "campaign_document",
    ("get", "/v1/campaigns/{campaign_id}/d33"): "campaign_d33",
    ("post", "/v1/campaigns/{campaign_id}/withdraw"): "withdraw_campaign",
    ("post", "/v1/campaigns/{campaign_id}/exclusions"): "exclude_recording",
    ("post", "/v1/campaigns/{campaign_id}/diagnosis"): "diagnose_campaign",
    ("post", "/v1/skins/{skin_id}/diagnosis"): "diagnose_skin",
    ("post", "/v1/fleets/diagnosis"): "diagnose_fleet",
    ("get", "/v1/diagnoses"): "diagnoses",
    ("get", "/v1/diagnoses/{diagnosis_id}"): "diagnosis",
    ("delete", "/v1/diagnoses/{diagnosis_id}"): "cancel_diagnosis",
    ("get", "/v1/mechanisms"): "mechanisms",
    ("post", "/v1/mechanisms"): "keep_mechanism",
    ("delete", "/v1/mechanisms/{name}"): "discard_mechanism",
    ("get", "/v1/skins"): "skins",
    ("get", "/v1/skins/{skin_id}"): "skin",
    ("post", "/v1/skins/{skin_id}/join"): "join_skins",
    ("get", "/v1/skins/{skin_id}/history"): "skin_history",
    ("post", "/v1/skins/{skin_id}/model"): "adopt_model",
    ("delete", "/v1/skins/{skin_id}/model"): "withdraw_model",
    ("get", "/v1/skins/{skin_id}/model"): "skin_model",
    ("get", "/v1/skins/{skin_id}/model/versions"): "skin_model_versions",
    ("get", "/v1/skins/{skin_id}/export"): "export_skin",
    ("post", "/v1/skins/import"): "import_skin",
    ("patch", "/v1/campaigns/{campaign_id}"): "annotate_campaign",
    ("patch", "/v1/skins/{skin_id}"): "annotate_skin",
    ("post", "/v1/campaigns/{campaign_id}/discard"): "discard_campaign",
    ("post", "/v1/skins/{skin_id}/discard"): "discard_skin",
    ("get", "/v1/campaigns/{campaign_id}/changes"): "campaign_changes",
    ("get", "/v1/skins/{skin_id}/changes"): "skin_changes",
    ("post", "/v1/changes/{change_id}/undo"): "undo_change",
    ("get", "/umbridge/Info"): "umbridge_info",
    ("post", "/umbridge/ModelInfo"): "umbridge_model_info",
    ("post", "/umbridge/InputSizes"): "umbridge_input_sizes",
    ("post", "/umbridge/OutputSizes"): "umbridge_output_sizes",
    ("post", "/umbridge/Evaluate"): "umbridge_evaluate",
    ("post", "/umbridge/Gradient"): "umbridge_gradient",
    ("post", "/umbridge/ApplyJacobian"): "umbridge_apply_jacobian",
    ("post", "/umbridge/ApplyHessian"): "umbridge_apply_hessian",
    ("get", "/health"): "health",
    ("get", "/ready"): "ready",
    ("get", "/metrics"): "metrics",
    ("get", "/openapi.json"): "openapi",
}


@pytest.fixture(scope="module")
def document(http: httpx.Client) -> dict[str, Any]:
    answer: dict[str, Any] = http.get("/openapi.json").json()
    return answer


def operations(document: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            yield method, path, operation


def fields_of(schema: dict[str, Any], document: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The properties of an object, wherever it is defined."""
    if "$ref" in schema:
        schema = document["components"]["schemas"][schema["$ref"].rsplit("/", 1)[1]]
    fields: dict[str, dict[str, Any]] = schema.get("properties", {})
    return fields


def success_of(operation: dict[str, Any]) -> int:
    return next(int(status) for status in operation["responses"] if status.startswith("2"))


def test_operation_ids_are_stable(document: dict[str, Any]) -> None:
    assert {(method, path): operation["operationId"] for method, path, operation in operations(document)} == OPERATIONS


def test_every_route_of_the_application_is_in_the_document(document: dict[str, Any]) -> None:
    names = [found.name for found in pkgutil.walk_packages(routes.__path__, f"{routes.__name__}.")]
    routers = [router for name in names if (router := getattr(importlib.import_module(name), "router", None))]
    there = [route for router in routers for route in router.routes if isinstance(route, APIRoute)]
    told = {(method.lower(), route.path) for route in there for method in route.methods or ()}
    assert told == {(method, path) for method, path, _ in operations(document)}


def test_every_operation_is_described(document: dict[str, Any]) -> None:
    for method, path, operation in operations(document):
        place = f"{method} {path}"
        assert operation["summary"], place
        assert operation["description"], place
        assert operation["tags"], place
        success = operation["responses"][str(success_of(operation))]
        assert success["description"], place
        assert success["content"], place
        problem = "UmbridgeProblem" if path.startswith("/umbridge/") else "Problem"
        for status in ("4XX", "5XX"):
            (content,) = operation["responses"][status]["content"].values()
            assert content["schema"]["$ref"].endswith(f"/{problem}"), place


def test_every_field_is_described_with_its_unit(document: dict[str, Any]) -> None:
    described = 0
    for method, path, operation in operations(document):
        fields = {parameter["name"]: parameter for parameter in operation.get("parameters", [])}
        for content in (operation.get("requestBody", {}), *operation["responses"].values()):
            for media in content["content"].values() if content else []:
                fields |= fields_of(media.get("schema", {}), document)
        for name, field in fields.items():
            if name == "error":
                continue
            described += 1
            assert field.get("description"), f"{method} {path}: {name}"
            suffix = next((suffix for suffix in sorted(UNITS, key=len, reverse=True) if name.endswith(suffix)), None)
            if suffix is not None and path.startswith("/v1/"):
                assert f"[{UNITS[suffix]}]" in field["description"], f"{method} {path}: {name}"
    assert described > 60


def validator(schema: dict[str, Any], document: dict[str, Any]) -> jsonschema_rs.Draft202012Validator:
    """Of a schema that refers to the document's components."""
    return jsonschema_rs.Draft202012Validator(schema | {"components": document["components"]})


def examples(operation: dict[str, Any], document: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Media type and example of each body in text; one that has no example of its own has those of its fields."""
    for media_type, content in operation.get("requestBody", {}).get("content", {}).items():
        if content["schema"].get("format") == "binary":
            continue
        example = content.get("example")
        if example is None:
            fields = fields_of(content["schema"], document).items()
            example = {name: field["examples"][0] for name, field in fields if "examples" in field}
        if media_type == "application/json":
            validator(content["schema"], document).validate(example)
        yield media_type, example if isinstance(example, str) else json.dumps(example)


def query(operation: dict[str, Any]) -> dict[str, Any]:
    schemas = {parameter["name"]: parameter["schema"] for parameter in operation.get("parameters", [])}
    return {name: schema["examples"][0] for name, schema in schemas.items() if "examples" in schema}


def test_the_examples_are_accepted_and_answered_as_described(http: httpx.Client, document: dict[str, Any]) -> None:
    for method, path, operation in operations(document):
        if "{" in path or path in ("/v1/skins/import", "/v1/fleets/diagnosis"):
            continue  # about what is kept already: tests/service/store
        for media_type, body in [*examples(operation, document)] or [("", "")]:
            if media_type.startswith("multipart/"):  # which needs a boundary
                continue
            headers = {"Content-Type": media_type} if body else {}
            answer = http.request(method, path, params=query(operation), content=body, headers=headers)
            refused = path == "/umbridge/ApplyHessian"  # which these models do not support, and say so
            expected = 400 if refused else success_of(operation)
            assert answer.status_code == expected, f"{method} {path}: {answer.text}"
            promised = operation["responses"]["4XX" if refused else str(expected)]["content"]
            schema = promised[answer.headers["content-type"].split(";")[0]]["schema"]
            if answer.headers["content-type"] == "application/json":
                validator(schema, document).validate(answer.json())


def test_a_key_is_asked_for_in_the_document_where_one_is_needed(document: dict[str, Any], locked: Server) -> None:
    assert "security" not in document
    with httpx.Client(base_url=locked.url, headers=authorization(locked), timeout=300) as client:
        described = client.get("/openapi.json").json()
    assert described["security"] == [{"key": []}]
    assert described["components"]["securitySchemes"]["key"]["scheme"] == "bearer"
    for path in ("/health", "/ready"):
        assert described["paths"][path]["get"]["security"] == []
        assert httpx.get(locked.url + path).status_code == 200
    for method, path, operation in operations(described):
        if "security" not in operation:
            assert httpx.request(method, locked.url + path).status_code == 401, path


@pytest.fixture(scope="module")
def locked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that has a key."""
    folder = tmp_path_factory.mktemp("locked")
    (folder / "token").write_text(KeyStore(folder / "data").create("fuzzer", "write"))
    with running(folder) as started:
        yield started


def authorization(server: Server) -> dict[str, str]:
    return {"Authorization": f"Bearer {(server.log.parent / 'token').read_text()}"}


# In the soak each operation is a part, so that an interrupted one goes on with the next; then sequences of all of them.
PARTS = [*sorted(set(OPERATIONS.values()) - {"openapi"}), "sequences"] if SOAK else ["all"]
COUNTS = {False: 5000, True: 500} if SOAK else {False: 1}


# Behind keys the same code answers.
@pytest.mark.parametrize(
    "with_key", [False, pytest.param(True, marks=pytest.mark.soak)], ids=["without_keys", "with_keys"]
)
@pytest.mark.parametrize("part", PARTS)
def test_schemathesis_finds_nothing(
    shared_server: Server, locked: Server, with_key: bool, part: str, tmp_path: Path
) -> None:
    asked = locked if with_key else shared_server
    count = 100 if part == "sequences" else COUNTS[with_key]
    command = [
        *(sys.executable, "-m", "schemathesis.cli", "--config-file", str(ROOT / "schemathesis.toml")),
        *("run", f"{asked.url}/openapi.json", "--max-examples", str(count), "--seed", "20180208", "--no-color"),
    ]
    if with_key:
        command += ["--header", f"Authorization: {authorization(asked)['Authorization']}"]
    if part == "sequences":
        command += ["--phases", "stateful"]
    elif part != "all":
        command += ["--include-operation-id", part]
    else:  # the thousands of values at the limits of each field, and sequences of requests, are of the soak
        command += ["--phases", "examples,fuzzing"]
    hooks = {"SCHEMATHESIS_HOOKS": "tests.support.schemathesis_hooks", "PYTHONPATH": str(ROOT)} if SOAK else {}
    found = subprocess.run(command, cwd=tmp_path, env=os.environ | hooks, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout[-6000:] + found.stderr[-2000:]
    total = len(OPERATIONS) - 1  # all but the one that gives the document
    selected = total if part in ("all", "sequences") else 1
    assert f"{selected} selected / {total} total" in found.stdout, found.stdout
    assert asked.process.poll() is None
    if selected == 1:
        made = re.search(r"(\d+) generated, \1 passed", found.stdout)
        assert made, found.stdout
        path = next(path for (_, path), operation in OPERATIONS.items() if operation == part)
        which = "all, with keys" if with_key else path.removeprefix("/v1").split("/")[1]
        record(Figure(f"Made inputs, up to {count:,} a route: {which}", float(made[1]), ""))
