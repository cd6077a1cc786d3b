"""An uploaded file that is an exported skin: its content in short, what of it is stored already, and its import."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from fastapi import Request, Response

from service.ingest import skin_imports
from service.ingest.skin_imports import CheckedExport, ExportedCampaignSummary
from service.pages.shared import same_request
from service.pages.shared.html import page
from service.pages.upload.file_summary import FileSummary
from service.pages.upload.looking import field_errors
from service.pages.upload.pending_uploads import PendingUpload
from service.store import Conflict, Database
from underskin import InvalidInput
from underskin.recordings.skin_export import is_export

MOST_LISTED = 200
KIND = "exported skin"


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


def holds_skin(pending: PendingUpload) -> bool:
    """Whether an upload is an exported skin, which must be the only file."""
    first, *others = pending.files
    if others:
        return False
    with first.path.open("rb") as stream:
        return is_export(stream, first.label or "the file")


def look(store: Database, pending: PendingUpload) -> None:
    """Summarise it; where it cannot be read, list the errors as for any other file. One at a time."""
    try:
        pending.skin_summary = skin_summary(skin_imports.look(store, pending.files[0]))
    except InvalidInput as error:
        label = pending.files[0].label or "the file"
        pending.seen = [FileSummary(label, KIND, 0, (), (), field_errors(error), (), (), None)]
        pending.drawn = {0: []}


def shown(request: Request, pending: PendingUpload) -> Response:
    """What would come in."""
    return page(
        request,
        "exported.html",
        pending=pending,
        summary=pending.skin_summary,
        file=pending.files[0].label or "the file",
        most_listed=MOST_LISTED,
        same=same_request.exported_skin(request, pending.files[0].label or "skin.h5"),
    )


def bring_in(store: Database, pending: PendingUpload) -> None:
    """Keep what is not here; errors are shown on the upload's page. A second request stores nothing again."""
    with pending.lock:
        if pending.kept_at is not None:
            return
        with pending.shelf.in_use(pending):
            try:
                brought = skin_imports.bring_in(store, pending.files[0])
            except Conflict:  # the stored data were changed since it was examined
                look(store, pending)
                return
        pending.kept_at = f"/skins/{quote(brought.skin_id, safe='')}"
        pending.shelf.empty(pending)
