"""Diagnoses and adopted models. Written by scripts/client_documents.py."""

from dataclasses import dataclass
from typing import Literal

from underskin.client.documents.document import Document
from underskin.client.documents.report import Report, ReportMechanism
from underskin.client.documents.report_fit import Fit, Provenance


@dataclass(frozen=True, eq=False, kw_only=True)
class Asked(Document):
    """A diagnosis that was asked for."""

    id: str
    """Its name in this interface."""

    state: Literal["queued", "running", "done", "failed", "cancelled"]
    """`done` where the same was diagnosed before, as it is now."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Diagnosis(Document):
    """A diagnosis and its report."""

    id: str
    """Its name in this interface."""

    state: Literal["queued", "running", "done", "failed", "cancelled"]
    """`done` where the same was diagnosed before, as it is now."""

    kind: Literal["campaign", "skin", "fleet"]
    """What it is of: one campaign, several campaigns of a skin, or those of a fleet of skins."""

    name: str | None
    """What the report of several campaigns is called; null for one campaign."""

    campaign_id: str
    """The campaign; of several, the one that arrived last."""

    campaign_ids: tuple[str, ...]
    """All campaigns that it is of, by skin and by arrival."""

    skin_id: str
    """The skin that the campaign `campaign_id` was sent for."""

    progress: float
    """0 to 1."""

    excluded: int
    """How many recordings of the campaigns it leaves out, since they were excluded."""

    outdated: str | None
    """Why it is not of the campaigns as they are now; null where it is. One of all campaigns of a skin is outdated
    by a new one too."""

    table_sha256: str
    """SHA-256 of the table of σ."""

    version: str
    """Version of underskin."""

    without: tuple[str, ...]
    """Mechanisms that it leaves out of the catalogue."""

    asked_at: str
    """When it was asked for, UTC."""

    asked_from: str | None
    """Name of the API key that asked."""

    started_at: str | None
    """When it was started, the last time where it was interrupted, UTC."""

    ended_at: str | None
    """When it ended, UTC."""

    reason: str | None
    """Why it failed."""

    verdict: Literal["no_mismatch", "explained", "ambiguous", "unexplained", "insufficient_data"] | None
    """The report's verdict, once it is done."""

    probability: float | None
    """The report's probability of what it states."""

    report: Report | None
    """`report/1`, once it is done."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DiagnosisEntry(Document):
    """A diagnosis without its report."""

    id: str
    """Its name in this interface."""

    state: Literal["queued", "running", "done", "failed", "cancelled"]
    """`done` where the same was diagnosed before, as it is now."""

    kind: Literal["campaign", "skin", "fleet"]
    """What it is of: one campaign, several campaigns of a skin, or those of a fleet of skins."""

    name: str | None
    """What the report of several campaigns is called; null for one campaign."""

    campaign_id: str
    """The campaign; of several, the one that arrived last."""

    campaign_ids: tuple[str, ...]
    """All campaigns that it is of, by skin and by arrival."""

    skin_id: str
    """The skin that the campaign `campaign_id` was sent for."""

    progress: float
    """0 to 1."""

    excluded: int
    """How many recordings of the campaigns it leaves out, since they were excluded."""

    outdated: str | None
    """Why it is not of the campaigns as they are now; null where it is. One of all campaigns of a skin is outdated
    by a new one too."""

    table_sha256: str
    """SHA-256 of the table of σ."""

    version: str
    """Version of underskin."""

    without: tuple[str, ...]
    """Mechanisms that it leaves out of the catalogue."""

    asked_at: str
    """When it was asked for, UTC."""

    asked_from: str | None
    """Name of the API key that asked."""

    started_at: str | None
    """When it was started, the last time where it was interrupted, UTC."""

    ended_at: str | None
    """When it ended, UTC."""

    reason: str | None
    """Why it failed."""

    verdict: Literal["no_mismatch", "explained", "ambiguous", "unexplained", "insufficient_data"] | None
    """The report's verdict, once it is done."""

    probability: float | None
    """The report's probability of what it states."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ModelEntry(Document):
    """A model with its evidence."""

    id: str
    """Its name; histories say it with the values that used it."""

    version: int
    """1, 2, ... in the skin that it was adopted for."""

    skin_id: str
    """The skin that it was adopted for; that may have been joined to another since."""

    adopted_at: str
    """When, UTC."""

    adopted_from: str | None
    """Name of the API key that adopted it."""

    diagnosis_id: str
    """The diagnosis that it comes from."""

    campaign_id: str
    """The campaign that was diagnosed."""

    withdrawn_at: str | None
    """When it was withdrawn, UTC; null where it was not."""

    withdrawn_from: str | None
    """Name of the API key that withdrew it, or, without one, the name that was typed on a page, if any."""

    withdraw_reason: str | None
    """Why."""

    outdated: str | None
    """Why it serves no figures: its campaign was changed after the diagnosis; null where it serves."""

    mechanisms: tuple[ReportMechanism, ...]
    """Names, probabilities and parameters, as in `report/1`."""

    probability: float
    """The report's probability of what it states."""

    statement: str
    """The report's statement."""

    fit: Fit
    """How well the recordings are fitted before and after, as in `report/1`."""

    provenance: Provenance
    """Versions, hashes of tables and seed, as in `report/1`."""

    needs: tuple[str, ...]
    """What `/v1/frf` and `/v1/d33` must be told beside what every skin needs."""

    depends_on_frequency: bool
    """Whether they must be told `frequency_hz` too."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ModelVersion(Document):
    """A model that was adopted for a skin: from which diagnosis, by whom, and whether it was withdrawn."""

    id: str
    """Its name; histories say it with the values that used it."""

    version: int
    """1, 2, ... in the skin that it was adopted for."""

    skin_id: str
    """The skin that it was adopted for; that may have been joined to another since."""

    adopted_at: str
    """When, UTC."""

    adopted_from: str | None
    """Name of the API key that adopted it."""

    diagnosis_id: str
    """The diagnosis that it comes from."""

    campaign_id: str
    """The campaign that was diagnosed."""

    withdrawn_at: str | None
    """When it was withdrawn, UTC; null where it was not."""

    withdrawn_from: str | None
    """Name of the API key that withdrew it, or, without one, the name that was typed on a page, if any."""

    withdraw_reason: str | None
    """Why."""
