"""Recordings that are identical are known by a digest, those that are here already too."""

import sqlalchemy as sa
from alembic import op

from service.store import codec, digests

revision = "0007"
down_revision = "0006"

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
    """One table, and a row in it for every recording."""
    op.create_table(
        "recording_digests",
        sa.Column("campaign", NUMBER, nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("digest", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(["campaign"], ["campaigns.number"]),
        sa.PrimaryKeyConstraint("campaign", "position"),
        sqlite_with_rowid=False,
    )
    op.create_index("recordings_by_digest", "recording_digests", ["digest"], unique=False)
    connection = op.get_bind()
    kept = sa.select(RECORDINGS.c.kind, RECORDINGS.c.scalars, RECORDINGS.c.arrays).order_by(RECORDINGS.c.position)
    for number in connection.execute(sa.text("SELECT number FROM campaigns")).scalars().all():
        rows = connection.execute(kept.where(RECORDINGS.c.campaign == number), execution_options={"yield_per": 8})
        digests.keep(connection, number, map(codec.recording_of, rows))
