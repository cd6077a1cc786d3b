"""Digests of all recordings that are here: what describes a recording holds its dynamic force and its position, too."""

import sqlalchemy as sa
from alembic import op

from service.store import codec, digests

revision = "0009"
down_revision = "0008"

NUMBER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
RECORDINGS = sa.table(
    "recordings",
    sa.column("campaign", NUMBER),
    sa.column("position", sa.Integer()),
    sa.column("kind", sa.String()),
    sa.column("scalars", sa.JSON()),
    sa.column("arrays", sa.LargeBinary()),
)


def upgrade() -> None:
    """A row for every recording that can be identical to another, in place of those that are there."""
    connection = op.get_bind()
    connection.execute(sa.text("DELETE FROM recording_digests"))
    kept = sa.select(RECORDINGS.c.kind, RECORDINGS.c.scalars, RECORDINGS.c.arrays).order_by(RECORDINGS.c.position)
    for number in connection.execute(sa.text("SELECT number FROM campaigns")).scalars().all():
        rows = connection.execute(kept.where(RECORDINGS.c.campaign == number), execution_options={"yield_per": 8})
        digests.keep(connection, number, map(codec.recording_of, rows))
