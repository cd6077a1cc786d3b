"""The browser's session: a cookie that names the key used at the login, and the token that its forms must carry.

The cookie is signed with the stored digest of its key, so it is stored nowhere, survives a restart, and ends when the
key is revoked; a single session is ended by its id (sessions.py). Before a login, or if no key is required, the cookie
is a random text that only binds the forms.
"""

import base64
import hmac
import re
import secrets
import time
from collections.abc import Mapping
from hashlib import sha256

from starlette.requests import Request

from service.auth.keys import Key, KeyStore

COOKIE = "underskin_session"
LASTS_S = 7 * 86400
_ID_DIGITS = 16
_TIME = re.compile("[0-9]{1,12}")  # in seconds since 1970


def anonymous() -> str:
    """A cookie for a browser that has not logged in."""
    return secrets.token_urlsafe(24)


def logged_in(key: Key) -> str:
    """A cookie for a browser that has logged in with a key."""
    body = f"{anonymous()}.{key.sha256[:_ID_DIGITS]}.{int(time.time()) + LASTS_S}"
    return f"{body}.{_signature(key, body)}"


def id_of(cookie: str) -> str:
    """The public id of a session in lists; it reveals nothing of the cookie."""
    return sha256(cookie.encode("utf-8", "replace")).hexdigest()[:_ID_DIGITS]


def expires(cookie: str) -> int:
    """When a session made by `logged_in` expires, in seconds since 1970."""
    return int(cookie.split(".")[2])


def key_of(cookie: str, keys: KeyStore) -> Key | None:
    """The key of the login; None for a cookie that is anonymous, expired, or of an unknown key."""
    body, dot, signature = cookie.rpartition(".")
    parts = body.split(".")
    if not dot or len(parts) != 3 or not _TIME.fullmatch(parts[2]) or int(parts[2]) < time.time():
        return None
    for key in keys.entries():
        if key.sha256.startswith(parts[1]) and hmac.compare_digest(signature.encode(), _signature(key, body).encode()):
            return key
    return None


def form_token(cookie: str) -> str:
    """The token in this session's forms: another site can neither read the cookie nor guess it."""
    return _digest(cookie.encode(), b"form")


def is_form_token(cookie: str, token: str) -> bool:
    """Whether a form's token belongs to this session."""
    return bool(cookie) and hmac.compare_digest(form_token(cookie).encode(), token.encode("utf-8", "replace"))


def cookie_in(headers: Mapping[bytes, bytes]) -> str:
    """The session cookie of a request, empty if there is none."""
    # By hand: other services of the same host may have set cookies that http.cookies stops at.
    for part in headers.get(b"cookie", b"").decode("latin-1").split(";"):
        name, _, value = part.strip().partition("=")
        if name == COOKIE:
            return value
    return ""


def cookie_of(request: Request) -> str:
    """The same of a request as routes have it."""
    return cookie_in(dict(request.scope["headers"]))


def _signature(key: Key, body: str) -> str:
    return _digest(bytes.fromhex(key.sha256), f"session {body}".encode())


def _digest(secret: bytes, message: bytes) -> str:
    return base64.urlsafe_b64encode(hmac.digest(secret, message, "sha256")).decode().rstrip("=")
