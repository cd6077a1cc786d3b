"""What an exported skin brings, in short: small however large its file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from service.ingest.skin_imports import CheckedExport, ExportedCampaignSummary

MOST_LISTED = 200


@dataclass(frozen=True)
class ModelSummary:
    """A version of the skin's model, and the diagnosis that it was adopted from."""

    skin: str
    version: int
    adopted_at: str
    withdrawn_at: str | None
    mechanisms: Sequence[str]
    probability: float
    present: bool


@dataclass(frozen=True)
class SkinSummary:
    """An exported skin in short; `joined`: other ids that count as the skin's."""

    skin: str
    joined: Sequence[str]
    campaigns: int
    new_campaigns: int
    recordings: int
    listed: Sequence[ExportedCampaignSummary]
    rigs: int
    diagnoses: int
    new_diagnoses: int
    models: Sequence[ModelSummary]
    clashes: Sequence[str]

    @property
    def brings(self) -> bool:
        """Whether anything in it is not here yet."""
        return bool(self.new_campaigns or self.new_diagnoses or any(not model.present for model in self.models))


def skin_summary(export: CheckedExport) -> SkinSummary:
    """The summary of a file that was looked at; what clashes is listed first."""
    reports = {row.id: row.report or {} for row in export.diagnosed.diagnoses}
    return SkinSummary(
        skin=export.overview.skin,
        joined=[row.id for row in export.skins.skins if row.id != export.overview.skin],
        campaigns=len(export.campaigns),
        new_campaigns=sum(not campaign.present for campaign in export.campaigns),
        recordings=sum(campaign.recordings for campaign in export.campaigns),
        listed=sorted(export.campaigns, key=lambda campaign: not campaign.differs)[:MOST_LISTED],
        rigs=len(export.skins.rigs),
        diagnoses=len(reports),
        new_diagnoses=len(reports.keys() - export.stored_ids),
        models=[_model(row, reports[row.diagnosis_id], row.id in export.stored_ids) for row in export.diagnosed.models],
        clashes=export.clashes,
    )


def _model(row: Any, report: Mapping[str, Any], present: bool) -> ModelSummary:
    mechanisms = [mechanism["name"] for mechanism in report["mechanisms"]]
    return ModelSummary(
        row.skin_id, row.version, row.adopted_at, row.withdrawn_at, mechanisms, report["probability"], present
    )
