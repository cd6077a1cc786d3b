"""What is derived from a campaign comes with the numbers that its figures show."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    """One column more."""
    op.add_column("inversions", sa.Column("numbers", sa.LargeBinary()))
