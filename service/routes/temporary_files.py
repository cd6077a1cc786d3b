"""A file made for an answer: on the disk while it is sent, not in memory."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import anyio
from fastapi import Request, Response
from fastapi.responses import FileResponse
from starlette.types import Receive, Scope, Send

from service.ingest.uploads import UploadFolder, disk_errors_refused
from service.middleware.asgi_middleware import WITHOUT_CONTENT


class MadeFile(FileResponse):
    """Sends a file and removes it, however that ends.

    It is sent whole, whatever `Range` asks for: that of the next request is made anew, and parts of two are no file.
    """

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The answer."""
        headers = [(name, value) for name, value in scope["headers"] if name != b"range"]
        self.headers["Accept-Ranges"] = "none"
        try:
            await super().__call__({**scope, "headers": headers}, receive, send)
        finally:
            with anyio.CancelScope(shield=True):
                await anyio.to_thread.run_sync(Path(self.path).unlink)


def made_file(request: Request, name: str, media_type: str, write: Callable[[Path], object]) -> Response:
    """The answer that sends what `write` wrote; nothing is written where only its headers are sent.

    Raises StorageFailed where the disk is full or takes nothing, StoreMoved where the folder is gone.
    """
    if WITHOUT_CONTENT in request.scope:
        headers = FileResponse("", media_type=media_type, filename=name).headers
        answer = Response(headers=headers)
        del answer.headers["Content-Length"]  # unknown as long as nothing is written
        return answer
    folder: UploadFolder = request.app.state.uploads
    with disk_errors_refused(folder):
        with tempfile.NamedTemporaryFile(dir=folder.path, delete=False) as file:
            path = Path(file.name)
        try:
            write(path)
        except BaseException:
            path.unlink()
            raise
    return MadeFile(path, media_type=media_type, filename=name)
