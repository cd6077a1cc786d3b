"""Diagnoses and adopted models: requests and answers."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

State = Literal["queued", "running", "done", "failed", "cancelled"]
Verdict = Literal["no_mismatch", "explained", "ambiguous", "unexplained", "insufficient_data"]


class Asked(BaseModel):
    """A diagnosis that was asked for."""

    id: str = Field(description="Its name in this interface.")
    state: State = Field(description="`done` where the campaign was diagnosed before, as it is now.")


class AskFor(BaseModel):
    """How a campaign is to be diagnosed."""

    model_config = ConfigDict(extra="forbid", strict=True)

    without: list[str] = Field(
        default_factory=list,
        max_length=50,
        description="Mechanisms to leave out of the catalogue: suppose that it is not these.",
        examples=[["adhesion"]],
    )


class DiagnosisEntry(Asked):
    """A diagnosis without its report."""

    campaign_id: str = Field(description="The campaign.")
    skin_id: str = Field(description="The skin that the campaign was sent for.")
    progress: float = Field(description="0 to 1.")
    excluded: int = Field(description="How many recordings of the campaign it leaves out, since they were excluded.")
    outdated: str | None = Field(description="Why it is not of the campaign as it is now; null where it is.")
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

    report: dict[str, Any] | None = Field(description="`report/1`, once it is done.")


class DiagnosisList(BaseModel):
    """A page of diagnoses, the latest first."""

    diagnoses: list[DiagnosisEntry] = Field(description="At most `limit` of them.")
    next: str | None = Field(description="Send it as `cursor` for the next page; null on the last.")


class Adoption(BaseModel):
    """Makes an explained diagnosis the skin's model."""

    model_config = ConfigDict(extra="forbid", strict=True)

    diagnosis_id: str = Field(description="A diagnosis of one of the skin's campaigns, its verdict `explained`.")


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
    withdrawn_from: str | None = Field(description="Name of the API key that withdrew it.")
    withdraw_reason: str | None = Field(description="Why.")


class ModelEntry(ModelVersion):
    """A model with its evidence."""

    outdated: str | None = Field(
        description="Why it serves no figures: its campaign was changed after the diagnosis; null where it serves."
    )
    mechanisms: list[dict[str, Any]] = Field(description="Names, probabilities and parameters, as in `report/1`.")
    probability: float = Field(description="The report's probability of what it states.")
    statement: str = Field(description="The report's statement.")
    fit: dict[str, Any] = Field(description="How well the recordings are fitted before and after, as in `report/1`.")
    provenance: dict[str, Any] = Field(description="Versions, hashes of tables and seed, as in `report/1`.")
    needs: list[str] = Field(description="What `/v1/frf` and `/v1/d33` must be told beside what every skin needs.")
    depends_on_frequency: bool = Field(description="Whether they must be told `frequency_hz` too.")


class ModelVersions(BaseModel):
    """All models of a skin and of those joined to it."""

    skin_id: str = Field(description="The skin; the one it was joined to, where it was.")
    models: list[ModelEntry] = Field(
        description="The latest adoption first; the first one is in force unless withdrawn."
    )
