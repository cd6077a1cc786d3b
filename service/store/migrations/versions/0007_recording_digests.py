"""Recordings that are identical are known by a digest, those that are here already too."""

import sqlalchemy as sa
from alembic import op

from service.store.migrations import recording_digests

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """One table, and a row in it for every recording."""
    op.create_table(
        "recording_digests",
        sa.Column("campaign", recording_digests.NUMBER, nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("digest", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(["campaign"], ["campaigns.number"]),
        sa.PrimaryKeyConstraint("campaign", "position"),
        sqlite_with_rowid=False,
    )
    op.create_index("recordings_by_digest", "recording_digests", ["digest"], unique=False)
    recording_digests.keep(op.get_bind())
