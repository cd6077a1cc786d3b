"""What the routes that change names, notes and tags, put away and undo answer and take."""

from typing import Any, Literal

from pydantic import BaseModel, Field, model_validator

from service.schemas.base import StrictRequest
from service.schemas.campaigns import ReasonText

Action = Literal["annotate", "withdraw", "exclude", "correct", "join", "discard", "undo"]


class _Annotation(StrictRequest):
    """What is to be changed; a field that is not sent stays as it is."""

    remark: str | None = Field(default=None, description="Notes, in up to 10,000 characters; null for none.")
    tags: list[str] | None = Field(default=None, description="Words to find it by; null or empty for none.")

    @model_validator(mode="after")
    def _changes_something(self) -> "_Annotation":
        if not self.model_fields_set:
            raise ValueError("must have at least one field to change")
        return self


class CampaignAnnotation(_Annotation):
    """What the lab writes to a campaign; a field that is left out stays as it is."""

    name: str = Field(default="", description="What the lab calls it.", examples=["palm 3, after the bath"])


class SkinAnnotation(_Annotation):
    """What the lab writes to a skin; a field that is left out stays as it is."""

    title: str | None = Field(
        default=None, description="What the lab calls it besides its id; null for none.", examples=["left palm"]
    )


class Discarding(StrictRequest):
    """Puts a skin or a trial campaign away: in no list any more; nothing of it is lost."""

    reason: ReasonText = Field(description="Why; kept with it.")


class Change(BaseModel):
    """A change of a skin or a campaign."""

    id: str = Field(description="Names the change, for `POST /v1/changes/{change_id}/undo`.")
    action: Action = Field(description="What was done.")
    statement: str = Field(description="The same in words.")
    skin_id: str = Field(description="The skin that it is of, or whose campaign.")
    campaign_id: str | None = Field(description="The campaign; null for a change of the skin itself.")
    recording: str | None = Field(description="The recording that was excluded.")
    at: str = Field(description="When, UTC.")
    made_from: str | None = Field(
        description="Name of the API key that made it, or, without one, the name that was typed on a page, if any."
    )
    reason: str | None = Field(description="Why, where it was given.")
    before: dict[str, Any] = Field(description="What `annotate` and `discard` replaced, by field.")
    after: dict[str, Any] = Field(description="What they put in its place.")
    undoes: str | None = Field(description="Of an `undo`: the change that it took back.")
    undone: bool = Field(description="Whether it was taken back.")
    may_be_undone: bool = Field(description="Whether it can be taken back now: nothing builds on it.")


class Changes(BaseModel):
    """What was changed since it was kept."""

    changes: list[Change] = Field(description="The latest 20, the latest first.")
