"""Whether anything of a skin that its page shows has changed: a mark of it all, from counts alone."""

import hashlib
from typing import Any

from sqlalchemy import Connection, Select, func, select

from service.store import inversions, skins
from service.store.diagnosed_together import has_one_of
from service.store.tables import campaigns, changes, diagnoses, models
from service.store.tables import inversions as derived
from service.store.tables import skins as skin_rows


def numbers_of(root: str) -> Select[Any]:
    """Numbers of all campaigns of a skin and of those joined to it."""
    return select(campaigns.c.number).where(campaigns.c.skin_id.in_(skins.members(root)))


def mark(connection: Connection, root: str, table_sha256: str) -> str:
    """Another one after an arrival, a withdrawal, a correction, an exclusion, a join, a computed d33, a step of a
    diagnosis, an adoption and any other change that is recorded."""
    of_skin = campaigns.c.skin_id.in_(skins.members(root))
    numbers = numbers_of(root)
    of_campaigns = diagnoses.c.campaign.in_(numbers) | has_one_of(numbers)
    queries = (
        select(func.count(), func.max(campaigns.c.number), func.sum(campaigns.c.revision)).where(of_skin),
        select(func.count()).select_from(campaigns).join(derived, inversions.fresh(table_sha256)).where(of_skin),
        select(diagnoses.c.state, func.count(), func.max(diagnoses.c.number))
        .where(of_campaigns)
        .group_by(diagnoses.c.state)
        .order_by(diagnoses.c.state),
        select(func.count(), func.count(models.c.withdrawn_at)).where(models.c.skin_id.in_(skins.members(root))),
        select(func.count()).select_from(skin_rows).where(skin_rows.c.root_id == root),
        select(func.count()).where(changes.c.skin_id.in_(skins.members(root))),
    )
    counts = [[tuple(row) for row in connection.execute(query)] for query in queries]
    return hashlib.sha256(repr(counts).encode()).hexdigest()[:16]
