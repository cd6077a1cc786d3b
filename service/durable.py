"""Atomic file writes: a power cut leaves either the complete old file or the complete new one."""

import os
from pathlib import Path


def replace(written: Path, path: Path) -> None:
    """Move a file that was written and flushed to disk into the place of another; durable on return."""
    written.replace(path)
    keep_entries(path.parent)


def write_text(path: Path, text: str) -> None:
    """Write a small file atomically; durable on return."""
    written = path.with_name(f"{path.name}.part")
    with written.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    replace(written, path)


def keep_entries(folder: Path) -> None:
    """Flush a folder's directory: otherwise a rename or a new name is lost on a power cut."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def make_folder(folder: Path, mode: int = 0o777) -> None:
    """Create a folder with that mode, and missing parents; durable on return."""
    if not folder.is_dir():
        make_folder(folder.parent)
        folder.mkdir(mode, exist_ok=True)
        keep_entries(folder.parent)
