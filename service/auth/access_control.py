"""Access control: allowed Host and Origin headers, API key where one is required, body size within the limit."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from urllib.parse import quote

from service.auth import session
from service.auth.key_requirement import KeyRequirement
from service.auth.keys import Key, KeyStore, KeysUnreadable
from service.auth.sessions import Sessions
from service.log import logger
from service.problems import RETRY_LATER, Refusal, is_browsing

LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "[::1]"})
OPEN = frozenset({"/health", "/ready"})
_OPEN_PAGES = ("/login", "/static/")
_UPLOADS = frozenset({"/v1/campaigns", "/v1/skins/import", "/upload"})
_MOST_OPEN_BYTES = 8000  # of a body that anybody may send: a key and a path fit
SAFE = frozenset({"GET", "HEAD", "OPTIONS"})


@dataclass(kw_only=True, eq=False)
class AccessControl:
    """Rejects requests before they reach a route.

    `keys_always`: the server is reachable from other machines, so every request needs a key; otherwise keys are
    required once one was created, according to `requirement`.
    """

    host_names: frozenset[str]
    keys: KeyStore
    requirement: KeyRequirement
    sessions: Sessions
    keys_always: bool
    max_body_bytes: int
    max_upload_bytes: int

    def __post_init__(self) -> None:
        self._hosts = frozenset(name.encode() for name in self.host_names | LOOPBACK_NAMES)
        self._damage = ""  # of keys.json, as it was logged last

    def check(self, method: str, path: str, headers: Mapping[bytes, bytes], query: bytes = b"") -> Key | None:
        """The key sent with the request, None if none is required; raises Refusal. `query`: query string of the
        address, to which a browser returns after the login."""
        host = headers.get(b"host", b"")
        if _name(host) not in self._hosts:
            raise Refusal(
                421, f"The service is not known as {host.decode('latin-1')!r}; UNDERSKIN_HOSTS lists its names."
            )
        if method not in SAFE:
            _check_origin(headers.get(b"origin"), host)
            self.check_size(_number(headers.get(b"content-length", b"")), path, headers)
        return None if path in OPEN else self._check_key(method, path, headers, query)

    def keys_needed(self) -> bool:
        """Whether a request without a key is rejected."""
        return self.keys_always or self.requirement.needed or self.keys.in_use()

    def keys_missing(self) -> bool:
        """Whether keys are required although keys.json does not exist."""
        return self.keys_needed() and not self.keys.in_use()

    def check_size(self, size: int, path: str, headers: Mapping[bytes, bytes]) -> None:
        """Rejects a body larger than the limit of `path`.

        The connection stays open and the rest of the body is read and dropped: a client or proxy that cannot finish
        sending would report a broken connection instead of the error.
        """
        if path in OPEN or path.startswith(_OPEN_PAGES):
            most, setting, smaller = _MOST_OPEN_BYTES, "", "a key and nothing else"
        elif _takes_files(path, headers):
            most, setting, smaller = self.max_upload_bytes, " (UNDERSKIN_MAX_UPLOAD_MB)", "fewer files a request"
        else:
            most, setting, smaller = self.max_body_bytes, " (UNDERSKIN_MAX_BODY_MB)", "fewer rows a request"
        if size > most:
            limit = f"{most / 1e6:g} MB{setting}"
            raise Refusal(413, f"The body exceeds {limit}; send {smaller}.", title="Body too large")

    def key_of_login(self, token: str) -> Key | None:
        """The key that was typed at the login, None if it is unknown; raises Refusal."""
        with self._readable_keys():
            return self.keys.find(token.strip().encode())

    def _check_key(self, method: str, path: str, headers: Mapping[bytes, bytes], query: bytes) -> Key | None:
        if not self.keys_needed():
            return None
        is_open = path.startswith(_OPEN_PAGES)
        authorization = headers.get(b"authorization", b"")
        try:
            with self._readable_keys():
                key = self._key_of_session(method, headers) if not authorization else self._key_of(authorization)
        except Refusal:
            if is_open:
                return None
            raise
        if key is None and not is_open:
            browsing = is_browsing(path, headers.get(b"accept", b"").decode("latin-1"))
            raise (
                _login_first(method, path, query, headers)
                if browsing
                else _key_first(authorization, self.keys_missing())
            )
        return key

    @contextmanager
    def _readable_keys(self) -> Iterator[None]:
        """Rejects a request that needs the keys while they cannot be read; the reason is logged once per change."""
        try:
            self.keys.entries()
            self._damage = ""
            yield
        except KeysUnreadable as error:
            if str(error) != self._damage:
                self._damage = str(error)
                logger.error("%s", error)
            raise Refusal(
                503, "The API keys of this service cannot be read; its log says why.", headers=RETRY_LATER
            ) from error

    def _key_of(self, authorization: bytes) -> Key | None:
        scheme, _, token = authorization.partition(b" ")
        return self.keys.find(token.strip()) if scheme.lower() == b"bearer" else None

    def _key_of_session(self, method: str, headers: Mapping[bytes, bytes]) -> Key | None:
        """The key of a session cookie. A browser sends the cookie automatically, so a request that changes something
        must also carry the token of a form."""
        if method not in SAFE and b"origin" not in headers:
            return None
        cookie = session.cookie_in(headers)
        key = session.key_of(cookie, self.keys)
        return None if key is None or self.sessions.has_ended(cookie) else key


def goes_to_disk(path: str) -> bool:
    """Whether a body is streamed to disk instead of being held in memory."""
    return path in _UPLOADS


def _takes_files(path: str, headers: Mapping[bytes, bytes]) -> bool:
    """Whether the upload limit applies to a body: files are not read into memory, JSON is."""
    return path in _UPLOADS and not headers.get(b"content-type", b"").startswith(b"application/json")


def _login_first(method: str, path: str, query: bytes, headers: Mapping[bytes, bytes]) -> Refusal:
    """Redirect to the login and then to the requested page or, for a submitted form, to the form's page."""
    if method in SAFE:
        target = f"{quote(path)}?{query.decode('latin-1')}" if query else quote(path)
        return Refusal(303, "Log in with a key first.", headers={"Location": f"/login?next={quote(target)}"})
    form = "/" + headers.get(b"referer", b"").decode("latin-1").partition("//")[2].partition("/")[2]
    lost = {"Location": f"/login?next={quote(form)}&unsent=1"}
    return Refusal(303, "The session has ended: log in and send the form again.", headers=lost)


def _key_first(authorization: bytes, missing: bool) -> Refusal:
    reason = "This key is not known; it may have been revoked." if authorization else "A key is needed."
    if missing:
        reason = (
            "A key is needed, and the service knows none: keys.json is missing from its data folder. "
            "Put it back, or make a key."
        )
    return Refusal(
        401,
        f"{reason} Send Authorization: Bearer KEY (`underskin key create NAME` makes one).",
        headers={"WWW-Authenticate": "Bearer"},
    )


def _check_origin(origin: bytes | None, host: bytes) -> None:
    """Pages of another origin may neither change data nor use computing time here."""
    if origin is not None and origin.lower().partition(b"://")[2] != host.lower():
        raise Refusal(
            403,
            f"Pages of {origin.decode('latin-1')!r} may not call this service; its own are of "
            f"{host.decode('latin-1')!r}.",
        )


def _name(host: bytes) -> bytes:
    """A Host header without its port, in lower case."""
    name, colon, port = host.rpartition(b":")
    return (name if colon and port.isdigit() else host).lower()


def _number(content_length: bytes) -> int:
    return int(content_length) if content_length.isdigit() else 0
