"""A model in force can be withdrawn: when, by whom and why stays with it."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"


def upgrade() -> None:
    """Three columns more."""
    op.add_column("models", sa.Column("withdrawn_at", sa.String()))
    op.add_column("models", sa.Column("withdrawn_from", sa.Text()))
    op.add_column("models", sa.Column("withdraw_reason", sa.Text()))
