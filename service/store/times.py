"""Times as the store writes them: ISO 8601 in UTC with microseconds, which sort as text; and times of actions on a
skin, each later than all earlier ones, whatever the clock says.

A clock that was ahead is set back, and clocks of servers of one database differ: times alone would give a wrong order.
"""

from collections.abc import Collection
from datetime import UTC, datetime, timedelta

from sqlalchemy import Connection, func, select

from service.store.tables import campaigns, changes, diagnosed_campaigns, diagnoses, models, skins


def now() -> str:
    """This moment."""
    return _text(datetime.now(UTC))


def after(text: str) -> str:
    """This moment, or a microsecond after another one, as the store has it or empty, where the clock is not past it."""
    moment = now()
    return moment if moment > text else _text(datetime.fromisoformat(text) + timedelta(microseconds=1))


def stored(text: str) -> str:
    """A time as a lab or a user wrote it; without a zone it is taken as UTC. Raises ValueError."""
    moment = datetime.fromisoformat(text)
    try:
        return _text(moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC))
    except OverflowError:
        raise ValueError(f"{text} is outside the years 1 to 9999") from None


def checked(text: str) -> str:
    """A text in the store's form, where there is such a time; raises ValueError."""
    datetime.fromisoformat(text)
    return text


def _text(moment: datetime) -> str:
    return moment.isoformat(timespec="microseconds").replace("+00:00", "Z")


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
    return after(max(connection.execute(query).scalar() or "" for query in latest))
