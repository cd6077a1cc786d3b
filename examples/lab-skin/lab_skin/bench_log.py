"""Files of the bench's logger: `BENCHLOG`, then stroke and load cell as pairs of 32-bit floats, little-endian."""

from typing import BinaryIO

import numpy as np

from underskin import FileError
from underskin.recordings.channels import Block, Channel, Contents
from underskin.recordings.readers.formats import FileFormat

MAGIC = b"BENCHLOG"


def read(stream: BinaryIO, file: str) -> Contents:
    """The two channels of a file."""
    data = stream.read()
    if not data.startswith(MAGIC) or (len(data) - len(MAGIC)) % 8:
        raise FileError(file, "byte 0", "must be BENCHLOG and pairs of 32-bit floats")
    stroke, load = np.frombuffer(data, "<f4", offset=len(MAGIC)).astype(float).reshape(-1, 2).T
    return Contents((Block("1", (Channel("Stroke", "mm", stroke), Channel("Load cell", "mV", load))),))


BENCH_LOG = FileFormat("bench log", (".benchlog",), read)
