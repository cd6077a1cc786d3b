"""Recordings that were stored before, recognised by their digests."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import Connection, func, select

from service.store import skins
from service.store.campaigns import CURRENT
from service.store.tables import AnyRow, campaigns, recording_digests, recordings
from underskin.recordings.campaign import Campaign
from underskin.recordings.reading import digest

_AT_A_TIME = 1000  # digests in one query: databases limit their number
_IN_FIGURES = (recordings.c.excluded_at.is_(None), recordings.c.kind == "frf")


@dataclass(frozen=True)
class Earlier:
    """A campaign of the store that has recordings of another one: how many, of how many different ones."""

    row: AnyRow
    identical: int
    of: int


def most_alike(connection: Connection, campaign: Campaign, skin_id: str | None, corrects: str | None) -> Earlier | None:
    """The current campaign with the most recordings of this one, whatever their ids.

    Among equals one of the skin `skin_id`, then the earliest, which histories count. `corrects`: the id of a campaign
    that is skipped, because this one replaces it.
    """
    digests = [digest(recording) for recording in campaign.recordings]
    coming = sorted({checksum for checksum in digests if checksum is not None})
    alike: Counter[int] = Counter()
    skin_of: dict[int, str] = {}
    for start in range(0, len(coming), _AT_A_TIME):
        these = recording_digests.c.digest.in_(coming[start : start + _AT_A_TIME])
        query = select(campaigns.c.number, campaigns.c.skin_id, func.count(recording_digests.c.digest.distinct()))
        query = query.join(recording_digests, recording_digests.c.campaign == campaigns.c.number)
        query = query.where(these, CURRENT, campaigns.c.id != (corrects or ""))
        for number, skin, count in connection.execute(query.group_by(campaigns.c.number, campaigns.c.skin_id)):
            alike[number] += count
            skin_of[number] = skin
    if not alike:
        return None
    ours = set() if skin_id is None else set(connection.execute(skins.members(skins.root_of(skin_id))).scalars())
    number = max(alike, key=lambda number: (alike[number], skin_of[number] in ours, -number))
    row = connection.execute(select(campaigns).where(campaigns.c.number == number)).one()
    return Earlier(row, alike[number], len(coming) + digests.count(None))


def shared(connection: Connection, root: str) -> Sequence[AnyRow]:
    """Recordings that several current campaigns of a skin, or of those joined to it, have: id and number of the
    campaign, sensor, digest. Without excluded ones and those of the elastomer."""
    of_skin = (CURRENT, campaigns.c.skin_id.in_(skins.members(root)))
    several = (
        select(recording_digests.c.digest)
        .join(campaigns, campaigns.c.number == recording_digests.c.campaign)
        .where(*of_skin)
        .group_by(recording_digests.c.digest)
        .having(func.count(recording_digests.c.campaign.distinct()) > 1)
    )
    same = (recordings.c.campaign == recording_digests.c.campaign) & (
        recordings.c.position == recording_digests.c.position
    )
    query = (
        select(campaigns.c.id, campaigns.c.number, recordings.c.sensor, recording_digests.c.digest)
        .join(recording_digests, recording_digests.c.campaign == campaigns.c.number)
        .join(recordings, same)
        .where(*of_skin, *_IN_FIGURES, recording_digests.c.digest.in_(several))
    )
    return connection.execute(query).all()


def recordings_by_sensor(connection: Connection, root: str) -> dict[tuple[str, str], int]:
    """How many recordings figures use of each campaign's id and sensor, of the same campaigns."""
    query = (
        select(campaigns.c.id, recordings.c.sensor, func.count())
        .join(recordings, recordings.c.campaign == campaigns.c.number)
        .where(CURRENT, campaigns.c.skin_id.in_(skins.members(root)), *_IN_FIGURES)
        .group_by(campaigns.c.id, recordings.c.sensor)
    )
    return {(campaign_id, sensor): count for campaign_id, sensor, count in connection.execute(query)}
