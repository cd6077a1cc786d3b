"""What a check of a server found: in words, how bad it is, and what to do."""

import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

from service.log import first_line

FILES_OPEN = "see that the disk answers, and that this user is the one that runs the server"


class Level(IntEnum):
    """As monitoring systems count: the exit status of the worst finding."""

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
    """What a check finds; and that, where a disk or a file lets it go no further."""
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
