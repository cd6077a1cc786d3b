"""Diagnoses, the models adopted from them, and the d33 derived with those."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"

NUMBER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """The tables `diagnoses`, `models` and `adopted_inversions` as they were at first."""
    op.create_table(
        "diagnoses",
        sa.Column("number", NUMBER, nullable=False),
        sa.Column("id", sa.String(), nullable=False),
        sa.Column("campaign", NUMBER, nullable=False),
        sa.Column("excluded", sa.Integer(), nullable=False),
        sa.Column("table_sha256", sa.String(), nullable=False),
        sa.Column("version", sa.String(), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("progress", sa.Float(), nullable=False),
        sa.Column("asked_at", sa.String(), nullable=False),
        sa.Column("asked_from", sa.Text(), nullable=True),
        sa.Column("started_at", sa.String(), nullable=True),
        sa.Column("ended_at", sa.String(), nullable=True),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("claimed_by", sa.String(), nullable=True),
        sa.Column("alive_at", sa.Float(), nullable=True),
        sa.Column("verdict", sa.String(), nullable=True),
        sa.Column("probability", sa.Float(), nullable=True),
        sa.Column("report", sa.LargeBinary(), nullable=True),
        sa.ForeignKeyConstraint(["campaign"], ["campaigns.number"]),
        sa.PrimaryKeyConstraint("number"),
        sa.UniqueConstraint("id"),
    )
    op.create_index("diagnoses_of_campaign", "diagnoses", ["campaign", "number"], unique=False)
    op.create_index("diagnoses_by_state", "diagnoses", ["state", "number"], unique=False)
    op.create_table(
        "models",
        sa.Column("number", NUMBER, nullable=False),
        sa.Column("id", sa.String(), nullable=False),
        sa.Column("skin_id", sa.String(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("diagnosis", NUMBER, nullable=False),
        sa.Column("adopted_at", sa.String(), nullable=False),
        sa.Column("adopted_from", sa.Text(), nullable=True),
        sa.ForeignKeyConstraint(["diagnosis"], ["diagnoses.number"]),
        sa.ForeignKeyConstraint(["skin_id"], ["skins.id"]),
        sa.PrimaryKeyConstraint("number"),
        sa.UniqueConstraint("id"),
        sa.UniqueConstraint("skin_id", "version", name="version_of_skin"),
    )
    op.create_table(
        "adopted_inversions",
        sa.Column("campaign", NUMBER, nullable=False),
        sa.Column("model_id", sa.String(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("table_sha256", sa.String(), nullable=False),
        sa.Column("answer_version", sa.Integer(), nullable=False),
        sa.Column("document", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["campaign"], ["campaigns.number"]),
        sa.PrimaryKeyConstraint("campaign"),
    )
