"""Files from outside, parsed in a separate process with limits on memory and time.

The child gets the open file without name or path, cannot write more than the limit, and answers in JSON and plain
arrays, so that nothing in the answer is executed. If it dies, FileError names the file.
"""

import importlib
import math
import os
import secrets
import signal
import struct
import subprocess
import sys
import tempfile
from typing import Any, BinaryIO

import numpy as np
import orjson

from underskin.errors import ErrorCode, FileError
from underskin.parallel import limit_process
from underskin.recordings.channels import Block, Channel, Contents, Document, TextColumn
from underskin.recordings.readers import parsing_limits
from underskin.recordings.readers.formats import parse
from underskin.recordings.readers.parsing_limits import ParsingLimits
from underskin.recordings.readers.text import TIME_ZONE
from underskin.recordings.validation import CellText, shown

_INHERITED = ("PATH", "LD_LIBRARY_PATH", "TMPDIR", TIME_ZONE, parsing_limits.EXPANSION)
_LAST_WORDS = 500
_WAIT_TIMES = 5  # wall-clock limit over that of processor time, since a busy machine must not reject a file
_CELL = 2  # entries of a cell in an answer: its text and its place
_LENGTH = struct.Struct("<Q")
_LONG_BYTES = 4 << 20  # arrays of more lie apart from each other (glibc), so that they grow without being copied


def parse_apart(name: str, stream: BinaryIO, file: str, limits: ParsingLimits | None = None) -> Contents | Document:
    """As formats.parse, in a child process; raises FileError also where the child dies or breaks a limit.

    Without limits, those of the settings.
    """
    contents = call_apart(f"{__name__}:_parsed", stream, file, name, what=name, limits=limits)
    if "document" in contents:
        return Document(contents["document"], tuple(contents["warnings"]))
    blocks = []
    for block in contents["blocks"]:
        channels = tuple(Channel(**channel) for channel in block["channels"])
        texts = tuple(TextColumn(**{**column, "texts": tuple(column["texts"])}) for column in block["texts"])
        parts = {"channels": channels, "texts": texts, "group_starts": tuple(block["group_starts"])}
        blocks.append(Block(**{**block, **parts}))
    return Contents(tuple(blocks), contents["properties"], tuple(contents["warnings"]), contents["layout"])


def call_apart(
    function: str, stream: BinaryIO, file: str, *arguments: str, what: str, limits: ParsingLimits | None = None
) -> dict[str, Any]:
    """The answer of `function` ("module:name", called with the stream and the given texts) in a child process.

    The answer consists of JSON types and arrays of one axis; `what` names the format in errors. Raises FileError as
    `parse_apart`.
    """
    limits = limits or ParsingLimits.from_environment()
    longest = limits.content_bytes(stream.seek(0, os.SEEK_END))
    stream.seek(0)
    environment = {key: os.environ[key] for key in _INHERITED if key in os.environ}
    environment |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "HDF5_PLUGIN_PATH": os.devnull}
    environment["MALLOC_MMAP_THRESHOLD_"] = str(_LONG_BYTES)
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))  # the packages of this process
    bounds = [str(limits.memory_bytes), str(limits.seconds), str(longest)]
    command = [sys.executable, "-P", "-m", __name__, function, *bounds, *arguments]
    with tempfile.TemporaryFile() as answer, tempfile.TemporaryFile() as errors:
        child = subprocess.Popen(command, stdin=stream, stdout=answer, stderr=errors, env=environment)
        try:
            status = child.wait(_WAIT_TIMES * limits.seconds)
        except subprocess.TimeoutExpired:
            status = -signal.SIGXCPU
        finally:
            child.kill()
            child.wait()
        if status == -signal.SIGXCPU:
            reason = f"reading it as {what} took more than {limits.seconds:g} s and was stopped"
            raise FileError(file, "", f"{reason} ({parsing_limits.SECONDS})")
        if status != 0:
            raise FileError(file, "", f"the process that read it as {what} {_end(status, errors)}")
        answer.seek(0)
        return _understood(answer, file)


def _end(status: int, errors: BinaryIO) -> str:
    """How the child ended: by a signal, or with its last message."""
    if status < 0:
        return f"was killed by signal {-status}"
    errors.seek(max(0, errors.seek(0, os.SEEK_END) - _LAST_WORDS))
    last = "".join(errors.read().decode("utf-8", "replace").strip().splitlines()[-1:])
    return f"ended with status {status}: {last}"


