"""The site file that docs/deploy.md hands out, in a real nginx with TLS in front of a real server."""

import os
import re
import shutil
import socket
import ssl
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.auth.keys import KeyStore
from service.settings import Settings
from tests.service.waiting import until
from tests.support.repository import ROOT
from tests.support.server import free_port, running

SITE = ROOT / "deploy" / "nginx.conf"
NAME = "skin.example.org"
TIMEOUT_S = 8  # instead of the site file's, which are longer
NGINX = shutil.which("nginx", path=os.environ["PATH"] + os.pathsep + "/usr/sbin")
OPENSSL = shutil.which("openssl")

pytestmark = [
    pytest.mark.skipif(NGINX is None, reason="nginx is not installed"),
    pytest.mark.skipif(OPENSSL is None, reason="openssl, which makes the certificate, is not installed"),
]

# What a whole nginx.conf says around a site; everything it writes stays in the folder.
MAIN = """
{user}
daemon off;
pid {folder}/nginx.pid;
error_log stderr;
events {{ }}
http {{
    access_log {folder}/access.log combined;
    client_body_temp_path {folder}/body;
    proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi;
    uwsgi_temp_path {folder}/uwsgi;
    scgi_temp_path {folder}/scgi;
    include {folder}/site.conf;
}}
"""


def wait_until_open(port: int, process: "subprocess.Popen[bytes]") -> None:
    """Return once `process` listens."""
    deadline = time.monotonic() + 240
    while time.monotonic() < deadline:
        assert process.poll() is None, f"{process.args!r} ended with status {process.returncode}"
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1).close()
        except OSError:
            time.sleep(0.05)
        else:
            return
    raise AssertionError(f"nobody listens on port {port}")


def make_certificate(folder: Path) -> None:
    """A self-signed certificate for NAME."""
    subject = ["-subj", f"/CN={NAME}", "-addext", f"subjectAltName=DNS:{NAME}"]
    files = ["-keyout", str(folder / "privkey.pem"), "-out", str(folder / "fullchain.pem")]
    make = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-noenc", "-days", "2", *subject, *files]
    subprocess.run(make, check=True, capture_output=True)


def site(folder: Path, service: int, tls: int, plain: int) -> str:
    """The site file with this test's ports, certificate and timeouts in place of a real machine's."""
    text = SITE.read_text()
    places = {
        "server 127.0.0.1:8000;": f"server 127.0.0.1:{service};",
        "listen 443 ssl": f"listen 127.0.0.1:{tls} ssl",
        "listen [::]:443 ssl http2;": "",
        "listen 80;": f"listen 127.0.0.1:{plain};",
        "listen [::]:80;": "",
        "client_header_timeout     10s;": f"client_header_timeout {TIMEOUT_S}s;",
        "client_body_timeout       30s;": f"client_body_timeout {TIMEOUT_S}s;",
        "/etc/ssl/underskin/": f"{folder}/",
        "/var/log/nginx/": f"{folder}/",
    }
    for there, here in places.items():
        assert there in text
        text = text.replace(there, here)
    return text


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of all that nginx and the service write."""
    return tmp_path_factory.mktemp("proxy")


@pytest.fixture(scope="module")
def proxy(folder: Path) -> Iterator[tuple[httpx.Client, int]]:
    """A client that speaks TLS to nginx, and nginx's plain port; nginx passes on to `underskin serve`."""
    make_certificate(folder)
    tls, plain = free_port(), free_port()
    user = "user root;" if os.geteuid() == 0 else ""
    (folder / "nginx.conf").write_text(MAIN.format(user=user, folder=folder))
    trust = ssl.create_default_context(cafile=folder / "fullchain.pem")
    headers = {"Host": NAME, "Authorization": f"Bearer {KeyStore(folder / 'data').create('proxy', 'write')}"}
    nginx = [str(NGINX), "-e", "stderr", "-p", str(folder), "-c", str(folder / "nginx.conf")]
    with running(folder, {"UNDERSKIN_HOSTS": NAME, "UNDERSKIN_MAX_BODY_MB": "1"}) as server:
        (folder / "site.conf").write_text(site(folder, httpx.URL(server.url).port or 0, tls, plain))
        with subprocess.Popen(nginx) as front:
            try:
                wait_until_open(tls, front)
                with httpx.Client(
                    verify=trust,
                    base_url=f"https://127.0.0.1:{tls}",
                    headers=headers,
                    timeout=240.0,  # 70 MB pass through two servers, beside other tests
                ) as client:
                    yield client, plain
            finally:
                front.terminate()


