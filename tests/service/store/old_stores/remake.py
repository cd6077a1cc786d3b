"""Remakes the old stores beside this file: `python -m tests.service.store.old_stores.remake [VERSION...]`.

Each is made by a server of the commit with which a version of the schema landed, from this repository's history: it is
sent the documents of `contents.py`, diagnoses one of them with its own workers, and answers for what it keeps. What
remains is its database, SQLite's file and PostgreSQL's dump as SQL, and those answers. A checkout without its history
has no use for this; the tests read what is committed.
"""

import json
import lzma
import os
import sqlite3
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import httpx

from tests.service.store.old_stores.contents import FOLDER, LANDED, asked_of, fill
from tests.support import postgres
from tests.support.repository import ROOT
from tests.support.server import free_port

_START = "from {} import main; main()"


def main(versions: list[str]) -> None:
    """Remake those of the versions named, or all."""
    with postgres.running() as cluster:
        for version in versions or LANDED:
            with _code_of(LANDED[version]) as code:
                with tempfile.TemporaryDirectory() as folder:
                    answers = _made(code, Path(folder), "", version)
                    with closing(sqlite3.connect(Path(folder) / "underskin.sqlite3")) as store:
                        store.execute("PRAGMA journal_mode = DELETE")  # all in one file
                        store.execute("VACUUM")
                    _pack(f"{version}.sqlite3", (Path(folder) / "underskin.sqlite3").read_bytes(), answers)
                with tempfile.TemporaryDirectory() as folder:
                    url = cluster.new_database()
                    answers = _made(code, Path(folder), url, version)
                    command = ["pg_dump", "--dbname", url, "--no-owner"]
                    dump = subprocess.run(command, check=True, capture_output=True).stdout
                    _pack(f"{version}.sql", dump, answers)
            print(version, LANDED[version], "made", flush=True)


def _made(code: Path, folder: Path, database_url: str, version: str) -> dict[str, object]:
    """Run a server of the old code over an empty store, fill it and return what it answers; it ends in order."""
    port = free_port()
    environment = {
        **os.environ,
        "PYTHONPATH": str(code),
        "UNDERSKIN_DATA": str(folder),
        "UNDERSKIN_DATABASE_URL": database_url,
    }
    module = "underskin.cli.app" if (code / "underskin/cli/app.py").exists() else "underskin.cli"
    start = _START.format(module)
    with (code / "server.log").open("ab") as log:
        process = subprocess.Popen(
            [sys.executable, "-c", start, "serve", "--port", str(port)], cwd=code, env=environment, stderr=log
        )
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=600) as client:
            _await(client, process, code / "server.log")
            fill(client, version)
            return {path: client.get(path).raise_for_status().json() for path in asked_of(client)}
    finally:
        process.terminate()
        process.wait(300)


def _await(client: httpx.Client, process: "subprocess.Popen[bytes]", log: Path) -> None:
    deadline = time.monotonic() + 600
    while time.monotonic() < deadline and process.poll() is None:
        try:
            if client.get("/ready").status_code == 200:
                return
        except httpx.TransportError:
            time.sleep(0.1)
    raise RuntimeError(f"the old server did not start: {log.read_text()[-2000:]}")


@contextmanager
def _code_of(commit: str) -> Iterator[Path]:
    """The files of a commit in a folder of their own, gone at the end."""
    with tempfile.TemporaryDirectory() as folder:
        archive = subprocess.run(["git", "archive", commit], cwd=ROOT, check=True, capture_output=True).stdout
        subprocess.run(["tar", "--extract", "--directory", folder], input=archive, check=True)
        code = Path(folder)
        _install(code)
        if (code / "scripts/client_documents.py").exists():
            subprocess.run([sys.executable, "-m", "scripts.client_documents"], cwd=code, check=True)
        if (code / "underskin/compiled.py").exists():
            compiling = os.environ | {"PYTHONPATH": folder}
            subprocess.run([sys.executable, "-m", "underskin.compiled"], cwd=code, env=compiling, check=True)
        yield code


def _install(code: Path) -> None:
    """Tell Python which commands this code has: those of the package that is installed are of today."""
    project = tomllib.loads((code / "pyproject.toml").read_text())["project"]
    metadata = code / f"{project['name']}-{project['version']}.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Name: {project['name']}\nVersion: {project['version']}\n")
    groups = {"console_scripts": project["scripts"], **project["entry-points"]}
    lines = [
        line
        for group, entries in groups.items()
        for line in (f"[{group}]", *(f"{name} = {place}" for name, place in entries.items()))
    ]
    (metadata / "entry_points.txt").write_text("\n".join(lines) + "\n")


def _pack(name: str, store: bytes, answers: dict[str, object]) -> None:
    for file, content in ((f"{name}.xz", store), (f"{name}.answers.xz", json.dumps(answers).encode())):
        (FOLDER / file).write_bytes(lzma.compress(content, preset=9 | lzma.PRESET_EXTREME))


if __name__ == "__main__":
    main(sys.argv[1:])