def _understood(answer: BinaryIO, file: str) -> dict[str, Any]:
    (size,) = _LENGTH.unpack(answer.read(_LENGTH.size))
    header = orjson.loads(answer.read(size))
    contents = header["answer"]
    if "error" in contents:
        error = contents["error"]
        raise FileError(file, error["place"], error["reason"], code=ErrorCode(error["code"]))
    return dict(_with_arrays(contents, header["mark"], answer, _LENGTH.size + size))


def _with_arrays(contents: Any, mark: str, answer: BinaryIO, behind: int) -> Any:
    """The answer with the array for each {mark: [type, start, count]}, the first of which starts at offset `behind`,
    and the cell for each {mark: [text, place]}."""
    if isinstance(contents, list):
        return [_with_arrays(item, mark, answer, behind) for item in contents]
    if not isinstance(contents, dict):
        return contents
    if contents.keys() == {mark}:
        if len(contents[mark]) == _CELL:
            return CellText(*contents[mark])
        kind, start, count = contents[mark]
        answer.seek(behind + start)
        return np.fromfile(answer, dtype=kind, count=count)
    return {name: _with_arrays(value, mark, answer, behind) for name, value in contents.items()}


def _parsed(stream: BinaryIO, name: str) -> dict[str, Any]:
    contents = parse(name, stream, "")
    if isinstance(contents, Contents):
        blocks = [
            {**vars(block), "channels": list(map(vars, block.channels)), "texts": list(map(vars, block.texts))}
            for block in contents.blocks
        ]
        return {**vars(contents), "blocks": blocks}
    return {"document": contents.campaign, "warnings": contents.warnings}


def _main() -> None:
    """The child: file on standard input, answer on standard output."""
    function, memory_bytes, seconds, longest, *given = sys.argv[1:]
    limit_process(int(memory_bytes), file_bytes=int(memory_bytes), cpu_seconds=math.ceil(float(seconds)))
    module, _, name = function.partition(":")
    try:
        with os.fdopen(0, "rb") as stream:
            answer = _encoded(getattr(importlib.import_module(module), name)(stream, *given))
        if sum(memoryview(part).nbytes for part in answer) > int(longest):
            setting = parsing_limits.MEMORY_MB if longest == memory_bytes else parsing_limits.EXPANSION
            most = f"{int(longest) / 1e6:.0f} MB, too much for a file of its size ({setting})"
            raise FileError("", "", f"it unfolds to more than {most}")
    except FileError as error:
        answer = _encoded({"error": {"place": error.place, "reason": error.reason, "code": error.code}})
    except MemoryError:
        reason = f"reading it takes more than {int(memory_bytes) / 1e6:g} MB of memory ({parsing_limits.MEMORY_MB})"
        answer = _encoded({"error": {"place": "", "reason": reason, "code": ErrorCode.UNREADABLE_FILE}})
    with os.fdopen(1, "wb") as out:
        for part in answer:
            out.write(part)


def _encoded(answer: dict[str, Any]) -> list[Any]:
    """The answer's parts. Nothing in a file can imitate an array, since the mark is random."""
    mark = secrets.token_hex(16)
    arrays: list[Any] = []
    position = 0

    def plain(value: Any) -> Any:
        nonlocal position
        match value:  # classes of their own, such as NumPy's texts, come here too
            case CellText():
                return {mark: [str(value), value.place]}
            case str():
                return str(value)
            case int():
                return int(value)
            case list():
                return list(value)
            case dict():
                return dict(value)
        if not isinstance(value, np.ndarray) or value.dtype.kind not in "iufc" or value.ndim != 1:
            return shown(value)
        array = np.ascontiguousarray(value)
        arrays.append(array.data)
        start, position = position, position + array.nbytes
        return {mark: [array.dtype.str, start, array.size]}

    header = orjson.dumps({"mark": mark, "answer": answer}, default=plain, option=orjson.OPT_PASSTHROUGH_SUBCLASS)
    return [_LENGTH.pack(len(header)), header, *arrays]


if __name__ == "__main__":
    _main()