def ask(client: httpx.Client, method: str, path: str, **options: Any) -> httpx.Response:
    """A request whose TLS names and verifies NAME."""
    return client.request(method, path, extensions={"sni_hostname": NAME}, **options)


@contextmanager
def raw(client: httpx.Client) -> Iterator[ssl.SSLSocket]:
    """A connection through TLS on which a test may say what no honest client would."""
    trust = ssl.create_default_context()
    trust.check_hostname, trust.verify_mode = False, ssl.CERT_NONE
    with (
        socket.create_connection(("127.0.0.1", client.base_url.port or 0), timeout=300) as plain,
        trust.wrap_socket(plain, server_hostname=NAME) as connection,
    ):
        yield connection


def test_a_request_through_tls_is_answered(proxy: tuple[httpx.Client, int]) -> None:
    client, _ = proxy
    answer = ask(client, "GET", "/v1/sigma?a_over_h=0.3&rt_over_h=0.6")
    assert answer.status_code == 200
    assert answer.json()["sigma"] == pytest.approx(0.936505, abs=2e-6)


def test_the_request_id_of_nginx_comes_back(proxy: tuple[httpx.Client, int]) -> None:
    client, _ = proxy
    request_ids = [ask(client, "GET", "/health").headers["X-Request-ID"] for _ in range(2)]
    assert all(len(request_id) == 32 for request_id in request_ids)
    assert len(set(request_ids)) == 2


def test_the_service_sees_the_clients_host(proxy: tuple[httpx.Client, int]) -> None:
    client, _ = proxy
    assert ask(client, "GET", "/health", headers={"Host": "elsewhere.example.org"}).status_code == 421


@pytest.mark.parametrize(("origin", "status"), [(f"https://{NAME}", 200), ("https://elsewhere.example.org", 403)])
def test_a_page_of_the_same_name_may_post(proxy: tuple[httpx.Client, int], origin: str, status: int) -> None:
    client, _ = proxy
    columns = {"a_over_h": [0.3], "rt_over_h": [0.6]}
    assert ask(client, "POST", "/v1/sigma", json=columns, headers={"Origin": origin}).status_code == status


def too_large(answer: httpx.Response) -> dict[str, Any]:
    """The problem that both nginx and the service answer where a body is too large."""
    assert (answer.status_code, answer.headers["Content-Type"]) == (413, "application/problem+json")
    problem: dict[str, Any] = answer.json()
    assert set(problem) == {"type", "title", "status", "detail", "request_id", "errors"}
    assert problem["type"] == "urn:underskin:problem:body-too-large"
    return problem


@pytest.mark.parametrize("chunked", [False, True])
def test_the_proxy_passes_on_no_login_form_that_is_too_long(proxy: tuple[httpx.Client, int], chunked: bool) -> None:
    client, _ = proxy
    form = b"key=" + b"k" * 10_000
    content = (piece for piece in (form[:1000], form[1000:])) if chunked else form
    headers = {"Content-Type": "application/x-www-form-urlencoded", "Accept": "application/json"}
    answer = ask(client, "POST", "/login", content=content, headers=headers)
    assert "what the proxy passes on" in too_large(answer)["detail"]


