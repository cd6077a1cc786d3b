"""A diagnosis may be of several campaigns, of one skin or of a fleet of skins."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"

NUMBER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Three columns and two tables more; every earlier diagnosis is of one campaign."""
    op.add_column("diagnoses", sa.Column("kind", sa.String(), nullable=False, server_default="campaign"))
    op.add_column("diagnoses", sa.Column("name", sa.Text()))
    op.add_column("diagnoses", sa.Column("together_sha256", sa.String(), nullable=False, server_default=""))
    op.create_table(
        "diagnosed_campaigns",
        sa.Column("diagnosis", NUMBER, nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("campaign", NUMBER, nullable=False),
        sa.Column("skin_id", sa.String(), nullable=False),
        sa.Column("excluded", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(["campaign"], ["campaigns.number"]),
        sa.ForeignKeyConstraint(["diagnosis"], ["diagnoses.number"]),
        sa.ForeignKeyConstraint(["skin_id"], ["skins.id"]),
        sa.PrimaryKeyConstraint("diagnosis", "position"),
    )
    op.create_index("diagnosed_together_with", "diagnosed_campaigns", ["campaign", "diagnosis"], unique=False)
    op.create_table(
        "diagnosed_skins",
        sa.Column("diagnosis", NUMBER, nullable=False),
        sa.Column("skin_id", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(["diagnosis"], ["diagnoses.number"]),
        sa.ForeignKeyConstraint(["skin_id"], ["skins.id"]),
        sa.PrimaryKeyConstraint("diagnosis", "skin_id"),
    )
