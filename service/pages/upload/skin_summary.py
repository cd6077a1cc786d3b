"""What an exported skin brings, in short: small however large its file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from service.ingest.skin_imports import CampaignFound, Found

MOST_LISTED = 200


@dataclass(frozen=True)
class ModelSeen:
    """A version of the skin's model, and the diagnosis that it was adopted from."""

    skin: str
    version: int
    adopted_at: str
    withdrawn_at: str | None
    mechanisms: Sequence[str]
    probability: float
    present: bool


@dataclass(frozen=True)
class SkinSeen:
    """See the module; `joined`: other ids that count as the skin's."""

    skin: str
    joined: Sequence[str]
    campaigns: int
    new_campaigns: int
    recordings: int
    listed: Sequence[CampaignFound]
    rigs: int
    diagnoses: int
    new_diagnoses: int
    models: Sequence[ModelSeen]
    clashes: Sequence[str]

    @property
    def brings(self) -> bool:
        """Whether anything in it is not here yet."""
        return bool(self.new_campaigns or self.new_diagnoses or any(not model.present for model in self.models))


def skin_seen(found: Found) -> SkinSeen:
    """The summary of a file that was looked at; what clashes is listed first."""
    reports = {row.id: row.report or {} for row in found.diagnosed.diagnoses}
    return SkinSeen(
        skin=found.overview.skin,
        joined=[row.id for row in found.skins.skins if row.id != found.overview.skin],
        campaigns=len(found.campaigns),
        new_campaigns=sum(not campaign.present for campaign in found.campaigns),
        recordings=sum(campaign.recordings for campaign in found.campaigns),
        listed=sorted(found.campaigns, key=lambda campaign: not campaign.differs)[:MOST_LISTED],
        rigs=len(found.skins.rigs),
        diagnoses=len(reports),
        new_diagnoses=len(reports.keys() - found.known),
        models=[_model(row, reports[row.diagnosis_id], row.id in found.known) for row in found.diagnosed.models],
        clashes=found.clashes,
    )


def _model(row: Any, report: Mapping[str, Any], present: bool) -> ModelSeen:
    mechanisms = [entry["name"] for entry in report["mechanisms"]]
    return ModelSeen(
        row.skin_id, row.version, row.adopted_at, row.withdrawn_at, mechanisms, report["probability"], present
    )
