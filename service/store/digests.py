"""Which recordings of the store are identical: a digest of each that another can repeat, kept beside it."""

from collections.abc import Iterable

from sqlalchemy import Connection, insert

from service.store.tables import recording_digests
from underskin.recordings.campaign import Recording
from underskin.recordings.repeats import digest


def keep(connection: Connection, number: int, recordings: Iterable[Recording]) -> None:
    """Keep those of the recordings of the campaign `number`, in their order; not all have one."""
    rows = [
        {"campaign": number, "position": position, "digest": made}
        for position, recording in enumerate(recordings)
        if (made := digest(recording)) is not None
    ]
    if rows:
        connection.execute(insert(recording_digests), rows)
