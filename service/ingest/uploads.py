"""Uploads, streamed into files under names of our own; the limits are enforced while data arrive.

A file's own name is stored as a label. It is never used as a path, and does not determine the file's type. Files are
written outside the event loop, one megabyte at a time: a slow or hanging disk delays only uploads, which have their own
threads.
"""

import fcntl
import hashlib
import math
import shutil
import tempfile
from collections import Counter
from collections.abc import AsyncIterator, Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Self, TypeVar

from anyio import CancelScope, CapacityLimiter, to_thread
from fastapi import Request
from python_multipart import MultipartParser
from python_multipart.exceptions import FormParserError
from python_multipart.multipart import parse_options_header

from service.problems import Refusal, invalid_input, unknown_name
from service.store import StoreMoved
from service.store.engine import storage_failure
from underskin.errors import InvalidInput, not_unique, wrong_type

if TYPE_CHECKING:
    from python_multipart.multipart import MultipartCallbacks

_AT_ONCE_BYTES = 1 << 20  # that are written in one go: a thread for each chunk of a body would cost more than it writes
_THREADS = 8
_Result = TypeVar("_Result")
FOLDER = "uploads"  # in the data folder: on the disk that the store is on
_MOST_PARTS = 1000
_LONGEST_HEADER = 4096
_LONGEST_LABEL = 200
FILE = "file"  # a part of this name is a file, also where its sender gives no file name
_LONGEST_TEXT = 4096  # bytes


class DiskThreads:
    """A small thread pool for writing uploads, separate from the threads that answer other requests."""

    def __init__(self) -> None:
        """Within the event loop."""
        self._limiter = CapacityLimiter(_THREADS)

    async def run(self, work: Callable[[], _Result]) -> _Result:
        """The result of `work`, or its exception."""
        return await to_thread.run_sync(work, limiter=self._limiter)


class ArrivingFile:
    """A file being received; data are buffered until written."""

    def __init__(self, path: Path) -> None:
        """Empty; the file is created at the first write."""
        self.path = path
        self.held = bytearray()
        self.ended = False
        self._file: BinaryIO | None = None
        self._digest = hashlib.sha256()

    @property
    def sha256(self) -> str:
        """SHA-256 digest of the written data."""
        return self._digest.hexdigest()

    def write(self) -> None:
        """Write the buffer, and close the file if it is complete."""
        if self._file is None:
            self._file = self.path.open("xb")
        self._file.write(self.held)
        self._digest.update(self.held)
        self.held = bytearray()
        if self.ended:
            self._file.close()

    def close(self) -> None:
        """Discard the file if it is incomplete."""
        if self._file is not None:
            self._file.close()


class ArrivingFiles:
    """The files of a request, one after the other, in a folder of their own."""

    def __init__(self, folder: Path, threads: DiskThreads) -> None:
        """An empty folder."""
        self._folder = folder
        self._threads = threads
        self._count = 0
        self._unwritten: list[ArrivingFile] = []  # the last of them is the one that comes
        self._held_bytes = 0

    @classmethod
    @asynccontextmanager
    async def below(cls, parent: Path, threads: DiskThreads) -> AsyncIterator[Self]:
        """In a new folder, removed at the end of the block."""
        folder = await threads.run(partial(tempfile.TemporaryDirectory, dir=parent))
        files = cls(Path(folder.name), threads)

        def remove() -> None:
            for file in files._unwritten:
                file.close()
            folder.cleanup()

        try:
            yield files
        finally:
            with CancelScope(shield=True):
                await threads.run(remove)

    def begin(self) -> ArrivingFile:
        """Start the next file."""
        file = ArrivingFile(self._folder / str(self._count))
        self._count += 1
        self._unwritten.append(file)
        return file

    def take(self, data: bytes | memoryview) -> None:
        """Append data to the current file."""
        self._unwritten[-1].held += data
        self._held_bytes += len(data)

    def end(self) -> None:
        """The current file is complete."""
        self._unwritten[-1].ended = True

    async def write_much(self) -> None:
        """Write the buffers if they are large."""
        if self._held_bytes >= _AT_ONCE_BYTES:
            await self.write()

    async def write(self) -> None:
        """Write the buffers."""
        await self._threads.run(self._write)

    def _write(self) -> None:
        for file in self._unwritten:
            file.write()
        self._unwritten = [file for file in self._unwritten if not file.ended]
        self._held_bytes = 0


