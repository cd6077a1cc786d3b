"""Trial campaigns are put away."""

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"


def upgrade() -> None:
    """A column that is empty for what there is."""
    op.add_column("campaigns", sa.Column("discarded_at", sa.String()))
