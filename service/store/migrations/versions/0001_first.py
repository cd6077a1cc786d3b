"""The first schema. A store of it is brought up to date from here; a new store begins with the newest tables."""

revision = "0001"
down_revision = None
