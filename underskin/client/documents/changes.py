"""What was changed of campaigns and skins. Written by scripts/client_documents.py."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from underskin.client.documents.document import Document


@dataclass(frozen=True, eq=False, kw_only=True)
class Change(Document):
    """A change of a skin or a campaign."""

    id: str
    """Names the change, for `POST /v1/changes/{change_id}/undo`."""

    action: Literal["annotate", "withdraw", "exclude", "correct", "join", "discard", "undo"]
    """What was done."""

    statement: str
    """The same in words."""

    skin_id: str
    """The skin that it is of, or whose campaign."""

    campaign_id: str | None
    """The campaign; null for a change of the skin itself."""

    recording: str | None
    """The recording that was excluded."""

    at: str
    """When, UTC."""

    made_from: str | None
    """Name of the API key that made it, or, without one, the name that was typed on a page, if any."""

    reason: str | None
    """Why, where it was given."""

    before: Mapping[str, Any]
    """What `annotate` and `discard` replaced, by field."""

    after: Mapping[str, Any]
    """What they put in its place."""

    undoes: str | None
    """Of an `undo`: the change that it took back."""

    undone: bool
    """Whether it was taken back."""

    may_be_undone: bool
    """Whether it can be taken back now: nothing builds on it."""
