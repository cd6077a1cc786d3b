"""The data folder, which holds digests of keys and a lab's recordings."""

from pathlib import Path


def make(folder: Path) -> None:
    """Make it where it is missing, for its owner alone; one that is there keeps the mode that somebody gave it."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
