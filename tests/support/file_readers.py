"""The processes in which a server reads files."""

from pathlib import Path

_COMMAND = b"underskin.recordings.readers.sandbox"


def readers(server: int) -> int:
    """How many of them a server has now."""
    children = [child for file in Path(f"/proc/{server}/task").glob("*/children") for child in file.read_text().split()]
    return sum(_COMMAND in _command(child) for child in children)


def _command(process: str) -> bytes:
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes()
    except OSError:  # it has ended meanwhile
        return b""
