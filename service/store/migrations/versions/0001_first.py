"""The first schema."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None

NUMBER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """All tables of service/store/tables.py as they were at first."""
    op.create_table(
        "answers",
        sa.Column("sender", sa.String(), nullable=False),
        sa.Column("idempotency_key", sa.String(), nullable=False),
        sa.Column("request_sha256", sa.String(), nullable=False),
        sa.Column("answer", sa.LargeBinary(), nullable=False),
        sa.Column("answered_at", sa.String(), nullable=False),
        sa.PrimaryKeyConstraint("sender", "idempotency_key"),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "skins",
        sa.Column("id", sa.String(), nullable=False),
        sa.Column("root_id", sa.String(), nullable=False),
        sa.Column("created_at", sa.String(), nullable=False),
        sa.Column("joined_to", sa.String(), nullable=True),
        sa.Column("joined_at", sa.String(), nullable=True),
        sa.Column("join_reason", sa.Text(), nullable=True),
        sa.ForeignKeyConstraint(["joined_to"], ["skins.id"]),
        sa.ForeignKeyConstraint(["root_id"], ["skins.id"]),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_index("ix_skins_root_id", "skins", ["root_id"], unique=False)
    op.create_table(
        "campaigns",
        sa.Column("number", NUMBER, nullable=False),
        sa.Column("id", sa.String(), nullable=False),
        sa.Column("skin_id", sa.String(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("about", sa.JSON(), nullable=False),
        sa.Column("notes", sa.JSON(), nullable=False),
        sa.Column("refused", sa.JSON(), nullable=False),
        sa.Column("source", sa.Text(), nullable=True),
        sa.Column("received_at", sa.String(), nullable=False),
        sa.Column("received_from", sa.Text(), nullable=True),
        sa.Column("recorded_at", sa.String(), nullable=True),
        sa.Column("recordings", sa.Integer(), nullable=False),
        sa.Column("excluded", sa.Integer(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("corrects", sa.String(), nullable=True),
        sa.Column("correct_reason", sa.Text(), nullable=True),
        sa.Column("corrected_by", sa.String(), nullable=True),
        sa.Column("withdrawn_at", sa.String(), nullable=True),
        sa.Column("withdraw_reason", sa.Text(), nullable=True),
        sa.ForeignKeyConstraint(["skin_id"], ["skins.id"]),
        sa.PrimaryKeyConstraint("number"),
        sa.UniqueConstraint("id"),
    )
    op.create_index("campaigns_of_skin", "campaigns", ["skin_id", "number"], unique=False)
    op.create_table(
        "rigs",
        sa.Column("number", NUMBER, nullable=False),
        sa.Column("skin_id", sa.String(), nullable=False),
        sa.Column("document", sa.Text(), nullable=False),
        sa.Column("created_at", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(["skin_id"], ["skins.id"]),
        sa.PrimaryKeyConstraint("number"),
    )
    op.create_index("rigs_of_skin", "rigs", ["skin_id", "number"], unique=False)
    op.create_table(
        "inversions",
        sa.Column("campaign", NUMBER, nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("table_sha256", sa.String(), nullable=False),
        sa.Column("document", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["campaign"], ["campaigns.number"]),
        sa.PrimaryKeyConstraint("campaign"),
    )
    op.create_table(
        "recordings",
        sa.Column("campaign", NUMBER, nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("id", sa.Text(), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("sensor", sa.Text(), nullable=True),
        sa.Column("recorded_at", sa.String(), nullable=True),
        sa.Column("excluded_at", sa.String(), nullable=True),
        sa.Column("exclude_reason", sa.Text(), nullable=True),
        sa.Column("scalars", sa.JSON(), nullable=False),
        sa.Column("arrays", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["campaign"], ["campaigns.number"]),
        sa.PrimaryKeyConstraint("campaign", "position"),
        sa.UniqueConstraint("campaign", "id", name="recording_of_campaign"),
    )
    op.create_table(
        "sensor_d33",
        sa.Column("campaign", NUMBER, nullable=False),
        sa.Column("sensor", sa.String(), nullable=False),
        sa.Column("d33_pc_per_n", sa.Float(), nullable=False),
        sa.Column("d33_uncertainty_pc_per_n", sa.Float(), nullable=False),
        sa.ForeignKeyConstraint(["campaign"], ["campaigns.number"]),
        sa.PrimaryKeyConstraint("campaign", "sensor"),
        sqlite_with_rowid=False,
    )
    # ### end Alembic commands ###
