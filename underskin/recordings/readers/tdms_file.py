"""LabVIEW TDMS, read by npTDMS: each group is a block of channels.

A TDMS file is a sequence of segments, each preceded by its length. An interrupted acquisition leaves the last one
without length, or shorter than stated: the segments before it are read, with a warning.
"""

import io
import struct
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any, BinaryIO

import numpy as np
from nptdms import TdmsChannel, TdmsFile, TdmsGroup
from nptdms.timestamp import TdmsTimestamp

from underskin.errors import FileError, damage_said
from underskin.recordings.channels import FIRST_YEAR, Block, Channel, Contents, as_values, with_distinct_names

MAGIC = b"TDSm"
_LEAD_IN = 28
_LEAST_STEP_S, _LONGEST_S = 1e-12, 1e8  # from a picosecond to three years
_BIG_ENDIAN = 1 << 6  # in the table of contents of a segment


def read(stream: BinaryIO, file: str) -> Contents:
    """The channels of a TDMS file; raises FileError that names the byte or channel."""
    complete_bytes, warnings = _complete_segments(stream, file)
    stream.seek(0)
    with damage_said(
        file, f"segments up to byte {complete_bytes}", lambda error: f"no TDMS: {type(error).__name__}: {error}"
    ):
        tdms = TdmsFile.read(io.BytesIO(stream.read(complete_bytes)), raw_timestamps=True)
        blocks = tuple(_block(group, tdms.properties, file) for group in tdms.groups())
    properties = _properties("", tdms.properties)
    for group in tdms.groups():
        properties |= _properties(f"{group.name}.", group.properties)
    return Contents(tuple(block for block in blocks if block.channels), properties, tuple(warnings))


def _complete_segments(stream: BinaryIO, file: str) -> tuple[int, list[str]]:
    """The number of bytes up to the end of the last complete segment, and a warning if there are more."""
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
    stored = [channel for channel in group.channels() if channel.dtype.kind in "iufc" and len(channel) > 0]
    starts = [_start(channel) for channel in stored]
    known_starts = [start for start in starts if start is not None]
    channels = [
        replace(
            _channel(channel, file), starts_s=(start - min(known_starts)).total_seconds() if start is not None else 0.0
        )
        for channel, start in zip(stored, starts, strict=True)
    ]
    rates = {channel.sample_rate_hz for channel in channels} - {None}
    rate = rates.pop() if len(rates) == 1 else None
    others = (_moment(given) for given in (group.properties.get("DateTime"), about_file.get("DateTime")))
    start_time = min(known_starts) if known_starts else next((moment for moment in others if moment is not None), None)
    recorded_at = None if start_time is None else start_time.isoformat().replace("+00:00", "Z")
    return Block(group.name, with_distinct_names(channels), rate, recorded_at)


def _start(channel: TdmsChannel) -> datetime | None:
    """The time of a waveform's first sample: its start plus its offset."""
    start, offset = _moment(channel.properties.get("wf_start_time")), channel.properties.get("wf_start_offset", 0.0)
    if start is None or not isinstance(offset, int | float) or not abs(offset) < _LONGEST_S:
        return start
    return start + timedelta(seconds=float(offset))


def _moment(given: Any) -> datetime | None:
    """A time stamp, in UTC; None where it is none, or of a clock that was not set."""
    if not isinstance(given, TdmsTimestamp):
        return None
    try:
        moment = datetime(1904, 1, 1, tzinfo=UTC) + timedelta(seconds=given.seconds + given.second_fractions / 2**64)
    except OverflowError:
        return None
    return moment if moment.year >= FIRST_YEAR else None


def _channel(channel: TdmsChannel, file: str) -> Channel:
    with damage_said(file, f"channel {channel.path}", lambda error: f"cannot be read: {type(error).__name__}: {error}"):
        values, about = np.asarray(channel[:]), channel.properties
        step = about.get("wf_increment")
        rate = 1 / step if isinstance(step, float) and _LEAST_STEP_S < step < _LONGEST_S else None
        label = str(about.get("unit_string") or about.get("NI_UnitDescription") or "")
        return Channel(channel.name, label, as_values(values), rate)


def _properties(prefix: str, properties: Mapping[str, Any]) -> dict[str, str | float]:
    return {
        f"{prefix}{name}": float(value) if isinstance(value, int | float | np.number) else str(value)
        for name, value in properties.items()
    }
