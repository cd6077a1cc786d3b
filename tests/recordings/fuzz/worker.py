"""Reads damaged files for the fuzz test, many in one process, under the memory limit of the process for real ones.

Standard input: for each file its format (16 bytes), its length (8 bytes) and its bytes. Standard output: a line each:
`read`, `refused`, `no memory`, or what the reader raised that it should not have. A file that takes more than SECONDS
ends the process.
"""

import contextlib
import importlib
import os
import resource
import signal
import struct
import sys
from pathlib import Path
from typing import BinaryIO

from tests.support.instrument_files import rig
from underskin.errors import FileError, InvalidInput
from underskin.recordings import rig_mapping
from underskin.recordings.campaign import from_dict
from underskin.recordings.channels import Contents
from underskin.recordings.readers import formats

SECONDS = 10
_MEMORY_BYTES = 1 << 30
_FILE = "fuzz.dat"
_RIG = rig()
_HEAD = struct.Struct("<16sQ")


def main() -> None:
    for module in formats.MODULES.values():
        importlib.import_module(f"underskin.recordings.readers.{module}")
    own = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (own + _MEMORY_BYTES, own + _MEMORY_BYTES))
    while head := sys.stdin.buffer.read(_HEAD.size):
        kind, length = _HEAD.unpack(head)
        data = sys.stdin.buffer.read(length)
        with os.fdopen(os.memfd_create("fuzz"), "w+b") as stream:
            stream.write(data)
            stream.flush()
            signal.alarm(SECONDS)
            said = _read(kind.rstrip(b"\0").decode(), stream)
            signal.alarm(0)
        print(said.replace("\n", " "), flush=True)


def _read(kind: str, stream: BinaryIO) -> str:
    try:
        _detect(stream)
        contents = formats.parse(kind, stream, _FILE)  # as the format that it was before it was damaged
        if isinstance(contents, Contents):
            from_dict(rig_mapping.apply(_RIG, contents, _FILE).document)
        else:
            from_dict(contents.campaign)
    except FileError as error:
        return "refused" if error.file == _FILE and error.reason else f"an error that does not say what: {error}"
    except InvalidInput as error:
        return "refused" if error.field and error.allowed else f"an error that does not say what: {error}"
    except MemoryError:
        return "no memory"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return "read"


def _detect(stream: BinaryIO) -> None:
    with contextlib.suppress(FileError):
        assert formats.detect(stream, _FILE) in formats.MODULES


if __name__ == "__main__":
    main()
