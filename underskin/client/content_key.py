"""An Idempotency-Key of files by their names and contents: what is sent twice is kept once."""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any


def content_key(files: Sequence[Path], terms: Mapping[str, Any]) -> str:
    """A key that is the same for the same files and options; `terms` as `client.campaigns.post_files` takes them.

    Raises OSError where a file cannot be read.
    """
    inputs = [*files] if terms.get("rig") is None else [*files, Path(terms["rig"])]
    digests = [(file.name, content_sha256(file)) for file in inputs]
    options: list[Any] = [terms.get("skin"), terms.get("all_or_nothing", False), terms.get("together")]
    options.append(terms.get("rig") is None)
    # What came later, only where it is said: keys of earlier versions hold.
    options += [(name, terms[name]) for name in ("corrects", "reason", "estimator") if terms.get(name) is not None]
    return f"content {hashlib.sha256(repr([options, digests]).encode()).hexdigest()}"


def label_of(file: Path) -> str:
    """The name under which a file is sent; letters that its disk has in no encoding we know become question marks."""
    return file.name.encode("utf-8", "replace").decode("utf-8")


def content_sha256(file: Path) -> str:
    """The digest of a file's content; raises OSError."""
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()
