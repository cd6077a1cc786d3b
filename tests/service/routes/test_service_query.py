"""The query string of every route: what the route does not know is refused by name, and so is what is given twice."""

import httpx
import pytest

SIGMA = "/v1/sigma?a_over_h=0.3&rt_over_h=0.6"


def errors(answer: httpx.Response) -> list[tuple[str, str]]:
    assert answer.status_code == 422, answer.text
    return [(error["field"], error["allowed"]) for error in answer.json()["errors"]]


def test_every_route_refuses_parameter_not_know(http: httpx.Client) -> None:
    """Every route refuses a parameter that it does not know, and names those that the document has."""
    paths = http.get("/openapi.json").json()["paths"]
    asked = [(method, path) for path in paths if path.startswith("/v1/") for method in paths[path]]
    assert len(asked) > 25
    for method, path in asked:
        address = path.replace("{", "").replace("}", "")
        answer = http.request(method, address, params={"nonsense": "1"}, json={} if method == "post" else None)
        stated = [one["name"] for one in paths[path][method].get("parameters", ()) if one["in"] == "query"]
        ((name, allowed),) = errors(answer)
        assert name == "nonsense", (method, path)
        assert allowed.endswith(f"Known: {', '.join(stated)}" if stated else "which has none"), (method, path)


@pytest.mark.parametrize(
    ("request_line", "field", "says"),
    [
        ("POST /v1/campaigns?skn=palm-3", "skn", "did you mean skin? Known: skin, corrects, reason, all_or_nothing"),
        ("POST /v1/campaigns?all_or_nothing=maybe", "all_or_nothing", "must be true or false"),
        ("POST /v1/campaigns?All_or_nothing=true", "All_or_nothing", "did you mean all_or_nothing?"),
        ("GET /v1/campaigns?recorded=2017", "recorded", "did you mean recorded_to?"),
        ("GET /v1/skins/a/history?modell=adopted", "modell", "did you mean model? Known: model"),
        ("DELETE /v1/skins/a/model?reason=wrong&why=x", "why", "Known: reason"),
        ("GET /v1/tables?x=1", "x", "is not a query parameter of this request, which has none"),
        (f"GET {SIGMA}&a=1", "a", "Known: a_over_h, rt_over_h, load_parameter, model"),
    ],
)
def test_a_slip_is_told_with_what_was_meant(http: httpx.Client, request_line: str, field: str, says: str) -> None:
    method, address = request_line.split()
    ((name, allowed),) = errors(http.request(method, address))
    assert name == field
    assert says in allowed


@pytest.mark.parametrize(
    ("request_line", "field"),
    [
        ("POST /v1/campaigns?skin=palm-3&skin=palm-4", "skin"),
        ("GET /v1/campaigns?limit=2&limit=2", "limit"),
        (f"GET {SIGMA}&rt_over_h=0.7", "rt_over_h"),
    ],
)
def test_a_parameter_is_given_once(http: httpx.Client, request_line: str, field: str) -> None:
    method, address = request_line.split()
    assert errors(http.request(method, address)) == [(field, "must be given once")]
