"""The arrays of a recording as one blob: float64, byte-shuffled and deflated, without loss.

Layout: length of the header (4 bytes, little endian), the header (JSON, [[name, count], ...]), then zlib of the
shuffled bytes of all arrays one behind another. Shuffling puts the bytes of equal weight together, where neighbouring
numbers resemble each other.
"""

import struct
import zlib
from collections.abc import Mapping

import numpy as np
import orjson

from underskin.units import Floats

_LEVEL = 1  # higher levels take several times longer and save a few per cent


def pack(arrays: Mapping[str, Floats]) -> bytes:
    """Named arrays of one axis as a blob."""
    header = orjson.dumps([[name, len(values)] for name, values in arrays.items()])
    together = np.concatenate([np.asarray(values, "<f8") for values in arrays.values()]) if arrays else np.empty(0)
    shuffled = np.ascontiguousarray(together.view(np.uint8).reshape(-1, 8).T)
    return struct.pack("<I", len(header)) + header + zlib.compress(shuffled.data, _LEVEL)


def unpack(blob: bytes) -> dict[str, Floats]:
    """What `pack` was given."""
    (size,) = struct.unpack_from("<I", blob)
    header = orjson.loads(blob[4 : 4 + size])
    shuffled = np.frombuffer(zlib.decompress(blob[4 + size :]), np.uint8)
    together = np.ascontiguousarray(shuffled.reshape(8, -1).T).view("<f8").ravel()
    ends = np.cumsum([count for _, count in header])
    return {name: together[end - count : end] for (name, count), end in zip(header, ends, strict=True)}
