"""Diagnoses and adopted models: requests and answers."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, StringConstraints

from service.schemas.base import DescribedBy, StrictRequest
from service.schemas.report import Fit, Provenance, Report, ReportMechanism, Verdict

State = Literal["queued", "running", "done", "failed", "cancelled"]
DiagnosisKind = Literal["campaign", "skin", "fleet"]

MOST_TOGETHER = 200  # campaigns of one diagnosis
FEWEST_SKINS = 3  # of a fleet
_Name = Annotated[str, StringConstraints(min_length=1, max_length=200)]


class Asked(BaseModel):
    """A diagnosis that was asked for."""

    id: str = Field(description="Its name in this interface.")
    state: State = Field(description="`done` where the same was diagnosed before, as it is now.")


class AskFor(StrictRequest):
    """How something is to be diagnosed."""

    without: list[str] = Field(
        default_factory=list,
        max_length=50,
        description="Mechanisms to leave out of the catalogue: suppose that it is not these.",
        examples=[["adhesion"]],
    )


class AskForSkin(AskFor):
    """Which campaigns of a skin are to be diagnosed together."""

    campaigns: list[str] | None = Field(
        default=None,
        min_length=2,
        max_length=MOST_TOGETHER,
        description="Ids of campaigns of the skin or of those joined to it. Without them: all that are in use and have "
        "recordings.",
    )
    name: _Name | None = Field(
        default=None,
        description="What the report is called; without one, the skin's id.",
        examples=["palm 3 since May"],
    )


class AskForFleet(AskFor):
    """Which skins are to be diagnosed together, each with all of its campaigns."""

    skins: list[str] = Field(
        min_length=FEWEST_SKINS,
        max_length=MOST_TOGETHER,
        description="Ids of skins of one make, each with a campaign that is in use and has recordings.",
        examples=[["palm-1", "palm-2", "palm-3"]],
    )
    name: _Name = Field(description="What the report is called.", examples=["palms of batch 7"])


class DiagnosisEntry(Asked):
    """A diagnosis without its report."""

    kind: DiagnosisKind = Field(
        description="What it is of: one campaign, several campaigns of a skin, or those of a fleet of skins."
    )
    name: str | None = Field(description="What the report of several campaigns is called; null for one campaign.")
    campaign_id: str = Field(description="The campaign; of several, the one that arrived last.")
    campaign_ids: list[str] = Field(description="All campaigns that it is of, by skin and by arrival.")
    skin_id: str = Field(description="The skin that the campaign `campaign_id` was sent for.")
    progress: float = Field(description="0 to 1.")
    excluded: int = Field(description="How many recordings of the campaigns it leaves out, since they were excluded.")
    outdated: str | None = Field(
        description="Why it is not of the campaigns as they are now; null where it is. One of all campaigns of a skin "
        "is outdated by a new one too."
    )
    table_sha256: str = Field(description="SHA-256 of the table of σ.")
    version: str = Field(description="Version of underskin.")
    without: list[str] = Field(description="Mechanisms that it leaves out of the catalogue.")
    asked_at: str = Field(description="When it was asked for, UTC.")
    asked_from: str | None = Field(description="Name of the API key that asked.")
    started_at: str | None = Field(description="When it was started, the last time where it was interrupted, UTC.")
    ended_at: str | None = Field(description="When it ended, UTC.")
    reason: str | None = Field(description="Why it failed.")
    verdict: Verdict | None = Field(description="The report's verdict, once it is done.")
    probability: float | None = Field(description="The report's probability of what it states.")


class Diagnosis(DiagnosisEntry):
    """A diagnosis and its report."""

    report: Annotated[dict[str, Any], DescribedBy(Report)] | None = Field(description="`report/1`, once it is done.")


class DiagnosisList(BaseModel):
    """A page of diagnoses, the latest first."""

    diagnoses: list[DiagnosisEntry] = Field(description="At most `limit` of them.")
    next: str | None = Field(description="Send it as `cursor` for the next page; null on the last.")


class Adoption(StrictRequest):
    """Makes an explained diagnosis the skin's model."""

    diagnosis_id: str = Field(
        description="Of one of the skin's campaigns: its verdict is `explained`, or `ambiguous` where all that remains "
        "predicts alike, or `unexplained` with a law that holds for other recordings."
    )


class ModelVersion(BaseModel):
    """A model that was adopted for a skin: from which diagnosis, by whom, and whether it was withdrawn."""

    id: str = Field(description="Its name; histories say it with the values that used it.")
    version: int = Field(description="1, 2, ... in the skin that it was adopted for.")
    skin_id: str = Field(description="The skin that it was adopted for; that may have been joined to another since.")
    adopted_at: str = Field(description="When, UTC.")
    adopted_from: str | None = Field(description="Name of the API key that adopted it.")
    diagnosis_id: str = Field(description="The diagnosis that it comes from.")
    campaign_id: str = Field(description="The campaign that was diagnosed.")
    withdrawn_at: str | None = Field(description="When it was withdrawn, UTC; null where it was not.")
    withdrawn_from: str | None = Field(
        description="Name of the API key that withdrew it, or, without one, the name that was typed on a page, if any."
    )
    withdraw_reason: str | None = Field(description="Why.")


class ModelEntry(ModelVersion):
    """A model with its evidence."""

    outdated: str | None = Field(
        description="Why it serves no figures: its campaign was changed after the diagnosis; null where it serves."
    )
    mechanisms: list[Annotated[dict[str, Any], DescribedBy(ReportMechanism)]] = Field(
        description="Names, probabilities and parameters, as in `report/1`."
    )
    probability: float = Field(description="The report's probability of what it states.")
    statement: str = Field(description="The report's statement.")
    fit: Annotated[dict[str, Any], DescribedBy(Fit)] = Field(
        description="How well the recordings are fitted before and after, as in `report/1`."
    )
    provenance: Annotated[dict[str, Any], DescribedBy(Provenance)] = Field(
        description="Versions, hashes of tables and seed, as in `report/1`."
    )
    needs: list[str] = Field(description="What `/v1/frf` and `/v1/d33` need besides what every skin has.")
    depends_on_frequency: bool = Field(description="Whether they need `frequency_hz` too.")


class ModelVersions(BaseModel):
    """All models of a skin and of those joined to it."""

    skin_id: str = Field(description="The skin; the one it was joined to, where it was.")
    models: list[ModelEntry] = Field(
        description="The latest adoption first; the first one is in force unless withdrawn."
    )
