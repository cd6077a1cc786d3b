"""A network between this machine and a PostgreSQL server that can go away without a word, as one whose power fails.

A process in a network namespace of its own listens there and passes on to the server's Unix socket. Run as a script,
this file is that process.
"""

import os
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

_PORT = 5432
_CHUNK = 1 << 16


@dataclass(frozen=True)
class OwnNetwork:
    """A pair of virtual devices: `name`, here, and one in the namespace, which has the address `peer`."""

    name: str
    peer: str

    def cut(self) -> None:
        """From now on nothing comes through, and nobody is told."""
        _ip("link", "set", self.name, "down")

    def mend(self) -> None:
        """It comes through again."""
        _ip("link", "set", self.name, "up")

    def url(self, url: str) -> str:
        """The address of a database of the server, by way of this network."""
        user, database = url.split("//")[1].split("@")[0], url.rpartition("/")[2]
        return f"postgresql://{user}@{self.peer}:{_PORT}/{database}"


@contextmanager
def own_network(unix_socket: Path) -> Iterator[OwnNetwork | None]:
    """A network that leads to a Unix socket; None where this user may make none."""
    name, third = f"us{os.getpid()}", os.getpid() % 256
    here, peer = f"10.213.{third}.1", f"10.213.{third}.2"
    try:
        if not _is_made(name, here, peer):
            yield None
            return
        command = ["ip", "netns", "exec", name, sys.executable, __file__, peer, str(unix_socket)]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as passing_on:
            try:
                assert passing_on.stdout is not None
                assert passing_on.stdout.readline() == b"listening\n"
                yield OwnNetwork(name, peer)
            finally:
                passing_on.kill()
    finally:
        with suppress(OSError, subprocess.CalledProcessError):
            _ip("netns", "delete", name)  # and with it the devices


def _is_made(name: str, here: str, peer: str) -> bool:
    try:
        _ip("netns", "add", name)
        _ip("link", "add", name, "type", "veth", "peer", "name", "eth0", "netns", name)
        _ip("address", "add", f"{here}/24", "dev", name)
        _ip("-n", name, "address", "add", f"{peer}/24", "dev", "eth0")
        _ip("-n", name, "link", "set", "eth0", "up")
        _ip("link", "set", name, "up")
    except (OSError, subprocess.CalledProcessError):
        return False
    return True


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)


def _pass_on(address: str, unix_socket: str) -> None:
    with socket.create_server((address, _PORT)) as listener:
        print("listening", flush=True)
        while True:
            client, _ = listener.accept()
            server = socket.socket(socket.AF_UNIX)
            server.connect(unix_socket)
            for ends in ((client, server), (server, client)):
                threading.Thread(target=_pump, args=ends, daemon=True).start()


def _pump(source: socket.socket, sink: socket.socket) -> None:
    with suppress(OSError):
        while content := source.recv(_CHUNK):
            sink.sendall(content)
        sink.shutdown(socket.SHUT_WR)


if __name__ == "__main__":
    _pass_on(*sys.argv[1:])
