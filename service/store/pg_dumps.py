"""Dumps of a PostgreSQL store: written by pg_dump, and restored by pg_restore and psql."""

import os
import re
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO

from sqlalchemy import text

from service.store.engine import Database
from service.store.errors import StoreError
from service.store.tables import metadata

Copied = Callable[[int, int | None], object]  # called with the bytes done, and the total if known
_STEP_BYTES = 1 << 20
_LOOK_S = 0.1
_APART = "underskin_restoring"  # the schema that a dump is read into, while the store's own tables are read
_TABLE_IN_LIST = re.compile(r"^\d+; \d+ \d+ TABLE (?!DATA )\S+ (\S+) ", re.MULTILINE)
_END_OF_ROWS = b"\\.\n"


def dump(database: Database, part: Path, copied: Copied) -> None:
    """Write a dump in PostgreSQL's custom format; raises StoreError."""
    _require("pg_dump")
    address, password = _address(database)
    command = ["pg_dump", "--dbname", address, "--format=custom", "--no-owner", "--file", str(part)]
    with (
        tempfile.TemporaryFile() as complaints,
        subprocess.Popen(command, env=os.environ | password, stderr=complaints) as process,
    ):
        while process.poll() is None:
            time.sleep(_LOOK_S)
            copied(part.stat().st_size if part.exists() else 0, None)
        if process.returncode != 0:
            raise StoreError(f"pg_dump failed: {_end_of(complaints)}")


def versions(file: Path) -> list[str]:
    """The schema version of a dump, after reading all of it; raises StoreError if it is damaged."""
    _run("pg_restore", "--file=/dev/null", str(file))
    dumped = _run("pg_restore", "--data-only", "--table=alembic_version", "--file=-", str(file)).splitlines()
    return [dumped[number + 1] for number, line in enumerate(dumped) if line.startswith("COPY ")]


def replace(database: Database, file: Path, copied: Copied) -> None:
    """Replace the store by a dump in one transaction; readers wait only for its end. Raises StoreError.

    The dump is read into tables of a separate schema, which then take the names of the store's tables. No table of the
    store remains, even if the dump's version lacks it.
    """
    for program in ("psql", "pg_restore"):
        _require(program)
    address, password = _address(database)
    schema = str(database.read(lambda connection: connection.execute(text("SELECT current_schema()")).scalar_one()))
    tables = _TABLE_IN_LIST.findall(_run("pg_restore", "--list", str(file)))
    dropped = ", ".join(f'"{schema}".{name}' for name in sorted({*tables, *metadata.tables, "alembic_version"}))
    moved = "".join(f'ALTER TABLE {_APART}.{name} SET SCHEMA "{schema}";\n' for name in tables)
    command = ["psql", "--dbname", address, "--quiet", "--no-psqlrc", "--set=ON_ERROR_STOP=1", "--output=/dev/null"]
    with (
        tempfile.TemporaryFile() as complaints,
        subprocess.Popen(command, env=os.environ | password, stdin=subprocess.PIPE, stderr=complaints) as psql,
    ):
        assert psql.stdin is not None
        complete = False
        with suppress(BrokenPipeError), psql.stdin as script:  # where it has ended, it says why
            script.write(f"BEGIN; CREATE SCHEMA {_APART};\n".encode())
            complete = _write_script(file, tables, script, complaints, copied)
            end = (
                f"DROP TABLE IF EXISTS {dropped};\n{moved}DROP SCHEMA {_APART};\nCOMMIT;\n"
                if complete
                else "ROLLBACK;\n"
            )
            script.write(end.encode())
        psql.wait()
        if psql.returncode != 0 or not complete:
            raise StoreError(f"the restore failed: {_end_of(complaints)}")


def _write_script(
    file: Path, tables: Collection[str], script: IO[bytes], complaints: IO[bytes], copied: Copied
) -> bool:
    """Write a dump as SQL that creates its tables in the separate schema; returns whether all of it was good."""
    command = ["pg_restore", "--no-owner", "--file=-"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=complaints) as made:
        assert made.stdin is not None
        assert made.stdout is not None
        feeder = threading.Thread(target=_feed, args=(file, made.stdin, copied), daemon=True)
        feeder.start()
        try:
            script.writelines(_in_schema_apart(made.stdout, tables))
        except BrokenPipeError:
            made.kill()
            raise
        finally:
            feeder.join()
    return made.returncode == 0


def _feed(file: Path, sink: IO[bytes], copied: Copied) -> None:
    size, done = file.stat().st_size, 0
    with suppress(BrokenPipeError), file.open("rb") as source, sink:  # where it has ended, it says why
        while chunk := source.read(_STEP_BYTES):
            sink.write(chunk)
            done += len(chunk)
            copied(done, size)


def _in_schema_apart(lines: Iterable[bytes], tables: Collection[str]) -> Iterator[bytes]:
    """The lines of a dump with another schema before the names of its tables and sequences; rows are unchanged."""
    names = "|".join(map(re.escape, tables))
    named = re.compile(rf"\b\w+\.(?=(?:{names})(?:_\w+_seq)?\b)".encode())
    in_rows = False
    for line in lines:
        if in_rows:
            in_rows = line != _END_OF_ROWS
            yield line
        else:
            in_rows = line.startswith(b"COPY ") and line.endswith(b"FROM stdin;\n")
            yield named.sub(f"{_APART}.".encode(), line)


def _address(database: Database) -> tuple[str, dict[str, str]]:
    """Where the database is, and the password for the environment."""
    url = database.url.set(drivername="postgresql")
    password = {} if url.password is None else {"PGPASSWORD": str(url.password)}
    return url.set(password=None).render_as_string(), password


def _require(program: str) -> None:
    if shutil.which(program) is None:
        raise StoreError(f"{program}, which backs up and restores PostgreSQL, is not installed (postgresql-client)")


def _run(program: str, *arguments: str) -> str:
    """What a program of PostgreSQL printed; raises StoreError with what it complained of."""
    _require(program)
    done = subprocess.run([program, *arguments], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise StoreError(f"{program} failed: {done.stderr.strip()[-500:]}")
    return done.stdout


def _end_of(complaints: IO[bytes]) -> str:
    complaints.seek(0)
    return complaints.read().decode(errors="replace").strip()[-500:]
