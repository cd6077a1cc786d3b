"""LabVIEW TDMS, read by npTDMS: each group is a block of channels.

A TDMS file is a row of segments, each with its length in front. An acquisition that was interrupted leaves the last
one without length, or shorter than it says: what comes before is read, with a warning.
"""

import io
import struct
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Any, BinaryIO

import numpy as np
from nptdms import TdmsChannel, TdmsFile, TdmsGroup
from nptdms.timestamp import TdmsTimestamp

from underskin.errors import FileError, damage_said
from underskin.recordings.channels import FIRST_YEAR, Block, Channel, Contents, as_values, with_distinct_names

MAGIC = b"TDSm"
_LEAD_IN = 28
_BIG_ENDIAN = 1 << 6  # in the table of contents of a segment


def read(stream: BinaryIO, file: str) -> Contents:
    """The channels of a TDMS file; raises FileError that names the byte or channel."""
    whole, warnings = _whole_segments(stream, file)
    stream.seek(0)
    with damage_said(file, f"segments up to byte {whole}", lambda error: f"no TDMS: {type(error).__name__}: {error}"):
        tdms = TdmsFile.read(io.BytesIO(stream.read(whole)), raw_timestamps=True)
        blocks = tuple(_block(group, tdms.properties, file) for group in tdms.groups())
    properties = _properties("", tdms.properties)
    for group in tdms.groups():
        properties |= _properties(f"{group.name}.", group.properties)
    return Contents(tuple(block for block in blocks if block.channels), properties, tuple(warnings))


def _whole_segments(stream: BinaryIO, file: str) -> tuple[int, list[str]]:
    """The bytes up to the end of the last whole segment, and a warning if there are more."""
    size = stream.seek(0, io.SEEK_END)
    position = 0
    while position < size:
        stream.seek(position)
        lead_in = stream.read(_LEAD_IN)
        if not lead_in.startswith(MAGIC[: len(lead_in)]):
            raise FileError(file, f"byte {position}", "no TDMS: a segment must begin here")
        if len(lead_in) < _LEAD_IN:
            break
        order = ">" if lead_in[4] & _BIG_ENDIAN else "<"
        following = position + _LEAD_IN + struct.unpack(f"{order}Q", lead_in[12:20])[0]
        if following > size:  # an interrupted segment has the length 2^64 - 1
            break
        position = following
    if position == 0:
        raise FileError(file, "byte 0", "the acquisition was interrupted before its first segment was whole")
    if position == size:
        return size, []
    return position, [
        f"the acquisition was interrupted: the last {size - position} bytes, no whole segment, are left out"
    ]


def _block(group: TdmsGroup, about_file: Mapping[str, Any], file: str) -> Block:
    channels = [channel for channel in group.channels() if channel.dtype.kind in "iufc" and len(channel) > 0]
    steps = {channel.properties.get("wf_increment") for channel in channels} - {None, 0}
    step = steps.pop() if len(steps) == 1 else None
    rate = 1 / step if isinstance(step, float) and step > 0 else None
    starts = [channel.properties.get("wf_start_time") for channel in channels]
    moments = [_moment(given) for given in (*starts, group.properties.get("DateTime"), about_file.get("DateTime"))]
    began = next((moment for moment in moments if moment is not None), None)
    return Block(group.name, with_distinct_names([_channel(channel, file) for channel in channels]), rate, began)


def _moment(given: Any) -> str | None:
    """A time stamp, which TDMS keeps in UTC; None where it is none, or of a clock that was not set."""
    if not isinstance(given, TdmsTimestamp):
        return None
    try:
        moment = datetime(1904, 1, 1, tzinfo=UTC) + timedelta(seconds=given.seconds + given.second_fractions / 2**64)
    except OverflowError:
        return None
    return moment.isoformat().replace("+00:00", "Z") if moment.year >= FIRST_YEAR else None


def _channel(channel: TdmsChannel, file: str) -> Channel:
    with damage_said(file, f"channel {channel.path}", lambda error: f"cannot be read: {type(error).__name__}: {error}"):
        values = np.asarray(channel[:])
        return Channel(channel.name, str(channel.properties.get("unit_string", "")), as_values(values))


def _properties(prefix: str, properties: Mapping[str, Any]) -> dict[str, str | float]:
    return {
        f"{prefix}{name}": float(value) if isinstance(value, int | float | np.number) else str(value)
        for name, value in properties.items()
    }
