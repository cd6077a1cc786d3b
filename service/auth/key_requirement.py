"""Whether requests need a key: from the first key on, whatever becomes of keys.json, until `underskin key open`."""

import threading

from service.auth.keys import KeyStore
from service.log import LastingFailure, logger
from service.store import STORE_FAILED, Database, key_requirement

_LOOK_S = 0.5  # how often: revoking and opening take effect within a second
_JOIN_S = 10.0


class KeyRequirement:
    """Whether keys are required, from the store and from keys.json; a thread polls both between `start` and `stop`.

    Once required, keys stay required until the store says that the requirement was lifted: neither a store that does
    not answer nor one restored from before the first key opens the server.
    """

    def __init__(self, keys: KeyStore, store: Database) -> None:
        """Polls nothing yet."""
        self.needed = False
        self._keys = keys
        self._store = store
        self._missing = 0  # looks in a row
        self._failure = LastingFailure()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="key requirement", daemon=True)

    def look(self) -> None:
        """Update `needed`, and the store if keys.json shows that a key was created."""
        row = self._store.read(key_requirement.find)
        if self._keys.file_exists():
            self.needed = True
        elif row is not None:
            self.needed = row.lifted_at is None
        if self.needed and (row is None or row.lifted_at is not None):
            self._note()

    def start(self) -> None:
        """Start polling."""
        self._thread.start()

    def stop(self) -> None:
        """Stop polling."""
        self._ending.set()
        if self._thread.ident is not None:
            self._thread.join(_JOIN_S)

    def _note(self) -> None:
        with self._store.writing() as connection:
            row = key_requirement.find(connection)
            # `underskin key open` removes keys.json before it lifts the requirement.
            if row is None or self._keys.file_exists():
                key_requirement.require(connection)

    def _watch(self) -> None:
        while not self._ending.wait(_LOOK_S):
            try:
                self.look()
                self._warn_of_missing_keys()
                self._store.require_in_place()  # connections that are open read on where the file was moved
                self._failure.is_over()
            except STORE_FAILED as error:
                self._failure.log("whether keys are needed cannot be looked up", error)

    def _warn_of_missing_keys(self) -> None:
        # At the second look: `underskin key open` removes keys.json before it lifts the requirement.
        self._missing = self._missing + 1 if self.needed and not self._keys.file_exists() else 0
        if self._missing == 2:
            logger.warning(
                "keys are needed and %s is missing: put it back, or make a key with `underskin key create NAME`",
                self._keys.path,
            )
