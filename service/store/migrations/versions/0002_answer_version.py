"""Kept d33 says which version of the answer it is; what was kept before is of none, and computed anew."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """One column more."""
    op.add_column("inversions", sa.Column("answer_version", sa.Integer(), nullable=False, server_default="0"))
