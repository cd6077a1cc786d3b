"""The finding of a server check: in words, its severity, and what to do."""

import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

from service.log import first_line

FILES_OPEN = "see that the disk answers, and that this user is the one that runs the server"


class Level(IntEnum):
    """Severity as in monitoring systems: the exit status of the worst finding."""

    OK = 0
    WARNING = 1
    CRITICAL = 2


@dataclass(frozen=True)
class Observation:
    """What a check found, in words, and what to do where that is anything."""

    check: str
    level: Level
    found: str
    advice: str = ""


def carried_out(check: str, observations: Iterator[Observation]) -> Iterator[Observation]:
    """The findings of a check, and one more if a disk or file error ends it early."""
    try:
        yield from observations
    except OSError as error:
        yield Observation(check, Level.CRITICAL, f"cannot be looked at: {first_line(error)}", FILES_OPEN)


def open_to_others(check: str, folders: Sequence[Path]) -> Iterator[Observation]:
    """Files in these folders that others than their owner may read or write."""
    files = [path for folder in folders for path in sorted(folder.glob("*")) if path.is_file()]
    open_paths = [str(path) for path in files if stat.S_IMODE(path.stat().st_mode) & 0o077]
    if open_paths:
        more = f" and {len(open_paths) - 3} more" if len(open_paths) > 3 else ""
        message = f"others than their owner may open {', '.join(open_paths[:3])}{more}"
        yield Observation(check, Level.WARNING, message, "chmod 600 these files")
