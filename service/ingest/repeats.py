"""Identical recordings in several campaigns: noted on arrival, and counted once in histories. Also notes on corrections
that change nothing or name another skin."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from sqlalchemy import Connection

from service.store import campaigns, codec, repeated, skins
from underskin.recordings.campaign import Campaign

HistoryPoint = tuple[str, str]  # of a history: id of the campaign, sensor


@dataclass(frozen=True)
class Repeat:
    """Why a point does not count: how many of its recordings count in the points of another campaign."""

    campaign_id: str
    identical: int
    of: int

    @property
    def words(self) -> str:
        """The same in words."""
        which = (
            "its recordings count"
            if self.identical == self.of
            else f"{self.identical} of its {self.of} recordings count"
        )
        return f"{which} in campaign {self.campaign_id}: identical recordings count once"


def earlier_campaign(
    connection: Connection, campaign: Campaign, skin_id: str | None, corrects: str | None
) -> tuple[str, str] | None:
    """The campaign that already has these recordings, as a sentence and as its id; `corrects` is not considered.

    `skin_id`: the skin of the request, if stated.
    """
    if skin_id is None:
        skin_id = campaign.skin.id if corrects is None else campaigns.find(connection, corrects).skin_id
    earlier = repeated.most_alike(connection, campaign, skin_id, corrects)
    if earlier is None:
        return None
    some = f"{earlier.identical} of these {earlier.of} recordings {'is' if earlier.identical == 1 else 'are'}"
    which = "these recordings are" if earlier.identical == earlier.of else some
    row = earlier.row
    sentence = f"{which} in campaign {row.name} of skin {row.skin_id} already (kept {row.received_at[:10]})."
    return sentence, row.id


def changes_nothing(connection: Connection, campaign: Campaign, skin_id: str | None, corrects: str | None) -> bool:
    """Whether the corrected campaign already has the same skin values and the same recordings in the same order, on the
    skin of this request and with none excluded: a correction re-includes excluded recordings."""
    if corrects is None:
        return False
    row = campaigns.find(connection, corrects)
    if row.excluded or (skin_id is not None and not skins.are_joined(connection, skin_id, row.skin_id)):
        return False
    before = campaigns.load(connection, row)
    if codec.about(before) != codec.about(campaign) or len(before.recordings) != len(campaign.recordings):
        return False
    columns = codec.recording_columns
    return all(columns(old) == columns(new) for old, new in zip(before.recordings, campaign.recordings, strict=True))


def otherwise_named(connection: Connection, campaign: Campaign, corrects: str | None) -> str | None:
    """The skin of the corrected campaign if the correction names another one."""
    if corrects is None or campaign.skin.id is None:
        return None
    skin_id = str(campaigns.find(connection, corrects).skin_id)
    return None if skins.are_joined(connection, campaign.skin.id, skin_id) else skin_id


def left_out(connection: Connection, root: str, points: Collection[HistoryPoint]) -> dict[HistoryPoint, Repeat]:
    """The points of a skin's history that do not count, because a recording counts only once.

    Of points that share a recording, the one with more recordings counts; if equal, that of the earlier campaign.
    """
    rows = [row for row in repeated.shared(connection, root) if (row.id, row.sensor) in points]
    if not rows:
        return {}
    count = repeated.recordings_by_sensor(connection, root)
    digests: dict[HistoryPoint, list[str]] = {}
    for row in sorted(rows, key=lambda row: (-count[row.id, row.sensor], row.number)):
        digests.setdefault((row.id, row.sensor), []).append(row.digest)
    counted: dict[str, str] = {}  # by digest, the campaign
    repeats: dict[HistoryPoint, Repeat] = {}
    for point, held in digests.items():
        there = [counted[digest] for digest in held if digest in counted]
        if there:
            repeats[point] = Repeat(max(there, key=there.count), len(there), count[point])
        else:
            counted.update(dict.fromkeys(held, point[0]))
    return repeats


def of_campaigns(repeats: Mapping[HistoryPoint, Repeat]) -> dict[str, Repeat]:
    """The same for all points of a campaign, by its id."""
    by_campaign: dict[str, list[Repeat]] = {}
    for (campaign_id, _), repeat in repeats.items():
        by_campaign.setdefault(campaign_id, []).append(repeat)
    return {
        campaign_id: Repeat(
            max(some, key=lambda repeat: repeat.identical).campaign_id,
            sum(repeat.identical for repeat in some),
            sum(repeat.of for repeat in some),
        )
        for campaign_id, some in by_campaign.items()
    }
