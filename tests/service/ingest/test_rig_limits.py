"""A rig description that comes with files: short, and its errors name field, value and what is allowed."""

import pytest

from tests.service.requests import problem_of
from tests.support.store_server import Server

BACKEND = "sqlite"
CURVE = b"depth;load\n0;0\n100;2\n200;3"
RIG = """schema: rig/1
kind: indentation
skin: {id: gel, poisson_ratio: 0.5}
recording: {indenter_radius_mm: 2.5}
channels:
  displacement_mm: {channel: depth, unit: um}
  force_n: {channel: load, unit: mN}
"""


@pytest.mark.parametrize(
    ("rig", "field", "value", "allowed"),
    [
        (RIG + "#" * (64_001 - len(RIG)), "rig", "my.yaml", "has 64001 bytes; a rig description may have up to 64000"),
        (RIG + "#" * 1_000_000, "rig", "my.yaml", "a rig description may have up to 64000"),
        (RIG + "[" * 50_000, "rig", "my.yaml", "not YAML: "),
        (RIG.replace("indentation", "indenting"), "my.yaml: kind", "indenting", "must be one of"),
        (RIG.replace("unit: um", "unit: um, sign: 2"), "my.yaml: channels.displacement_mm.sign", 2, "must be"),
    ],
    ids=["too long", "far too long", "nested", "a wrong kind", "a wrong sign"],
)
def test_what_is_wrong_with_it_is_said(server: Server, rig: str, field: str, value: object, allowed: str) -> None:
    files = [("file", ("curve.csv", CURVE)), ("rig", ("my.yaml", rig.encode()))]
    (error,) = problem_of(server.http.post("/v1/campaigns", files=files), 422)["errors"]
    assert (error["field"], error["value"]) == (field, value)
    assert allowed in error["allowed"]


def test_one_of_64_kb_is_read(server: Server) -> None:
    rig = RIG + "".join(f"#{number}\n" for number in range(20_000))[: 64_000 - len(RIG)]
    files = [("file", ("curve.csv", CURVE)), ("rig", ("my.yaml", rig.encode()))]
    assert server.http.post("/v1/campaigns", files=files).status_code == 201
