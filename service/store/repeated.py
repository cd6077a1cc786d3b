"""Recordings that come a second time."""

import hashlib

import orjson
from sqlalchemy import Connection, func, select

from service.store import campaigns, codec
from service.store.tables import AnyRow, recordings
from service.store.tables import campaigns as kept
from underskin.recordings.campaign import Campaign

_MOST_COMPARED = 20  # campaigns that hold the first recording's numbers
_AT_A_TIME = 8  # recordings in memory at once


def campaign_with(connection: Connection, campaign: Campaign) -> AnyRow | None:
    """The latest current campaign that has all recordings of this one, number for number, whatever their ids."""
    rows = [codec.recording_columns(recording) for recording in campaign.recordings]
    coming = [_content(row["kind"], row["scalars"], row["arrays"]) for row in rows]
    first = rows[0]["arrays"]
    # By length before content: a length is read without the arrays.
    alike = (func.length(recordings.c.arrays) == len(first)) & (recordings.c.arrays == first)
    query = select(kept).where(campaigns.CURRENT, kept.c.recordings >= len(rows))
    query = query.where(kept.c.number.in_(select(recordings.c.campaign).where(alike)))
    for row in connection.execute(query.order_by(kept.c.number.desc()).limit(_MOST_COMPARED)).all():
        held = select(recordings.c.kind, recordings.c.scalars, recordings.c.arrays)
        held = held.where(recordings.c.campaign == row.number).execution_options(yield_per=_AT_A_TIME)
        here = {_content(*one) for one in connection.execute(held)}
        if here.issuperset(coming):
            return row
    return None


def _content(kind: str, scalars: dict[str, object], arrays: bytes) -> tuple[str, str, bytes]:
    """All of a recording but its id."""
    told = {name: value for name, value in scalars.items() if name != "id"}
    return kind, orjson.dumps(told, option=orjson.OPT_SORT_KEYS).decode(), hashlib.sha256(arrays).digest()
