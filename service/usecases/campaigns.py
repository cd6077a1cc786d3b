"""Campaigns of the store: described, and recordings left out of their figures."""

from typing import Any

from sqlalchemy import Connection

from service.schemas.campaigns import CampaignDetail, CampaignEntry, RecordingEntry, RecordingResult
from service.store import AnyRow, Database, campaigns
from service.usecases import d33_cache
from underskin.surrogate.sigma_table import SigmaTable


def entry(row: AnyRow) -> dict[str, Any]:
    """The fields of CampaignEntry from a row of the store."""
    names = set(CampaignEntry.model_fields) - {"state", "file"}
    return {name: getattr(row, name) for name in names} | {"state": campaigns.state(row), "file": row.source}


def detail(connection: Connection, campaign_id: str) -> CampaignDetail:
    """A campaign and its recordings, without their arrays; raises Missing."""
    row = campaigns.find(connection, campaign_id)
    recordings = campaigns.recordings_of(connection, row.number)
    return CampaignDetail(
        **entry(row),
        skin=row.about["skin"],
        entries=[RecordingEntry(**recording._mapping) for recording in recordings],
        refused=[RecordingResult(**refused) for refused in row.refused],
        notes=row.notes,
    )


def exclude(store: Database, table: SigmaTable, campaign_id: str, recording: str, reason: str) -> None:
    """Leave a recording out of all figures, and compute the d33 of its campaign anew; raises Missing, Conflict."""
    store.write(campaigns.exclude, campaign_id, recording, reason)
    d33_cache.derive(store, table, [campaign_id])
