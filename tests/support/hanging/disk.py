"""A folder whose disk hangs, as one that is frozen, throttled or on a network does: calls that write do not return.

Processes that run with `HangingDisk.environment` have a small C library in them (`hanging.c`, built here) that holds up
the calls.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from tests.support import preloadable

CALLS = {"making a file": "o", "writing": "w", "making a folder": "d", "renaming": "r", "removing": "u"}


class HangingDisk:
    """The disk of `folder`; `notes`: a folder elsewhere, for what its calls are told."""

    def __init__(self, folder: Path, notes: Path) -> None:
        """It does not hang yet."""
        self._folder = folder
        self._calls = notes / "calls"
        self._waiting = notes / "calls.waiting"

    @property
    def environment(self) -> Mapping[str, str]:
        """For processes that write to the folder."""
        library = preloadable.built(Path(__file__).with_name("hanging.c"))
        return {
            "LD_PRELOAD": str(library),
            "HANGING_FOLDER": str(self._folder),
            "HANGING_CALLS": str(self._calls),
        }

    @contextmanager
    def hanging(self, call: str) -> Iterator[None]:
        """While calls of one kind, a key of CALLS, hang."""
        self._waiting.write_bytes(b"")
        self._calls.write_text(CALLS[call])
        try:
            yield
        finally:
            self._calls.unlink()

    def waiting(self) -> int:
        """How many calls wait, or have waited, since it last began to hang."""
        return len(self._waiting.read_bytes())
