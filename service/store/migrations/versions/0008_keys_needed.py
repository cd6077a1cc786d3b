"""The store remembers that keys are needed, so that the loss of keys.json opens nothing."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    """One table more; a server that finds keys.json fills it in."""
    op.create_table(
        "key_requirement",
        sa.Column("number", sa.Integer(), primary_key=True, autoincrement=False),
        sa.Column("needed_since", sa.String(), nullable=False),
        sa.Column("lifted_at", sa.String()),
    )
