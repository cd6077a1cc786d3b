"""A diagnosis keeps the figures that were made with its report."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """One column more."""
    op.add_column("diagnoses", sa.Column("figures", sa.LargeBinary()))
