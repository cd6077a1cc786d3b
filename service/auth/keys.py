"""API keys: 256 random bits each, stored as SHA-256 digests, which suffices for tokens that cannot be guessed."""

import fcntl
import hmac
import json
import os
import secrets
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Literal

from service import durable
from service.settings import make_data_folder
from underskin.errors import not_one_of, not_unique

# Looking at the file takes longer than checking a key.
_FRESH_S = 0.5

Scope = Literal["read", "write"]


class KeysUnreadable(ValueError):
    """keys.json is damaged, or may not be read."""


@dataclass(frozen=True)
class Key:
    """A stored key. Scope `write` includes `read`."""

    name: str
    scope: Scope
    created: str
    sha256: str


class KeyStore:
    """The keys in `folder`/keys.json, read again within a second of a change, so revoking needs no restart."""

    def __init__(self, folder: Path) -> None:
        """Nothing is read yet."""
        self.path = folder / "keys.json"
        self._stamp: tuple[int, ...] | None = None  # of the file that was read; empty if damaged, None if missing
        self._keys: tuple[Key, ...] = ()
        self._damage = ""
        self._fresh_until = 0.0

    def file_exists(self) -> bool:
        """Whether the file of keys exists now."""
        return self.path.exists()

    def in_use(self) -> bool:
        """Whether the file of keys exists: it does after the last key was revoked and if it is damaged, so neither
        opens the server."""
        self._keep_fresh()
        return self._stamp is not None

    def entries(self) -> tuple[Key, ...]:
        """All keys; raises KeysUnreadable."""
        self._keep_fresh()
        return self._readable()

    def _keep_fresh(self) -> None:
        now = time.monotonic()
        if now >= self._fresh_until:
            self._refresh()
            self._fresh_until = now + _FRESH_S

    def _refresh(self) -> None:
        stamp: tuple[int, ...] | None
        try:
            status = self.path.stat()
            stamp = (status.st_mtime_ns, status.st_ctime_ns, status.st_ino, status.st_size)
            if stamp != self._stamp:
                self._keys, self._damage = _read(self.path), ""
        except FileNotFoundError:
            stamp, self._keys, self._damage = None, (), ""
        except (OSError, ValueError, KeyError, TypeError) as error:
            stamp, self._damage = (), f"the keys in {self.path} cannot be read: {_reason(error)}"
        self._stamp = stamp

    def _readable(self) -> tuple[Key, ...]:
        if self._damage:
            raise KeysUnreadable(self._damage)
        return self._keys

    def find(self, token: bytes) -> Key | None:
        """The key of `token`, compared in constant time; a key created just now is found at once."""
        digest = sha256(token).hexdigest()
        match = _match(digest, self.entries())
        if match is None:
            self._refresh()
            match = _match(digest, self._readable())
        return match

    def create(self, name: str, scope: Scope) -> str:
        """Store a new key and return its token, which is shown once and stored nowhere."""
        token = "us_" + secrets.token_urlsafe(32)
        created = datetime.now(UTC).isoformat(timespec="seconds")
        with self._changing() as keys:
            if any(key.name == name for key in keys):
                raise not_unique("name", name, "must not be the name of another key; revoke that one first")
            keys.append(Key(name, scope, created, sha256(token.encode()).hexdigest()))
        return token

    def revoke(self, name: str) -> None:
        """Delete a key; raises InvalidInput if no key has that name."""
        with self._changing() as keys:
            remaining = [key for key in keys if key.name != name]
            if len(remaining) == len(keys):
                raise not_one_of("name", name, (key.name for key in keys))
            keys[:] = remaining

    def remove(self) -> None:
        """Delete all keys and the requirement for them; a damaged file is deleted too."""
        with self._locked():
            self.path.unlink(missing_ok=True)

    @contextmanager
    def _changing(self) -> Iterator[list[Key]]:
        """The keys for modification in place, by one process at a time; the file is written completely or not."""
        with self._locked():
            self._refresh()
            keys = list(self._readable())
            yield keys
            _write(self.path, keys)

    @contextmanager
    def _locked(self) -> Iterator[None]:
        make_data_folder(self.path.parent)
        with self.path.with_suffix(".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield


def _match(digest: str, keys: tuple[Key, ...]) -> Key | None:
    match = None
    for key in keys:
        if hmac.compare_digest(digest, key.sha256):
            match = key
    return match


def keys_missing(keys: KeyStore) -> str:
    """The message if keys are required and there is no file of keys."""
    return (
        f"keys are needed, and {keys.path}, which no backup holds, is missing: put it back, or make a key with "
        "`underskin key create NAME`"
    )


def _read(path: Path) -> tuple[Key, ...]:
    keys = tuple(Key(**fields) for fields in json.loads(path.read_text())["keys"])
    for key in keys:
        if not (isinstance(key.name, str) and len(bytes.fromhex(key.sha256)) == sha256().digest_size):
            raise ValueError(f"key {key.name!r} has no digest")
    return keys


def _write(path: Path, keys: list[Key]) -> None:
    text = json.dumps({"keys": [asdict(key) for key in keys]}, indent=1)
    descriptor, partial = tempfile.mkstemp(dir=path.parent, prefix="keys-")  # mode 600
    try:
        with os.fdopen(descriptor, "w") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
    except OSError:  # a full disk
        Path(partial).unlink()
        raise
    durable.replace(Path(partial), path)


def _reason(error: Exception) -> str:
    """Why a file of keys cannot be read, in words."""
    if isinstance(error, OSError):
        return str(error.strerror)
    return str(error) if isinstance(error, ValueError) else "it lacks what a key has"
