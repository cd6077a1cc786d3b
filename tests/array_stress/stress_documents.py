"""What the tests send to /v1/stress and its command."""

from typing import Any

import httpx

Document = dict[str, Any]


SKIN: Document = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "d33_pc_per_n": 14.0,
    "sensors": [{"id": f"s{i}", "x_mm": 8.0 * i, "y_mm": 0.0} for i in range(5)],
}

PRESS: Document = {"x_mm": 8.0, "y_mm": 0.0, "indenter_radius_mm": 4.0, "normal_force_n": 1.0}


def document(*contacts: Document, **fields: Any) -> Document:
    return {**SKIN, "contacts": list(contacts), **fields}


def posted(http: httpx.Client, request: Document) -> Document:
    reply = http.post("/v1/stress", json=request)
    assert reply.status_code == 200, reply.text
    found: Document = reply.json()
    return found
