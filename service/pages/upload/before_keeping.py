"""What the reader of an upload should know before keeping it: that it is here already, that a correction names another
skin, and what its d33 will look like.

Nothing kept is ever deleted, so that afterwards is late.
"""

from collections.abc import Iterator

from fastapi import Request

from service.ingest import repeats
from service.ingest.reading import InspectedFile, checked
from service.store import Database, campaigns, skins
from service.usecases import d33_cache
from underskin.recordings.campaign import Campaign


def worth_knowing(request: Request, look: InspectedFile, skin_id: str | None, corrects: str | None) -> list[str]:
    """In sentences, of the campaigns of one file, sent for the skin `skin_id` where that is said; `corrects`: the
    campaign whose place they take."""
    store, table = request.app.state.store, request.app.state.table
    campaigns_read = [one.campaign for one in map(checked, look.campaigns) if one.campaign is not None]
    return [
        sentence
        for campaign in campaigns_read
        for sentence in (
            *_kept(store, campaign, skin_id, corrects),
            *_elsewhere(store, campaign, corrects),
            *d33_cache.foreseen(table, campaign),
        )
    ]


def _kept(store: Database, campaign: Campaign, skin_id: str | None, corrects: str | None) -> Iterator[str]:
    earlier = store.read(repeats.already_kept, campaign, skin_id, corrects)
    if earlier is not None:
        yield earlier[0]


def _elsewhere(store: Database, campaign: Campaign, corrects: str | None) -> Iterator[str]:
    if corrects is None or campaign.skin.id is None:
        return
    with store.reading() as connection:
        skin_id = campaigns.find(connection, corrects).skin_id
        same = skins.are_one(connection, campaign.skin.id, skin_id)
    if not same:
        yield (
            f"the file names skin {campaign.skin.id}, not {skin_id}, that of the campaign that it corrects: the name "
            "below decides."
        )
