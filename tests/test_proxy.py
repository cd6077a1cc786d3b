"""The site file that docs/deploy.md hands out, in a real nginx with TLS in front of a real server."""

import os
import shutil
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

SITE = Path(__file__).parents[1] / "deploy" / "nginx.conf"
NAME = "skin.example.org"
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
    access_log off;
    client_body_temp_path {folder}/body;
    proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi;
    uwsgi_temp_path {folder}/uwsgi;
    scgi_temp_path {folder}/scgi;
    include {folder}/site.conf;
}}
"""


def free_port() -> int:
    """A port that nobody listens on now."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port: int = listener.getsockname()[1]
    return port


def wait_until_open(port: int, process: "subprocess.Popen[bytes]") -> None:
    """Return once `process` listens."""
    deadline = time.monotonic() + 30
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
    """The site file with this test's ports and certificate in place of a real machine's."""
    text = SITE.read_text()
    places = {
        "server 127.0.0.1:8000;": f"server 127.0.0.1:{service};",
        "listen 443 ssl": f"listen 127.0.0.1:{tls} ssl",
        "listen [::]:443 ssl http2;": "",
        "listen 80;": f"listen 127.0.0.1:{plain};",
        "listen [::]:80;": "",
        "/etc/ssl/underskin/": f"{folder}/",
    }
    for there, here in places.items():
        assert there in text
        text = text.replace(there, here)
    return text


@pytest.fixture(scope="module")
def proxy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[httpx.Client, int]]:
    """A client that speaks TLS to nginx, and nginx's plain port; nginx passes on to `underskin serve`."""
    folder = tmp_path_factory.mktemp("proxy")
    make_certificate(folder)
    service, tls, plain = free_port(), free_port(), free_port()
    (folder / "site.conf").write_text(site(folder, service, tls, plain))
    user = "user root;" if os.geteuid() == 0 else ""
    (folder / "nginx.conf").write_text(MAIN.format(user=user, folder=folder))
    settings = {"UNDERSKIN_DATA": str(folder / "data"), "UNDERSKIN_HOSTS": NAME, "UNDERSKIN_MAX_BODY_MB": "1"}
    serve = [str(Path(sys.executable).with_name("underskin")), "serve", "--port", str(service)]
    nginx = [str(NGINX), "-e", "stderr", "-p", str(folder), "-c", str(folder / "nginx.conf")]
    trust = ssl.create_default_context(cafile=folder / "fullchain.pem")
    make_key = [str(Path(sys.executable).with_name("underskin")), "key", "create", "proxy"]
    key = subprocess.run(make_key, env=os.environ | settings, check=True, capture_output=True, text=True).stdout.strip()
    headers = {"Host": NAME, "Authorization": f"Bearer {key}"}
    with subprocess.Popen(serve, env=os.environ | settings) as server, subprocess.Popen(nginx) as front:
        try:
            wait_until_open(service, server)
            wait_until_open(tls, front)
            with httpx.Client(verify=trust, base_url=f"https://127.0.0.1:{tls}", headers=headers) as client:
                yield client, plain
        finally:
            front.terminate()
            server.terminate()


def ask(client: httpx.Client, method: str, path: str, **options: object) -> httpx.Response:
    """A request whose TLS names and verifies NAME."""
    return client.request(method, path, extensions={"sni_hostname": NAME}, **options)  # type: ignore[arg-type]


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


def test_the_services_body_limit_rules(proxy: tuple[httpx.Client, int]) -> None:
    client, _ = proxy
    columns = {"a_over_h": [0.3] * 300_000, "rt_over_h": 0.6}
    answer = ask(client, "POST", "/v1/sigma", json=columns)
    assert answer.status_code == 413
    assert answer.headers["Content-Type"] == "application/problem+json"


def test_a_batch_under_the_limit_passes(proxy: tuple[httpx.Client, int]) -> None:
    client, _ = proxy
    answer = ask(client, "POST", "/v1/sigma", json={"a_over_h": [0.3] * 100_000, "rt_over_h": 0.6})
    assert len(answer.json()["sigma"]) == 100_000


def test_plain_http_is_sent_to_tls(proxy: tuple[httpx.Client, int]) -> None:
    _, plain = proxy
    answer = httpx.get(f"http://127.0.0.1:{plain}/v1/tables", headers={"Host": NAME})
    assert (answer.status_code, answer.headers["Location"]) == (301, f"https://{NAME}/v1/tables")
