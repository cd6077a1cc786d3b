"""Starting and ending: what is wrong ends the start with one clear line, and a signal ends the server cleanly."""

import json
import os
import shutil
import signal
import socket
from pathlib import Path

import h5py
import httpx
import pytest

from tests.service.connections import HEAD, connect, read_answer
from tests.service.requests import SIGMA, problem_of
from tests.support import preloaded
from tests.support.server import running
from underskin.surrogate.hdf5_format import tables_folder
from underskin.surrogate.sigma_table import SIGMA_TABLE


def refusal(folder: Path, *options: str, **environment: str) -> str:
    """The one line on stderr with which `underskin serve` ends."""
    settings = {**os.environ, "UNDERSKIN_DATA": str(folder / "data"), **environment}
    ended = preloaded.run("serve", "--port", "0", *options, environment=settings)
    assert (ended.returncode, ended.stdout) == (2, "")
    (line,) = ended.stderr.splitlines()
    assert line.startswith("underskin: ")
    return line


def test_a_port_in_use_is_named(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        line = refusal(tmp_path, "--port", str(port))
    assert f"cannot listen on 127.0.0.1 port {port}: Address already in use" in line
    assert "PORT=" in line


@pytest.mark.parametrize("place", ["a file/data", "/proc/underskin"])
def test_a_data_folder_that_cannot_be_written_is_named(tmp_path: Path, place: str) -> None:
    (tmp_path / "a file").touch()  # in the way whoever runs this, and /proc takes no folder even from root
    data = tmp_path / place
    assert f"the data folder {data} (UNDERSKIN_DATA) is not writable: " in refusal(tmp_path, UNDERSKIN_DATA=str(data))


def test_a_data_folder_is_made_for_its_owner_alone_and_one_that_is_there_stays_as_it_is(tmp_path: Path) -> None:
    with running(tmp_path):
        assert (tmp_path / "data").stat().st_mode & 0o777 == 0o700
    own, shared = tmp_path / "own", tmp_path / "shared"
    shared.mkdir(mode=0o755)
    for folder, mode in ((own, 0o700), (shared, 0o755)):
        made = preloaded.run("key", "create", "lab", environment=os.environ | {"UNDERSKIN_DATA": str(folder)})
        assert made.returncode == 0
        assert folder.stat().st_mode & 0o777 == mode


def test_a_data_folder_lost_later_makes_the_server_not_ready(tmp_path: Path) -> None:
    with running(tmp_path) as started:
        (tmp_path / "data").rename(tmp_path / "moved")
        refused = httpx.get(f"{started.url}/ready")
        assert str(tmp_path / "data") in problem_of(refused, 503)["detail"]
        assert httpx.get(f"{started.url}/health").status_code == 200
        assert "underskin_disk_free_bytes NaN" in httpx.get(f"{started.url}/metrics").text
        (tmp_path / "moved").rename(tmp_path / "data")
        assert httpx.get(f"{started.url}/ready").status_code == 200
    (line,) = [line for line in started.log.read_text().splitlines() if refused.headers["x-request-id"] in line]
    assert json.loads(line)["level"] == "warning"


def test_a_misspelt_setting_is_named_in_the_log(tmp_path: Path) -> None:
    with running(tmp_path, {"UNDERSKIN_MAX_HAEDER_KB": "4", "UNDERSKIN_TIME_ZONE": ""}) as started:
        pass
    assert "nothing reads UNDERSKIN_MAX_HAEDER_KB" in started.log.read_text()


@pytest.mark.parametrize(
    ("variable", "value", "says"),
    [
        ("UNDERSKIN_MAX_BODY_MB", "inf", "less than or equal to 1000000"),
        ("UNDERSKIN_MAX_BODY_MB", "64 MB", "a valid number"),
        ("UNDERSKIN_DATA", "~nobody-of-this-name/data", "home directory"),
        ("UNDERSKIN_HOSTS", "skin.example.org:8743", "without scheme, port and path"),
        ("UNDERSKIN_HOSTS", "localhost, https://skin.example.org", "without scheme, port and path"),
        ("UNDERSKIN_PROXIES", "172.16.0.0/12, 10.0.0.1/8", "10.0.0.1/8 has host bits set"),
        ("UNDERSKIN_PROXIES", "gateway", "allowed: 192.0.2.7 or 192.0.2.0/24"),
        ("UNDERSKIN_TIME_ZONE", "Mars/Base", "such as Europe/Rome"),
    ],
)
def test_a_wrong_setting_is_named(tmp_path: Path, variable: str, value: str, says: str) -> None:
    line = refusal(tmp_path, **{variable: value})
    assert line.startswith(f"underskin: {variable} = {value!r}: ")
    assert says in line


# Tables


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """A copy of the table, to be spoiled."""
    folder = tmp_path / "tables"
    folder.mkdir()
    return Path(shutil.copy(tables_folder() / SIGMA_TABLE, folder))


def refused_table(table: Path) -> str:
    """Why the server does not start; the file and what to do are always named."""
    line = refusal(table.parent.parent, UNDERSKIN_TABLES=str(table.parent))
    assert f"table {table}" in line
    assert "underskin tablegen sigma" in line
    return line


def test_a_missing_table_ends_the_start(table: Path) -> None:
    table.unlink()
    assert "cannot be read: No such file or directory" in refused_table(table)


def test_an_altered_table_ends_the_start(table: Path) -> None:
    with h5py.File(table, "r+") as file:
        file["sigma/sigma"][3, 3, 3] *= 1 + 1e-12
    assert "was altered after it was written" in refused_table(table)


def test_a_damaged_byte_ends_the_start(table: Path) -> None:
    with h5py.File(table) as file:
        chunk = file["sigma/sigma"].id.get_chunk_info(0)
    content = bytearray(table.read_bytes())
    content[chunk.byte_offset + chunk.size // 2] ^= 1
    table.write_bytes(content)
    assert "is truncated or damaged" in refused_table(table)


# The end


@pytest.mark.parametrize(("number", "ended"), [(signal.SIGTERM, -15), (signal.SIGINT, 130)])
def test_signal_ends_server_after_answers(tmp_path: Path, number: signal.Signals, ended: int) -> None:
    """A signal ends the server after the answers under way."""
    with running(tmp_path) as started, connect(started) as idle, connect(started) as busy:
        idle.sendall(f"GET /health HTTP/1.1\r\n{HEAD}\r\n".encode())
        assert read_answer(idle)[0] == 200
        body = json.dumps(SIGMA).encode()
        head = f"POST /v1/sigma HTTP/1.1\r\n{HEAD}Content-Length: {len(body)}\r\nExpect: 100-continue\r\n\r\n"
        busy.sendall(head.encode())
        assert read_answer(busy)[0] == 100  # so the request is under way
        started.process.send_signal(number)
        assert idle.recv(1) == b""  # the connection on which nothing is asked is closed at once
        busy.sendall(body)
        status, headers, answer = read_answer(busy)
        assert (status, headers["connection"], len(json.loads(answer)["sigma"])) == (200, "close", 2)
        assert started.process.wait(240) == ended
    log = started.log.read_text()
    assert headers["x-request-id"] in log
    assert "Traceback" not in log
    socket.create_server(("127.0.0.1", httpx.URL(started.url).port)).close()
