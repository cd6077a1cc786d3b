"""Connections on which requests are sent byte by byte."""

import json
import socket
from typing import Any

import httpx
import pytest

from tests.service.requests import D33, FRF, SIGMA
from tests.support.server import Server

HEAD = "Host: localhost\r\nContent-Type: application/json\r\n"
BODIES: dict[str, dict[str, Any]] = {
    "/v1/sigma": SIGMA,
    "/v1/frf": FRF,
    "/v1/d33": D33,
    "/umbridge/Evaluate": {"name": "sigma", "input": [[0.3, 0.6, 0.01]]},
    "/umbridge/Gradient": {"name": "sigma", "input": [[0.3, 0.6, 0.01]], "sens": [1.0]},
}


def connect(server: Server) -> socket.socket:
    """A connection on which a test may say what no honest client would."""
    return socket.create_connection(("127.0.0.1", httpx.URL(server.url).port or 0), timeout=300)


def read_answer(connection: socket.socket) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of the next answer."""
    received = b""
    while b"\r\n\r\n" not in received:
        received += connection.recv(1) or pytest.fail(f"closed after {received!r}")
    status, *lines = received.decode().split("\r\n")
    headers = {name.lower(): value for name, value in (line.split(": ", 1) for line in lines if line)}
    body = b""
    while len(body) < int(headers.get("content-length", 0)):
        body += connection.recv(1) or pytest.fail(f"closed after {body!r}")
    return int(status.split()[1]), headers, body


def assert_too_large(answer: tuple[int, dict[str, str], bytes]) -> None:
    """The 413 of every other test, read from a raw connection."""
    status, headers, body = answer
    problem = json.loads(body)
    assert (status, headers["content-type"]) == (413, "application/problem+json")
    assert (problem["type"], problem["request_id"]) == ("urn:underskin:problem:body-too-large", headers["x-request-id"])
