"""Digests of recordings anew: servers of the versions 0007 and 0008 made some of them otherwise at first, and what they
kept was not recognised when it came again. And an index that the version 0013 did not make at first.
"""

from alembic import op

from service.store.migrations import recording_digests

revision = "0014"
down_revision = "0013"


def upgrade() -> None:
    """All of them, since none tells how it was made."""
    op.execute("DELETE FROM recording_digests")
    recording_digests.keep(op.get_bind())
    op.create_index("changes_of_campaign", "changes", ["campaign_id", "number"], if_not_exists=True)
