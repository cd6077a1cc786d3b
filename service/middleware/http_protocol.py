"""HTTP/1.1 as uvicorn speaks it, with a limit on what is no body.

httptools collects a request's line, headers and trailers without one: who never ends them would fill the memory,
without a key.
"""

from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

_MOST_HEAD_BYTES = 64_000  # counted as it comes in, so that one read at most is beyond it


class LimitedHttpProtocol(HttpToolsProtocol):
    """One connection; answers 400 and closes where request line and headers, or trailers, exceed 64 kB."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._head_bytes = 0  # since the last part of a body, or the end of the headers

    def data_received(self, data: bytes) -> None:
        """What the client sent next."""
        self._head_bytes += len(data)
        super().data_received(data)
        if self._head_bytes > _MOST_HEAD_BYTES and not self.transport.is_closing():
            self.send_400_response(f"The request line and headers exceed {_MOST_HEAD_BYTES // 1000} kB.")

    def on_headers_complete(self) -> None:
        """A body, or the next request, follows."""
        self._head_bytes = 0
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """Part of a body; the application counts it."""
        self._head_bytes = 0
        super().on_body(body)
