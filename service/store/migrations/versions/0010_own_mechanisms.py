"""A backup holds the files of the lab's own mechanisms."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"


def upgrade() -> None:
    """One table more; earlier backups hold none."""
    op.create_table(
        "own_mechanisms",
        sa.Column("file", sa.String(), primary_key=True),
        sa.Column("content", sa.LargeBinary(), nullable=False),
    )
