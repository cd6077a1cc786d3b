"""HTTP requests to the service, with its errors as exceptions."""

import io
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeVar
from urllib.parse import quote

import httpx
import numpy as np
import orjson

from underskin.client.document import Document
from underskin.errors import InvalidInput, ServiceError, Unreachable
from underskin.units import Array

Item = TypeVar("Item", bound=Document)

_NPZ = "application/x-npz"
_PROBLEM = "application/problem+json"
_CONNECT_S = 10.0  # for a network that drops everything, long before a large file would take too long

_ELSEWHERE = " (where it is elsewhere: base_url of Client, --url or UNDERSKIN_URL of the command line)"


class Session:
    """The service at `base_url`; every request raises ServiceError (refused or failed) or Unreachable (no answer).

    Raises InvalidInput for an address or a key that cannot be one.
    """

    def __init__(self, base_url: str, api_key: str | None, timeout: float) -> None:
        if not re.match(r"https?://[^/]", base_url):
            raise InvalidInput("url", base_url, "must begin with http:// or https:// and a host")
        headers = {"Accept": "application/json"}
        if api_key is not None:
            if not api_key.isascii() or not api_key.isprintable():
                raise InvalidInput("api_key", "…", "must be of ASCII letters, as `underskin key create` prints it")
            headers["Authorization"] = f"Bearer {api_key}"
        try:
            within = httpx.Timeout(timeout, connect=min(timeout, _CONNECT_S))
            self.http = httpx.Client(base_url=base_url, headers=headers, timeout=within)
        except httpx.InvalidURL as error:
            raise InvalidInput("url", base_url, f"must be an address: {error}") from None

    def json(self, method: str, path: str, params: Mapping[str, Any] | None = None, **options: Any) -> dict[str, Any]:
        """The JSON object of the answer; `options` as `answered` has them."""
        return self.answered(method, path, params, **options)[0]

    def answered(
        self, method: str, path: str, params: Mapping[str, Any] | None = None, **options: Any
    ) -> tuple[dict[str, Any], httpx.Headers]:
        """The JSON object of the answer, and its headers; `options` as httpx has them, parameters of None not sent."""
        query = {name: value for name, value in (params or {}).items() if value is not None}
        with self._reaching():
            response = self.http.request(method, path, params=query, **options)
        document = _document(response)
        if document is None or not response.is_success:
            raise ServiceError(response.status_code, _problem(response))
        return document, response.headers

    def pages(self, kind: type[Item], noun: str, /, **filters: str | None) -> Iterator[Item]:
        """The items of a list, page after page."""
        cursor: str | None = None
        while True:
            page = self.json("GET", f"/v1/{noun}", {"limit": 200, "cursor": cursor, **filters})
            yield from map(kind.from_json, page[noun])
            cursor = page["next"]
            if cursor is None:
                return

    def arrays(self, path: str, sent: Mapping[str, Any]) -> dict[str, Array]:
        """The arrays of an answer to arrays, texts and booleans that are posted, both ways as NumPy's .npz."""
        file = io.BytesIO()
        np.savez(file, allow_pickle=False, **sent)
        headers = {"Content-Type": _NPZ, "Accept": _NPZ}
        with self.stream("POST", path, content=file.getvalue(), headers=headers) as response:
            content = response.read()
        if response.headers.get("content-type") != _NPZ:
            raise ServiceError(response.status_code, _problem(response))
        with np.load(io.BytesIO(content), allow_pickle=False) as answered:
            return dict(answered)

    @contextmanager
    def stream(self, method: str, path: str, **options: Any) -> Iterator[httpx.Response]:
        """An answer of any type, read in chunks."""
        with self._reaching(), self.http.stream(method, path, **options) as response:
            if not response.is_success:
                response.read()
                raise ServiceError(response.status_code, _problem(response))
            yield response

    @contextmanager
    def _reaching(self) -> Iterator[None]:
        try:
            yield
        except httpx.TransportError as error:
            reason = "no answer in time" if isinstance(error, httpx.TimeoutException) else error
            raise Unreachable(f"the service at {self.http.base_url} cannot be reached: {reason}{_ELSEWHERE}") from error


class Resource:
    """What the client offers of one noun of the service."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def _asked(
        self, kind: type[Item], method: str, path: str, params: Mapping[str, Any] | None = None, **options: Any
    ) -> Item:
        """The answer to a request, which is as `Session.answered` has it."""
        return kind.from_json(self._session.json(method, path, params, **options))


def path_of(noun: str, identity: str, *more: str) -> str:
    """The path of a campaign, skin or diagnosis, or of a resource below it."""
    return "/".join(("/v1", noun, quote(identity, safe=""), *more))


def _document(response: httpx.Response) -> dict[str, Any] | None:
    """The JSON object of an answer; None for other content."""
    try:
        document = orjson.loads(response.content)
    except orjson.JSONDecodeError:
        return None
    return document if isinstance(document, dict) else None


def _problem(response: httpx.Response) -> dict[str, Any]:
    """The problem document of an answer; one without a `type` for an answer of another program, such as a proxy."""
    if response.headers.get("content-type", "").startswith(_PROBLEM):
        document = _document(response)
        if document is not None and str(document.get("type")).startswith("urn:underskin:problem:"):
            return document
    return {"title": response.reason_phrase, "detail": f"not an answer of underskin: {response.text[:200]!r}"}
