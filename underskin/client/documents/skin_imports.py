"""What an import of a skin brought. Written by scripts/client_documents.py."""

from dataclasses import dataclass

from underskin.client.documents.document import Document


@dataclass(frozen=True, eq=False, kw_only=True)
class Imported(Document):
    """What an import brought."""

    skin_id: str
    """The skin."""

    kept: int
    """How many campaigns are new here."""

    present: int
    """How many were here already, the same."""
