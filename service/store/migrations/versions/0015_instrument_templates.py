"""What is known of an instrument's files, to be offered at the next upload."""

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"


def upgrade() -> None:
    """One table more; nothing is known yet."""
    op.create_table(
        "instrument_templates",
        sa.Column("number", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), primary_key=True),
        sa.Column("instrument", sa.String(), nullable=False),
        sa.Column("document", sa.Text(), nullable=False),
        sa.Column("kept_at", sa.String(), nullable=False),
        sa.Column("kept_from", sa.Text()),
    )
    op.create_index("templates_of_instrument", "instrument_templates", ["instrument", "number"])
