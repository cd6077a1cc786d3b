"""Recordings that are identical are known by a digest; 0009 makes those of the recordings that are here."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"

NUMBER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """One table, empty."""
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
