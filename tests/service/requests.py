"""Requests that the service answers, its routes, and problems that it tells."""

from typing import Any

import httpx

from service.problems import Problem

SIGMA: dict[str, Any] = {"a_over_h": [0.3, 0.6], "rt_over_h": 0.6}
FRF: dict[str, Any] = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
    "preload_n": [1.0, 3.0],
    "d33_pc_per_n": 14.0,
}
D33: dict[str, Any] = {**{name: FRF[name] for name in FRF if name != "d33_pc_per_n"}, "frf_pc_per_n": [6.8, 11.0]}


def problem_of(answer: httpx.Response, status: int) -> dict[str, Any]:
    """The problem document, after checking the shape that all have."""
    assert answer.status_code == status, answer.text
    if answer.request.url.path.startswith("/umbridge/"):
        error = answer.json()
        assert answer.headers["content-type"] == "application/json"
        assert set(error) == {"error"}
        assert set(error["error"]) == {"type", "message"}
        assert error["error"]["type"].isalpha()
        return dict(error["error"])
    document: dict[str, Any] = answer.json()
    assert answer.headers["content-type"] == "application/problem+json"
    assert set(document) == set(Problem.model_fields)
    Problem.model_validate(document)
    assert document["status"] == status
    assert document["type"].startswith("urn:underskin:problem:")
    assert document["request_id"] == answer.headers["x-request-id"]
    assert document["title"]
    assert document["detail"]
    return document


def all_routes(http: httpx.Client, headers: dict[str, str] | None = None) -> list[tuple[str, str]]:
    """Method and path of every route there is."""
    paths = http.get("/openapi.json", headers=headers).json()["paths"]
    routes = [(method.upper(), path) for path, methods in paths.items() for method in methods]
    assert len(routes) >= 15
    return routes
