"""A file made for an answer: on the disk while it is sent, not in memory."""

import tempfile
from collections.abc import Callable
from pathlib import Path

from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from service.ingest.uploads import UploadFolder, disk_errors_said


def made_file(folder: UploadFolder, name: str, media_type: str, write: Callable[[Path], object]) -> FileResponse:
    """The answer that sends what `write` wrote, removed afterwards.

    Raises StorageFull where the disk is full, StoreMoved where the folder is gone.
    """
    with disk_errors_said(folder):
        with tempfile.NamedTemporaryFile(dir=folder.path, delete=False) as file:
            path = Path(file.name)
        try:
            write(path)
        except BaseException:
            path.unlink()
            raise
    return FileResponse(
        path, media_type=media_type, filename=name, background=BackgroundTask(path.unlink, missing_ok=True)
    )
