"""Try an unpacked image as compose.yaml runs it; started by scripts/verify_image.py in fresh namespaces.

Read-only root, /tmp in memory, one volume, no capabilities, no new privileges, no network but loopback.
"""

import json
import shlex
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

work = Path(sys.argv[1])
image = json.loads((work / "image.json").read_text())
settings: dict[str, str] = image["settings"]
container = work / "container"
volume = work / "volume"
ENTRYPOINT: list[str] = json.loads(settings["ENTRYPOINT"])
CMD: list[str] = json.loads(settings["CMD"])
HEALTHCHECK: list[str] = json.loads(settings["HEALTHCHECK"].split("CMD", 1)[1])
ADDRESS = "http://127.0.0.1:8000"


def mount(*arguments: str | Path) -> None:
    """Call mount."""
    subprocess.run(["mount", *map(str, arguments)], check=True)


def assemble() -> None:
    """The container's file system; it vanishes with the mount namespace."""
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    container.mkdir()
    # A new named volume starts as a copy of the image's folder, owner and mode included.
    subprocess.run(["cp", "-a", image["root"] + settings["VOLUME"], str(volume)], check=True)
    mount("--make-rprivate", "/")
    mount("--bind", image["root"], container)
    mount("-o", "remount,bind,ro", container)
    mount("--bind", volume, container / settings["VOLUME"].lstrip("/"))
    mount("-t", "tmpfs", "tmpfs", container / "tmp")
    mount("-t", "proc", "proc", container / "proc")
    mount("-t", "tmpfs", "tmpfs", container / "dev")
    (container / "dev" / "null").touch()
    mount("--bind", "/dev/null", container / "dev" / "null")
    (container / "dev" / "urandom").touch()
    mount("--bind", "/dev/urandom", container / "dev" / "urandom")


def command(arguments: list[str]) -> list[str]:
    """How to start a program in the container."""
    user, group = settings["USER"].split(":")
    environment = [f"{name}={value}" for name, value in image["environment"].items()]
    confined = [
        f"--reuid={user}",
        f"--regid={group}",
        "--clear-groups",
        "--no-new-privs",
        "--bounding-set=-all",
    ]
    enter = f"cd {settings['WORKDIR']} && exec {shlex.join(arguments)}"
    return ["chroot", str(container), "setpriv", *confined, "env", "-i", *environment, "sh", "-c", enter]


def run(arguments: list[str]) -> subprocess.CompletedProcess[str]:
    """Run a program in the container to its end."""
    return subprocess.run(command(arguments), capture_output=True, text=True, timeout=60)


def status(path: str, key: str | None = None) -> int:
    """HTTP status of a GET."""
    request = urllib.request.Request(ADDRESS + path, headers={"Authorization": f"Bearer {key}"} if key else {})
    try:
        with urllib.request.urlopen(request, timeout=10) as response:
            return int(response.status)
    except urllib.error.HTTPError as error:
        return error.code


def check(claim: str, holds: bool, evidence: object = "") -> None:
    """Print the claim, and stop if it does not hold."""
    print(f"{'ok' if holds else 'FAILED'}: {claim}", flush=True)
    if not holds:
        raise SystemExit(f"{evidence}")


def try_server(key: str) -> None:
    """Start the image's own command, ask it, stop it."""
    started = time.monotonic()
    server = subprocess.Popen(command(ENTRYPOINT + CMD))
    try:
        while (health := run(HEALTHCHECK)).returncode != 0 and time.monotonic() - started < 30:
            time.sleep(0.1)
        check("the health check passes", health.returncode == 0, health.stderr)
        check("/ready answers 200", status("/ready") == 200, status("/ready"))
        sigma = "/v1/sigma?a_over_h=0.3&rt_over_h=0.6"
        check("without a key, 401", status(sigma) == 401, status(sigma))
        check("with the key, 200", status(sigma, key) == 200, status(sigma, key))
    finally:
        server.terminate()
        code = server.wait(timeout=30)
    check("it stops on SIGTERM by itself", code in (0, 143, -15), code)


assemble()
refused = run(ENTRYPOINT + CMD)
check("no start without keys", refused.returncode not in (0, 124), refused.stdout)
check("... and the reason names keys", "key" in refused.stderr.lower() + refused.stdout.lower(), refused.stderr)
check("the user is not root", run(["id", "-u"]).stdout.strip() not in ("", "0"))
check("the root is read-only", run(["touch", "/app/written"]).returncode != 0)
check("the data folder is not", run(["touch", "/data/written"]).returncode == 0)
created = run([*ENTRYPOINT, "key", "create", "lab"])
check("a key is created", created.returncode == 0, created.stderr)
try_server(created.stdout.split()[-1])
