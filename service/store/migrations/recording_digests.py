"""Digests of recordings as the versions 0007 and 0014 of the schema keep them.

How a recording was stored, and how its digest was made, stands here as it was then: the code may change, a migration
may not.
"""

import hashlib
import struct
import zlib
from collections.abc import Mapping
from itertools import chain
from typing import Any

import numpy as np
import orjson
import sqlalchemy as sa

NUMBER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
RECORDINGS = sa.table(
    "recordings",
    sa.column("campaign", NUMBER),
    sa.column("position", sa.Integer()),
    sa.column("kind", sa.String()),
    sa.column("scalars", sa.JSON()),
    sa.column("arrays", sa.LargeBinary()),
)

DIGESTS = sa.table(
    "recording_digests",
    sa.column("campaign", NUMBER),
    sa.column("position", sa.Integer()),
    sa.column("digest", sa.String()),
)
COLUMNS = (
    "frequency_hz",
    "frf_re_pc_per_n",
    "frf_im_pc_per_n",
    "coherence",
    "force_n",
    "charge_pc",
    "displacement_mm",
    "time_s",
)
GIVEN = ("frequency_hz", "time_s")  # columns that are chosen, not measured
DESCRIBED = (
    "kind",
    "sensor",
    "indenter_radius_mm",
    "preload_n",
    "dynamic_force_n",
    "position_mm",
    "sample_height_mm",
    "sample_diameter_mm",
)
FEWEST_VALUES = 16  # different ones: noise makes no two measurements agree in so many


def keep(connection: sa.Connection) -> None:
    """Put in the digest of every recording, into a table that has none."""
    stored = sa.select(RECORDINGS.c.kind, RECORDINGS.c.scalars, RECORDINGS.c.arrays).order_by(RECORDINGS.c.position)
    for number in connection.execute(sa.text("SELECT number FROM campaigns")).scalars().all():
        rows = connection.execute(stored.where(RECORDINGS.c.campaign == number), execution_options={"yield_per": 8})
        made = [_digest({**row.scalars, "kind": row.kind}, _unpacked(row.arrays)) for row in rows]
        entries = [
            {"campaign": number, "position": position, "digest": digest}
            for position, digest in enumerate(made)
            if digest is not None
        ]
        if entries:
            connection.execute(DIGESTS.insert(), entries)


def _unpacked(blob: bytes) -> dict[str, Any]:
    """The arrays of a recording: a header of names and counts, then their shuffled bytes, deflated."""
    (size,) = struct.unpack_from("<I", blob)
    header = orjson.loads(blob[4 : 4 + size])
    shuffled = np.frombuffer(zlib.decompress(blob[4 + size :]), np.uint8)
    together = np.ascontiguousarray(shuffled.reshape(8, -1).T).view("<f8").ravel()
    ends = np.cumsum([count for _, count in header])
    return {name: together[end - count : end] for (name, count), end in zip(header, ends, strict=True)}


def _digest(scalars: Mapping[str, Any], arrays: Mapping[str, Any]) -> str | None:
    """A text that identical recordings share; None where nothing can show that another one is identical."""
    columns = {name: arrays[name] for name in COLUMNS if name in arrays}
    described = {name: scalars.get(name) for name in DESCRIBED}
    values: set[float] = set(chain.from_iterable(array for name, array in columns.items() if name not in GIVEN))
    if len(values) < FEWEST_VALUES:
        if scalars.get("recorded_at") is None:
            return None
        described["recorded_at"] = scalars["recorded_at"]
    digest = hashlib.blake2b(orjson.dumps(described), digest_size=16)
    for name, array in columns.items():
        digest.update(f"{name} {len(array)} ".encode())
        digest.update(np.asarray(array, "<f8").tobytes())
    return digest.hexdigest()
