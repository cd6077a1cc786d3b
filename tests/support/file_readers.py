"""The processes in which a server reads files."""

from pathlib import Path

from tests.support.memory import children

_COMMAND = b"underskin.recordings.readers.sandbox"


def readers(server: int) -> int:
    """How many of them a server has now."""
    return sum(_COMMAND in _command(child) for child in children(server))


def _command(process: int) -> bytes:
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes()
    except OSError:  # it has ended meanwhile
        return b""
