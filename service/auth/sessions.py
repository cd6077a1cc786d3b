"""Open sessions in the store: each login is recorded, and ending a session ends it on every server."""

import threading
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from datetime import UTC, datetime

from service.auth import session
from service.auth.keys import Key
from service.log import LastingFailure
from service.store import STORE_FAILED, AnyRow, Database, Missing, sessions
from service.store.times import stored

_LOOK_S = 0.5  # how often: an ended session is refused within a second
_JOIN_S = 10.0
_LONGEST_BROWSER = 200


class Sessions:
    """Ended sessions; a thread polls the store between `start` and `stop`.

    An ended session stays ended for this process, whatever store is restored meanwhile.
    """

    def __init__(self, store: Database) -> None:
        """Polls nothing yet."""
        self._store = store
        self._ended: frozenset[str] = frozenset()
        self._adding = threading.Lock()
        self._failure = LastingFailure()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="sessions", daemon=True)

    def has_ended(self, cookie: str) -> bool:
        """Whether the session of a cookie was ended, as of the last poll."""
        return session.id_of(cookie) in self._ended

    def begin(self, key: Key, address: str, browser: str) -> str:
        """The cookie of a new session, recorded in the store; if that fails, the log says why the session is not
        listed."""
        cookie = session.logged_in(key)
        expires_at = stored(datetime.fromtimestamp(session.expires(cookie), UTC).isoformat())
        shown = "".join(letter for letter in browser if letter.isprintable())[:_LONGEST_BROWSER]
        noted = sessions.NewSession(session.id_of(cookie), key.name, key.sha256, address, shown, expires_at)
        try:
            self._store.write(sessions.add, noted)
        except STORE_FAILED as error:  # on a full disk stored data can still be read, also by those who log in now
            self._failure.log("a login cannot be noted: the session ends with its key, or when it expires", error)
        return cookie

    def listed(self, key: Key) -> Sequence[AnyRow]:
        """The open sessions of a key, the latest first."""
        return self._store.read(sessions.listed, key.sha256)

    def end(self, session_id: str, key: Key) -> None:
        """End a session of a key, at once on this server; raises Missing, and as Database.writing."""
        self._store.write(sessions.end, session_id, key.sha256)
        self._add({session_id})

    def log_out(self, cookie: str, key: Key) -> None:
        """End the session of a cookie on this server even if the store fails; a failure is logged."""
        self._add({session.id_of(cookie)})
        try:
            self._store.write(sessions.end, session.id_of(cookie), key.sha256)
        except Missing:
            pass  # it began before sessions were noted
        except STORE_FAILED as error:
            self._failure.log("a logout cannot be kept: the session ends on this server alone", error)

    def look(self) -> None:
        """Update the set of ended sessions."""
        self._add(self._store.read(sessions.ended))

    def start(self) -> None:
        """Start polling."""
        self._thread.start()

    def stop(self) -> None:
        """Stop polling."""
        self._ending.set()
        if self._thread.ident is not None:
            self._thread.join(_JOIN_S)

    def _add(self, ended: AbstractSet[str]) -> None:
        """Add under a lock, so that no addition of another thread is lost."""
        with self._adding:
            self._ended |= ended

    def _watch(self) -> None:
        while not self._ending.wait(_LOOK_S):
            try:
                self.look()
                self._store.require_in_place()  # connections that are open read on where the file was moved
                self._failure.is_over()
            except STORE_FAILED as error:
                self._failure.log("which sessions were ended cannot be looked up", error)
