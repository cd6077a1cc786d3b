"""Who withdrew, excluded and joined; titles, remarks and tags; skins put away; and a record of every change."""

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"

_ADDED = (
    ("campaigns", "withdrawn_from", sa.Text),
    ("campaigns", "remark", sa.Text),
    ("campaigns", "tags", sa.Text),
    ("recordings", "excluded_from", sa.Text),
    ("skins", "joined_from", sa.Text),
    ("skins", "title", sa.Text),
    ("skins", "remark", sa.Text),
    ("skins", "tags", sa.Text),
    ("skins", "discarded_at", sa.String),
)


def upgrade() -> None:
    """Columns that are empty for what there is, and a table more."""
    for table, name, kind in _ADDED:
        op.add_column(table, sa.Column(name, kind()))
    op.create_table(
        "changes",
        sa.Column("number", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), primary_key=True),
        sa.Column("id", sa.String(), nullable=False, unique=True),
        sa.Column("action", sa.String(), nullable=False),
        sa.Column("skin_id", sa.String(), sa.ForeignKey("skins.id"), nullable=False),
        sa.Column("campaign_id", sa.String()),
        sa.Column("recording", sa.Text()),
        sa.Column("at", sa.String(), nullable=False),
        sa.Column("made_from", sa.Text()),
        sa.Column("reason", sa.Text()),
        sa.Column("before", sa.JSON(), nullable=False),
        sa.Column("after", sa.JSON(), nullable=False),
        sa.Column("undoes", sa.String()),
    )
    op.create_index("changes_of_skin", "changes", ["skin_id", "number"])
    op.create_index("changes_of_campaign", "changes", ["campaign_id", "number"])
