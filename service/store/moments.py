"""Times of actions on a skin: each later than all earlier ones, whatever the clock says.

A clock that was ahead is set back, and clocks of servers of one database differ: times alone would give a wrong order.
"""

from collections.abc import Collection

from sqlalchemy import Connection, func, select

from service.store import times
from service.store.tables import campaigns, changes, diagnosed_campaigns, diagnoses, models, skins


def next_of(connection: Connection, skin_ids: Collection[str]) -> str:
    """The present time or, if a change, a diagnosis or a model of these skins or of those joined to them has a later
    time, the next possible time after that."""
    roots = select(skins.c.root_id).where(skins.c.id.in_(skin_ids))
    members = select(skins.c.id).where(skins.c.root_id.in_(roots))
    of_skins = campaigns.c.skin_id.in_(members)
    numbers = select(campaigns.c.number).where(of_skins)
    corrections = select(campaigns.c.corrected_by).where(of_skins)  # they may be of another skin
    together = select(diagnosed_campaigns.c.diagnosis).where(diagnosed_campaigns.c.campaign.in_(numbers))
    latest = (
        select(func.max(changes.c.at)).where(changes.c.skin_id.in_(members) | changes.c.campaign_id.in_(corrections)),
        select(func.max(diagnoses.c.asked_at)).where(
            diagnoses.c.campaign.in_(numbers) | diagnoses.c.number.in_(together)
        ),
        select(func.max(models.c.adopted_at)).where(models.c.skin_id.in_(members)),
    )
    return times.after(max(connection.execute(query).scalar() or "" for query in latest))