def test_the_proxy_passes_on_uploads_beyond_the_limit_of_other_bodies(proxy: tuple[httpx.Client, int]) -> None:
    client, _ = proxy
    document = b" " * 70_000_000
    assert ask(client, "POST", "/v1/campaigns", files={"file": ("blank.json", document)}).status_code == 422
    assert "the proxy" in too_large(ask(client, "POST", "/v1/sigma", content=document))["detail"]


def test_the_sites_limits_are_those_of_the_settings() -> None:
    sizes = dict(re.findall(r"client_max_body_size +(\d+)(m);", SITE.read_text()))
    assert set(sizes) == {f"{Settings.model_fields[name].default:g}" for name in ("max_body_mb", "max_upload_mb")}


def test_the_proxy_takes_the_longest_address_of_a_page_and_no_longer_header(proxy: tuple[httpx.Client, int]) -> None:
    client, _ = proxy
    assert ask(client, "GET", f"/v1/sigma?a_over_h=0.3&rt_over_h={'0' * 50_000}0.6").status_code == 200
    assert ask(client, "GET", "/health", headers={"X-Long": "k" * 70_000}).status_code == 400


def test_who_does_not_go_on_is_disconnected(proxy: tuple[httpx.Client, int]) -> None:
    client, _ = proxy
    begun = ("GET /health HTTP/1.1\r\n", f"POST /login HTTP/1.1\r\nHost: {NAME}\r\nContent-Length: 9\r\n\r\nkey=")
    with raw(client) as first, raw(client) as second:
        for connection, sent in zip((first, second), begun, strict=True):
            connection.sendall(sent.encode())
        start = time.monotonic()
        for connection in (first, second):
            with suppress(ConnectionError, ssl.SSLError):  # a reset is as good as an end
                connection.recv(1)  # b"", or the start of a refusal; a connection that stays open is a TimeoutError
        assert time.monotonic() - start > TIMEOUT_S - 0.5


@pytest.mark.parametrize("path", ["/v1/skins/{}", "/v1/skins/%75s{}", "/v1/sigma?key={}", "/login?next=/{}"])
def test_no_log_has_a_key_that_came_in_an_address(proxy: tuple[httpx.Client, int], folder: Path, path: str) -> None:
    client, plain = proxy
    key = client.headers["Authorization"].removeprefix("Bearer ")
    sent = path.format(key.removeprefix("us") if "%75s" in path else key)
    answer = ask(client, "GET", sent, headers={"X-Request-ID": key, "Referer": f"https://{NAME}{sent}"})
    logs = [folder / name for name in ("underskin.log", "server.log")]
    until(lambda: all(answer.headers["X-Request-ID"] in log.read_text() for log in logs), "the request was not logged")
    httpx.get(f"http://127.0.0.1:{plain}{sent}", headers={"Host": NAME})
    with raw(client) as connection:  # to no name of the site
        connection.sendall(f"GET {sent} HTTP/1.1\r\nHost: elsewhere.example.org\r\nConnection: close\r\n\r\n".encode())
        connection.recv(100)
    every = [*logs, folder / "access.log"]
    assert not any(key.removeprefix("us_") in log.read_text() for log in every)


def test_two_host_headers_are_refused(proxy: tuple[httpx.Client, int]) -> None:
    client, _ = proxy
    with raw(client) as connection:
        connection.sendall(f"GET /health HTTP/1.1\r\nHost: {NAME}\r\nHost: elsewhere.example.org\r\n\r\n".encode())
        assert connection.recv(100).split()[1] == b"400"


def test_plain_http_is_sent_to_tls(proxy: tuple[httpx.Client, int]) -> None:
    _, plain = proxy
    answer = httpx.get(f"http://127.0.0.1:{plain}/v1/tables", headers={"Host": NAME})
    assert (answer.status_code, answer.headers["Location"]) == (301, f"https://{NAME}/v1/tables")
