"""A diagnosis says which mechanisms it leaves out, and which the lab's own were."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"


def upgrade() -> None:
    """Two columns more; earlier diagnoses left nothing out, and their server had no mechanisms of the lab's own."""
    op.add_column("diagnoses", sa.Column("without", sa.Text(), nullable=False, server_default="[]"))
    op.add_column("diagnoses", sa.Column("own_sha256", sa.String(), nullable=False, server_default=""))
