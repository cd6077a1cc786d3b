"""Campaigns: requests and answers."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, WithJsonSchema

from service.problems import validated
from service.schemas.base import StrictRequest
from underskin.errors import ErrorCode, conflicting
from underskin.recordings.frf.estimators import Estimator

State = Literal["current", "corrected", "withdrawn"]

ReasonText = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=1000)]


class SendOptions(BaseModel):
    """What is said of campaigns beside them, in the query or as fields of the form that brings them."""

    model_config = ConfigDict(extra="forbid")

    skin: str | None = Field(default=None, description="The skin that they are of, whatever they say.")
    corrects: str | None = Field(
        default=None,
        description="The campaign that this one replaces; it stays, unused. The new one is of the same skin, whatever "
        "it says, unless `skin` says otherwise.",
    )
    reason: ReasonText | None = Field(default=None, description="Why it is corrected.")
    all_or_nothing: bool = Field(default=False, description="Keep nothing where any recording is refused.")
    together: str | None = Field(
        default=None,
        description="Join all that is sent, such as a file a press, into one campaign of this name. All must be of "
        "one skin; a file that cannot be read is a refused recording, by the file's name.",
        examples=["palm 3 on Monday"],
    )
    estimator: Estimator | None = Field(
        default=None,
        description="How FRFs are estimated from time series, whatever the campaigns or the rig description say: `H1` "
        "is unbiased by noise in the charge, `H2` by noise in the force, `Hv` by equal relative noise in both.",
    )

    def with_form(self, fields: Mapping[str, str]) -> "SendOptions":
        """These, from the query, and those of a form; raises Refusal, InvalidInput where the two differ."""
        options = validated(SendOptions, fields)
        for name in options.model_fields_set & self.model_fields_set:
            if getattr(options, name) != getattr(self, name):
                allowed = f"must be {getattr(self, name)!r}, as in the query, or be given once"
                raise conflicting(name, fields[name], allowed)
        return self.model_copy(update={name: getattr(options, name) for name in options.model_fields_set})


class Refused(BaseModel):
    """What is wrong with one value."""

    code: ErrorCode = Field(
        default=ErrorCode.INVALID_VALUE, description="The kind of error; docs/findings.md explains each."
    )
    field: str = Field(description="The field, with its row where it is a column.", examples=["preload_n"])
    value: Any = Field(description="What was sent; null where nothing was.")
    allowed: str = Field(description="What would be accepted.")


class RecordingResult(BaseModel):
    """What became of one recording."""

    id: str = Field(description="Its id in the campaign, or its place where it has none.", examples=["r1"])
    status: Literal["ok", "refused"] = Field(description="`ok`: kept.")
    errors: list[Refused] = Field(
        description="Why it was refused; empty where it was kept, and where a note counts what is not listed."
    )


class CampaignResult(BaseModel):
    """What became of one campaign."""

    file: str | None = Field(description="The name of the file that it came in, where it had one of its own.")
    status: Literal["ok", "refused"] = Field(description="`ok`: kept, with the recordings that are `ok`.")
    id: str | None = Field(description="Names the campaign from now on; null where it was refused.")
    skin_id: str | None = Field(description="The skin that it is of; null where it was refused.")
    recordings: list[RecordingResult] = Field(description="One entry a recording: those kept, then those refused.")
    errors: list[Refused] = Field(description="Why the campaign as a whole was refused; empty where it was kept.")
    notes: list[str] = Field(description="What its reader remarked, such as a file that ends too early.")
    findings: list[str] = Field(
        description="What looks wrong in its times and its sensors' places, and is used all the same."
    )


class BatchResult(BaseModel):
    """What became of several campaigns sent together."""

    campaigns: list[CampaignResult] = Field(description="One entry a campaign, in the order sent.")


class CampaignEntry(BaseModel):
    """A campaign without its recordings."""

    id: str = Field(description="Its name in this interface.")
    skin_id: str = Field(description="The skin that it was sent for; that may have been joined to another since.")
    name: str = Field(description="What the lab calls it.")
    state: State = Field(description="Figures use `current` ones only.")
    received_at: str = Field(description="When it arrived, UTC.")
    received_from: str | None = Field(description="Name of the API key that it came with.")
    recorded_at: str | None = Field(description="When its earliest recording was made, UTC, where recordings say so.")
    file: str | None = Field(description="The name of the file that it came in, where it had one.")
    recordings: int = Field(description="How many recordings it has.")
    excluded: int = Field(description="How many of them figures leave out.")
    corrects: str | None = Field(description="The campaign that it replaces.")
    correct_reason: str | None = Field(description="Why it was corrected.")
    corrected_by: str | None = Field(description="The campaign that replaces it.")
    withdrawn_at: str | None = Field(description="When it was withdrawn, UTC.")
    withdraw_reason: str | None = Field(description="Why.")
    withdrawn_from: str | None = Field(
        description="Name of the API key that withdrew it, or, without one, the name that was typed on a page, if any."
    )
    discarded_at: str | None = Field(description="When it was put away as a mere trial, UTC; lists leave it out.")
    remark: str | None = Field(description="What the lab noted of it.")
    tags: list[str] = Field(description="Words that the lab finds it by.")


class CampaignList(BaseModel):
    """A page of campaigns, the latest arrival first."""

    campaigns: list[CampaignEntry] = Field(description="At most `limit` of them.")
    next: str | None = Field(description="Send it as `cursor` for the next page; null on the last.")


class RecordingEntry(BaseModel):
    """A recording without its arrays."""

    id: str = Field(description="Its id in the campaign.")
    kind: str = Field(description="`frf`, `indentation` or `compression`.")
    sensor: str | None = Field(description="The sensor, where it has one.")
    recorded_at: str | None = Field(description="When it was made, UTC.")
    excluded_at: str | None = Field(description="When it was excluded, UTC; null where figures use it.")
    exclude_reason: str | None = Field(description="Why it was excluded.")
    excluded_from: str | None = Field(
        description="Name of the API key that excluded it, or, without one, the name that was typed on a page, if any."
    )
    scalars: dict[str, Any] = Field(description="Its fields that are single values, as in campaign/1.")


class CampaignDetail(CampaignEntry):
    """A campaign and its recordings, without their arrays."""

    skin: Annotated[dict[str, Any], WithJsonSchema({"allOf": [{"$ref": "#/components/schemas/Skin"}]})] = Field(
        description="The skin as the campaign declares it."
    )
    entries: list[RecordingEntry] = Field(description="Its recordings.")
    refused: list[RecordingResult] = Field(description="Recordings that were sent with it and not kept.")
    notes: list[str] = Field(description="What its reader remarked.")


class Withdrawal(StrictRequest):
    """Takes a campaign out of all figures; it stays."""

    reason: ReasonText = Field(description="Why; shown with every figure that leaves it out.")


class Exclusion(StrictRequest):
    """Takes a recording out of all figures; it stays."""

    recording: str = Field(description="Its id in the campaign.", examples=["r1"])
    reason: ReasonText = Field(description="Why; shown with every figure that leaves it out.")
