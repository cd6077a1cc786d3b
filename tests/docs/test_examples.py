"""The examples, run as they stand against a running service, and the bytes of the LabVIEW recipe."""

import json
import os
import re
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest

from tests.support.repository import ROOT
from tests.support.server import running
from tests.support.shown import is_as_shown
from underskin import Client, load_table
from underskin.inversion.invert import invert
from underskin.recordings import read_file
from underskin.units import to_lab

EXAMPLES = ROOT / "examples"
LABVIEW = (ROOT / "docs" / "labview.md").read_text(encoding="utf-8")

needs_octave = pytest.mark.skipif(shutil.which("octave-cli") is None, reason="GNU Octave is not installed")
needs_curl = pytest.mark.skipif(shutil.which("curl") is None, reason="curl is not installed")


def run(command: list[str], url: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """An example, as a user runs it in its folder."""
    environment = {**os.environ, "UNDERSKIN_URL": url, **environment}
    return subprocess.run(command, cwd=EXAMPLES, env=environment, capture_output=True, text=True)


@needs_curl
def test_curl(server_url: str) -> None:
    answer = run(["./curl.sh"], server_url)
    assert answer.returncode == 0, answer.stderr
    (sigma,) = re.findall(r'"sigma":([0-9.e-]+)', answer.stdout)
    assert float(sigma) == pytest.approx(0.936505, abs=1e-6)
    assert '"status":["ok","ok","ok","out_of_domain"]' in answer.stdout
    assert re.search(
        r"d33_uncertainty_pc_per_n,limit,status\r?\n.*,14\.00.*,0\.189.*,ok\r?\n.*,22\.04.*,0\.191.*,ok", answer.stdout
    )


def test_python_client(server_url: str) -> None:
    answer = run([sys.executable, "python_client.py"], server_url)
    assert answer.returncode == 0, answer.stderr
    assert "1.0 N: FRF 7.396 pC/N, mean stress on the sensor 0.0747 MPa" in answer.stdout
    assert "d33 = 14.01 ± 0.19 pC/N\nd33 = 22.05 ± 0.19 pC/N\nrefused: preload_n = -1.0" in answer.stdout


@needs_octave
@needs_curl
def test_octave(server_url: str) -> None:
    answer = run(["octave-cli", "octave_frf.m"], server_url)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.split("\n") == [
        "  0.5 N: FRF 7.424 pC/N, ok",
        "  1.0 N: FRF 7.396 pC/N, ok",
        "  2.0 N: FRF 7.347 pC/N, ok",
        "  3.0 N: FRF 7.303 pC/N, ok",
        "300.0 N: FRF NaN pC/N, out_of_domain",
        "d33 = 14.01 +- 0.19 pC/N, ok",
        "d33 = 22.05 +- 0.19 pC/N, ok",
        "",
    ]


@needs_octave
@needs_curl
def test_octave_shows_why_it_is_refused(server_url: str, tmp_path: Path) -> None:
    script = (
        "underskin_post ([getenv('UNDERSKIN_URL') '/v1/sigma'], '{\"a_over_h\": -1}', 'application/json', 'text/csv')"
    )
    answer = run(["octave-cli", "--eval", script], server_url, TMPDIR=str(tmp_path), UNDERSKIN_API_KEY="unused")
    assert answer.returncode == 1
    assert "rt_over_h" in answer.stderr
    assert "is required" in answer.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def store_url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A server whose store the examples fill."""
    with running(tmp_path_factory.mktemp("store")) as started:
        yield started.url


@needs_curl
def test_curl_sends_campaigns(store_url: str) -> None:
    first, again = (run(["./curl_campaigns.sh"], store_url) for _ in range(2))
    assert first.returncode == 0, first.stderr
    assert again.stdout == first.stdout  # kept once
    batch, d33, history = map(json.loads, first.stdout.splitlines()[1::2])
    kept = [[entry["status"] for entry in one["recordings"]].count("ok") for one in batch["campaigns"]]
    assert kept == [16, 16, 16, 16, 15]
    (refused,) = (entry for entry in batch["campaigns"][4]["recordings"] if entry["status"] == "refused")
    assert refused["errors"][0]["field"] == "preload_n"
    assert d33["campaign_id"] == batch["campaigns"][4]["id"]
    assert [len(sensor["points"]) for sensor in history["sensors"]] == [5, 5, 5, 5]
    assert [sensor["trend"]["significant"] for sensor in history["sensors"]] == [False, False, True, False]


def test_python_sends_campaigns(store_url: str) -> None:
    answer = run([sys.executable, "python_campaigns.py"], store_url)
    assert answer.returncode == 0, answer.stderr
    assert "2017-09.csv: 15 of 16 recordings kept\n  s02 4 mm 2 N: preload_n = -2.0: must be" in answer.stdout
    assert "palm 3 in 2017-09 (simulated): d33 13.07 ± 1.61 pC/N\n  s01: 14.01 ± 0.14 pC/N" in answer.stdout
    # s03 loses 8 % of 13.7 pC/N a month
    (slope,) = re.findall(r"s03: (\S+) pC/N a year, a trend", answer.stdout)
    assert float(slope) == pytest.approx(-0.08 * 13.7 * 12, abs=1.0)
    with Client(store_url) as client:
        assert len(list(client.campaigns.all(skin="python-palm"))) == 5


@needs_octave
@needs_curl
def test_octave_sends_campaigns(store_url: str) -> None:
    answer = run(["octave-cli", "octave_campaigns.m"], store_url)
    assert answer.returncode == 0, answer.stderr
    assert "2017-07-03 r1: ok\n2017-07-03 r2: refused\n  preload_n = -1: must be" in answer.stdout
    assert "d33 of the array = 14.27 +- 0.70 pC/N\n" in answer.stdout
    assert "s01: 14.07 14.01 13.85 pC/N\ns02: 14.47 14.49 pC/N\n" in answer.stdout


@pytest.mark.parametrize("month", ["05.csv", "06.csv", "07.json", "08.csv", "09.csv"])
def test_the_simulated_campaigns_give_back_what_they_were_made_with(month: str) -> None:
    file = EXAMPLES / "campaigns" / f"2017-{month}"
    found = invert(read_file(file, file.name).campaign, load_table())
    d33 = np.array([14.0, 14.4, 13.7 * (1 - 0.08 * (int(month[1]) - 5)), 14.2])
    pull = (to_lab("d33_pc_per_n", found.sensors.value) - d33) / to_lab("d33_pc_per_n", found.sensors.uncertainty)
    assert np.abs(pull).max() < 3


def labview_blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)\n```$", LABVIEW, flags=re.MULTILINE | re.DOTALL)


def is_the_answer_shown(text: str) -> bool:
    """Whether a CSV answer is the one on the page."""
    _, shown = labview_blocks("csv")
    return is_as_shown(shown, text)


@pytest.mark.parametrize("ends_of_line", ["\n", "\r\n"])
def test_labview_bodies_give_the_answer_shown(server_url: str, ends_of_line: str) -> None:
    (json_body,) = labview_blocks("json")
    csv_body, _ = labview_blocks("csv")
    bodies = {"application/json": json_body, "text/csv": csv_body.replace("\n", ends_of_line)}
    for content_type, body in bodies.items():
        headers = {"Content-Type": content_type, "Accept": "text/csv"}
        answer = httpx.post(f"{server_url}/v1/frf", content=body, headers=headers)
        assert answer.status_code == 200, answer.text
        assert is_the_answer_shown(answer.text), answer.text
        assert len(answer.headers["Underskin-Table-SHA256"]) == 64


def test_labview_request_byte_for_byte(server_url: str) -> None:
    (request,) = labview_blocks("http")
    head, body = request.split("\n\n")
    assert f"Content-Length: {len(body)}" in head
    address = urlsplit(server_url)
    head = head.replace("127.0.0.1:8000", address.netloc).replace("\n", "\r\n") + "\r\n\r\n"
    with socket.create_connection((address.hostname, address.port), timeout=300) as connection:
        connection.sendall(head.encode())
        assert connection.recv(100).startswith(b"HTTP/1.1 100 Continue\r\n\r\n")
        connection.sendall(body.encode())
        answer_head, answer_body = read_answer(connection)
    assert answer_head.startswith("HTTP/1.1 200 OK\r\n")
    assert is_the_answer_shown(answer_body), answer_body


def test_labview_without_the_header_is_refused_as_the_page_says(server_url: str) -> None:
    answer = httpx.post(f"{server_url}/v1/frf", data={"preload_n": "1"})
    assert answer.status_code == 415
    assert "application/json, text/csv, application/x-npz or" in answer.json()["detail"]


def read_answer(connection: socket.socket) -> tuple[str, str]:
    """Head and body of an answer with Content-Length."""
    received = b""
    while b"\r\n\r\n" not in received:
        received += connection.recv(65536)
    head, _, body = received.partition(b"\r\n\r\n")
    length = int(dict(line.lower().split(": ", 1) for line in head.decode().split("\r\n")[1:])["content-length"])
    while len(body) < length:
        body += connection.recv(65536)
    return head.decode(), body.decode()
