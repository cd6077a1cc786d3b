"""Files put in place so that a power cut leaves either the old one or the new one, whole."""

import os
from pathlib import Path


def replace(written: Path, path: Path) -> None:
    """Put a file that was written, and flushed to the disk, in the place of another; durable once this returns."""
    written.replace(path)
    keep_entries(path.parent)


def write_text(path: Path, text: str) -> None:
    """Write a small file, whole or not at all; durable once this returns."""
    written = path.with_name(f"{path.name}.part")
    with written.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    replace(written, path)


def keep_entries(folder: Path) -> None:
    """Have the disk keep which files a folder holds: a rename, or a new name, is lost with the power until then."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def make_folder(folder: Path, mode: int = 0o777) -> None:
    """Make a folder, of that mode, and those above it, where they are missing; durable once this returns."""
    if not folder.is_dir():
        make_folder(folder.parent)
        folder.mkdir(mode, exist_ok=True)
        keep_entries(folder.parent)