@dataclass(frozen=True)
class Upload:
    """One file: its path, the client's name for it, its form field if any, its digest, and in `said` the values of its
    recordings stated for this file alone."""

    path: Path
    label: str | None
    field: str | None
    sha256: str
    in_form: bool
    said: Mapping[str, Any] | None = None

    def start(self, most: int) -> bytes:
        """Its first bytes."""
        with self.path.open("rb") as file:
            return file.read(most)

    def text(self, most: int) -> str:
        """The value of a text field, up to so many bytes."""
        return self.start(most).decode("utf-8", "replace").strip()


def texts(fields: Iterable[Upload], most: int) -> dict[str, str]:
    """The values of text fields by name, each up to so many bytes."""
    return {upload.field or "": upload.text(most) for upload in fields}


class UploadFolder:
    """This server's folder of current uploads; remains of servers that were killed are removed."""

    def __init__(self, data_folder: Path) -> None:
        parent = data_folder / FOLDER
        parent.mkdir(parents=True, exist_ok=True)
        with (parent / ".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            for leftover in parent.iterdir():
                if leftover.is_dir() and _is_unused(leftover):
                    shutil.rmtree(leftover)
            self.path = Path(tempfile.mkdtemp(dir=parent))
            self._in_use = (self.path / ".lock").open("w")  # held as long as the process lives
            fcntl.flock(self._in_use, fcntl.LOCK_EX)
        self.threads = DiskThreads()

    def close(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self.path, ignore_errors=True)
        self._in_use.close()


def _is_unused(folder: Path) -> bool:
    try:
        with (folder / ".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


@asynccontextmanager
async def received(request: Request, parent: UploadFolder, most_bytes: float = math.inf) -> AsyncIterator[list[Upload]]:
    """The files of a multipart form, or the whole body as one file; removed at the end of the block.

    Raises Refusal if a form cannot be read (400), the content type does not match (415) or the body exceeds
    `most_bytes` or the limit of all uploads (413); StorageFailed if the disk is full or not writable.
    """
    with disk_errors_refused(parent):
        async with ArrivingFiles.below(parent.path, parent.threads) as files:
            content_type, options = parse_options_header(request.headers.get("content-type", ""))
            if content_type == b"application/x-www-form-urlencoded":
                must = "Files come as they are (application/octet-stream) or as a form of multipart/form-data."
                raise Refusal(415, must)
            if content_type == b"multipart/form-data":
                yield await _take_parts(_body(request, most_bytes), files, options.get(b"boundary", b""))
            else:
                yield [await _receive_body(_body(request, most_bytes), files)]


@contextmanager
def disk_errors_refused(folder: UploadFolder) -> Iterator[None]:
    """Turns the system's errors into StorageFull (disk full), StorageFailed (disk not writable) and StoreMoved (upload
    folder gone)."""
    try:
        yield
    except OSError as error:
        if not folder.path.is_dir():
            raise StoreMoved(
                f"The folder {folder.path} was removed while the service runs: put the data folder back, or restart "
                "the service."
            ) from error
        failure = storage_failure(error)
        if failure is not None:
            raise failure from error
        raise


async def _body(request: Request, most_bytes: float) -> AsyncIterator[bytes]:
    size = 0
    async for chunk in request.stream():
        size += len(chunk)
        if size > most_bytes:
            raise Refusal(413, f"The body exceeds {most_bytes / 1e6:g} MB; send less.", title="Body too large")
        yield chunk


async def _receive_body(body: AsyncIterator[bytes], files: ArrivingFiles) -> Upload:
    file = files.begin()
    async for chunk in body:
        files.take(chunk)
        await files.write_much()
    files.end()
    await files.write()
    return Upload(file.path, None, None, file.sha256, in_form=False)


async def _take_parts(body: AsyncIterator[bytes], files: ArrivingFiles, boundary: bytes) -> list[Upload]:
    form = _Form(files)
    try:
        parser = MultipartParser(boundary, form.callbacks())
        async for chunk in body:
            parser.write(chunk)
            await files.write_much()
        parser.finalize()
    except FormParserError as error:  # of the boundary, too
        raise Refusal(400, f"The multipart form cannot be read: {error}.") from None
    if not form.ended:
        raise Refusal(400, "The multipart form ends in the middle of a part.")
    await files.write()
    return [part.upload() for part in form.parts]


@dataclass
class _FormPart:
    """A part being received."""

    file: ArrivingFile
    headers: dict[bytes, bytes] = field(default_factory=dict)

    def upload(self) -> Upload:
        _, options = parse_options_header(self.headers.get(b"content-disposition", b""))
        label, name = options.get(b"filename"), options.get(b"name")
        return Upload(self.file.path, _text(label), _text(name), self.file.sha256, in_form=True)


class _Form:
    """Takes the parser's callbacks: a part's headers, then its data."""

    def __init__(self, files: ArrivingFiles) -> None:
        self._files = files
        self._name = b""
        self._value = b""
        self.parts: list[_FormPart] = []
        self.ended = False

    def callbacks(self) -> "MultipartCallbacks":
        """The parser's callbacks by name."""
        return {
            "on_part_begin": self._begin,
            "on_header_field": self._header_field,
            "on_header_value": self._header_value,
            "on_header_end": self._header_end,
            "on_part_data": self._data,
            "on_part_end": self._files.end,
            "on_end": self._finish,
        }

    def _begin(self) -> None:
        if len(self.parts) == _MOST_PARTS:
            raise Refusal(413, f"The form has more than {_MOST_PARTS} parts; send fewer files a request.")
        self.parts.append(_FormPart(self._files.begin()))

    def _header_field(self, data: bytes, start: int, end: int) -> None:
        self._name = _short(self._name + data[start:end])

    def _header_value(self, data: bytes, start: int, end: int) -> None:
        self._value = _short(self._value + data[start:end])

    def _header_end(self) -> None:
        self.parts[-1].headers[self._name.lower()] = self._value
        self._name = self._value = b""

    def _data(self, data: bytes, start: int, end: int) -> None:
        self._files.take(memoryview(data)[start:end])

    def _finish(self) -> None:
        self.ended = True


def _short(header: bytes) -> bytes:
    if len(header) > _LONGEST_HEADER:
        raise Refusal(400, f"A header of a part is longer than {_LONGEST_HEADER} bytes.")
    return header


def _text(value: bytes | None) -> str | None:
    """A client's name for something, as a short printable label."""
    if value is None:
        return None
    text = "".join(letter for letter in value.decode("utf-8", "replace") if letter.isprintable())
    return text[:_LONGEST_LABEL]


def split(
    uploads: Sequence[Upload], texts: Collection[str] = (), single_files: Collection[str] = ()
) -> tuple[dict[str, str], list[Upload]]:
    """The values of the text fields `texts`, and all other parts, which are files; a body that is not a form is one
    file.

    A part with a file name is a file, whatever its field name; a field of `single_files` may come once. Raises Refusal
    (422) naming each field that is unknown, given twice, or a file in place of a text.
    """
    form = [upload for upload in uploads if upload.in_form]
    errors = [error for upload in form for error in _errors(upload, texts, single_files)]
    count = Counter(upload.field for upload in form)
    once = (*texts, *single_files)
    errors += [not_unique(name, f"{count[name]} parts") for name in once if count[name] > 1]
    if errors:
        raise invalid_input(errors)
    values = {str(upload.field): upload.path.read_bytes().decode() for upload in form if upload.field in texts}
    return values, [upload for upload in uploads if upload.field not in texts]


def _errors(upload: Upload, texts: Collection[str], single_files: Collection[str]) -> Iterator[InvalidInput]:
    """Errors of one part of a form."""
    name = upload.field or ""
    names = (*texts, FILE, *single_files)
    if upload.label is None and name not in names:
        yield unknown_name(name, _start_of(upload), names, "form field")
    elif name in texts and upload.label is not None:
        yield wrong_type(name, upload.label, "must be a text, not a file")
    elif name in texts and not _is_short_text(upload):
        yield wrong_type(name, _start_of(upload), f"must be text in UTF-8 of at most {_LONGEST_TEXT} bytes")


def _is_short_text(upload: Upload) -> bool:
    if upload.path.stat().st_size > _LONGEST_TEXT:
        return False
    try:
        upload.path.read_bytes().decode()
    except UnicodeDecodeError:
        return False
    return True


def _start_of(upload: Upload) -> str:
    """The start of a text, as long as an error message shows."""
    return upload.start(100).decode("utf-8", "replace")
