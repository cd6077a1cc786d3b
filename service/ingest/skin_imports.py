"""Import of an exported skin. Every part of its file is checked before anything is stored."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, BinaryIO

from pydantic import ValidationError

from service.ingest.uploads import Upload
from service.schemas.skins import Imported
from service.store import Conflict, Database, diagnosis_export, export, import_checks
from underskin.errors import FileError, InvalidInput, unreadable
from underskin.recordings.skin_export import ExportedCampaign, Overview, read_campaigns, read_overview

_AT_A_TIME = 8  # campaigns in memory
one_at_a_time = asyncio.Semaphore(1)  # export that is looked at or brought in at a time


@dataclass(frozen=True)
class ExportedCampaignSummary:
    """A campaign of the file; `present`: it is in the store already, where it `differs` or is the same."""

    id: str
    name: str
    recorded_at: str | None
    recordings: int
    excluded: int
    present: bool
    differs: bool


@dataclass(frozen=True)
class CheckedExport:
    """A file of which every part was checked; `clashes`: contradictions with the store, in sentences."""

    overview: Overview
    skins: import_checks.CheckedOverview
    diagnosed: diagnosis_export.Checked
    campaigns: list[ExportedCampaignSummary]
    stored_ids: set[str]  # ids of those diagnoses and models that are in the store
    clashes: list[str]


def look(store: Database, upload: Upload) -> CheckedExport:
    """Check a file in itself and against the store; raises InvalidInput naming the invalid part."""
    with upload.path.open("rb") as stream, _naming_the_part(upload, ""):
        overview = read_overview(stream, _label(upload))
        skins = import_checks.overview(overview)
        diagnosed = diagnosis_export.checked(
            overview.diagnoses, overview.models, overview.campaigns, [row["id"] for row in overview.skins]
        )
        with store.reading() as connection:
            clashes = export.otherwise_joined(connection, skins.skins)
            clashes += diagnosis_export.clashes(connection, diagnosed)
            diagnosed_here = diagnosis_export.stored_ids(connection, diagnosed)
            campaigns_here = export.stored_rows(connection, overview.campaigns)
        summaries = []
        for name, campaign in _campaigns(stream, upload, overview.campaigns):
            row = campaigns_here.get(name)
            if row is None:
                with _naming_the_part(upload, f"campaign {name}: "):
                    checked = import_checks.campaign(campaign, name, skins.skins)
                summaries.append(_campaign(checked.row, present=False, differs=False))
                continue
            differs = store.read(export.differs, row, campaign)
            summaries.append(_campaign(row._mapping, present=True, differs=differs))
    clashes += [
        f"Campaign {summary.name!r} ({summary.id}) is there already and differs"
        for summary in summaries
        if summary.differs
    ]
    return CheckedExport(overview, skins, diagnosed, summaries, diagnosed_here, clashes)


def bring_in(store: Database, upload: Upload) -> Imported:
    """Store what is not there yet; raises as `look`, and Conflict, with nothing stored, if it contradicts the store."""
    checked = look(store, upload)
    if checked.clashes:
        more = f", and {len(checked.clashes) - 1} more clashes" if len(checked.clashes) > 1 else ""
        raise Conflict(f"{checked.clashes[0]}{more}; nothing was imported.")
    missing = [campaign.id for campaign in checked.campaigns if not campaign.present]
    export.add_skins(store, checked.skins)
    with upload.path.open("rb") as stream, _naming_the_part(upload, ""):
        for name, campaign in _campaigns(stream, upload, missing):
            export.add(store, import_checks.campaign(campaign, name, checked.skins.skins))
    diagnosis_export.add(store, checked.diagnosed)
    return Imported(skin_id=checked.overview.skin, kept=len(missing), present=len(checked.campaigns) - len(missing))


def _campaigns(stream: BinaryIO, upload: Upload, names: list[str]) -> Iterator[tuple[str, ExportedCampaign]]:
    for start in range(0, len(names), _AT_A_TIME):
        some = names[start : start + _AT_A_TIME]
        yield from zip(some, read_campaigns(stream, _label(upload), some), strict=True)


def _campaign(row: Any, *, present: bool, differs: bool) -> ExportedCampaignSummary:
    about = (row["id"], row["name"], row["recorded_at"], row["recordings"], row["excluded"])
    return ExportedCampaignSummary(*about, present=present, differs=differs)


def _label(upload: Upload) -> str:
    return upload.label or "the upload"


@contextmanager
def _naming_the_part(upload: Upload, part: str) -> Iterator[None]:
    """Turns exceptions about a part of a file into InvalidInput that names the part."""
    try:
        yield
    except InvalidInput as error:
        raise error.at(f"{part}{error.field}") from None
    except FileError as error:
        raise error.of_field("file", upload.label) from None
    except (ValidationError, KeyError, TypeError) as error:
        raise unreadable("file", upload.label, f"{part}is not as underskin exports it: {_words(error)}") from None


def _words(error: Exception) -> str:
    """An error of pydantic or of a look-up in one line."""
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False)[0]
        return f"{'.'.join(map(str, first['loc']))}: {first['msg'][:1].lower()}{first['msg'][1:]}"[:500]
    return f"{type(error).__name__}: {error}"[:500]
