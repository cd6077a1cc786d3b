"""Reading the files of an upload by its rig description and its form, for preview, and storing them or their errors;
warnings come before, because stored data are never deleted."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar
from urllib.parse import quote

import orjson
from fastapi import Request
from starlette.concurrency import run_in_threadpool

from service.dependencies import sender
from service.ingest import repeats
from service.ingest.accept import RIG, IngestOptions, accept, sent_rig, stored_rig
from service.ingest.reading import READING_SLOTS, InspectedFile, checked, field_error, look, require_few
from service.ingest.uploads import Upload
from service.pages.shared.figures import Drawn
from service.pages.shared.forms import signed
from service.pages.upload.figures import course, figures, with_curves_turned
from service.pages.upload.file_summary import ChannelSummary, FileSummary, RecordingSummary, doubts, listed, seen
from service.pages.upload.mapping import CHOICES, mapped_file
from service.pages.upload.pending_uploads import PendingUpload, Remembered
from service.problems import Refusal
from service.store import Conflict, Database, Missing, campaigns, skins
from service.usecases import d33_cache
from underskin.errors import ErrorCode, FileError, InvalidInput, errors_of
from underskin.recordings import curve_preparation
from underskin.recordings.rig_mapping import MappedFile, has_channels

SKIN_FIELD, CORRECTS = "skin", "corrects"
_Result = TypeVar("_Result")
_WORKBOOK, _OF_TEXT = "XLSX", ", separated by tabs, with decimal points"


def keep_good(request: Request, pending: PendingUpload, sent: Mapping[str, str], store: Database) -> list[str]:
    """Store the valid campaigns; returns their ids. Errors are shown on the upload's page. A second request stores
    nothing again."""
    with pending.lock:
        if pending.kept_at is not None or pending.is_stale:  # of which the page shows no button to keep it
            return []
        together = sent.get("together", "").strip() if sent.get("as") == "one" else None
        pending.skin = sent.get(SKIN_FIELD, "").strip() or None
        pending.reason = sent.get("reason", "").strip()
        pending.who = sent.get("who", "").strip()
        reason = pending.reason or None if pending.corrects is not None else None
        try:
            options = IngestOptions(
                request.app.state.settings,
                sender(request),
                skin=pending.skin,
                corrects=pending.corrects,
                reason=reason,
                together=together,
                estimator=pending.estimator,
                turn_curves=pending.turned,
                use_stored_rig=False,  # exactly the previewed data are stored
                signed=signed(request, sent) if pending.corrects is not None else None,
            )
            with pending.shelf.in_use(pending):
                answer, _ = accept(store, [*pending.files, *_rig_upload(pending)], options)
        except (InvalidInput, Conflict, Missing, Refusal) as error:
            pending.refused = field_errors(error)
            return []
        stored = [result for result in answer["campaigns"] if result["id"] is not None]
        page = f"/campaigns/{stored[0]['id']}"
        pending.kept_at = page if len(stored) == 1 else f"/skins/{quote(stored[0]['skin_id'], safe='')}"
        pending.shelf.empty(pending)
        return [result["id"] for result in stored]


def _rig_upload(pending: PendingUpload) -> list[Upload]:
    """The rig description in use, as a part of the upload."""
    if pending.rig is None:
        return []
    path = pending.folder / RIG
    path.write_bytes(orjson.dumps(pending.rig.document))
    return [Upload(path, None, RIG, "", in_form=True)]


def field_errors(error: Exception) -> list[dict[str, Any]]:
    """Errors field by field."""
    if isinstance(error, InvalidInput):
        return [
            field_error(invalid.field, invalid.value, invalid.allowed, invalid.code) for invalid in errors_of(error)
        ]
    if isinstance(error, Refusal) and error.errors:
        return [dict(error_of_field) for error_of_field in error.errors]
    if isinstance(error, FileError):
        return [field_error(error.file, None, f"{error.place} {error.reason}".strip(), error.code)]
    detail = error.detail if isinstance(error, Refusal) else str(error)
    return [field_error("upload", None, detail, ErrorCode.INVALID_VALUE)]


def skin_of(store: Database, corrects: str | None) -> str | None:
    """The skin of the corrected campaign, on which its correction stays; raises Missing."""
    if corrects is None:
        return None
    return str(store.read(campaigns.find, corrects).skin_id)


def take_rig(store: Database, pending: PendingUpload, sent: Upload | None) -> None:
    """Read the upload by the rig description that was sent or that is stored with its skin; errors of a sent one are
    shown."""
    if sent is not None:
        try:
            pending.rig, pending.rig_label = sent_rig(sent), sent.label
        except (FileError, InvalidInput) as error:
            pending.refused = [{**detail, RIG: sent.label or RIG} for detail in field_errors(error)]
    elif pending.skin is not None:
        pending.rig = store.read(stored_rig, pending.skin)
        origin = store.read(skins.rig_origin, pending.skin)
        if pending.rig is not None and origin is not None:
            name = pending.rig.document.get("name")
            pending.remembered = Remembered(name, origin.created_at, skin=pending.skin, file=origin.file)


def worth_knowing(request: Request, look: InspectedFile, skin_id: str | None, corrects: str | None) -> list[str]:
    """Warnings in sentences on the campaigns of one file; `skin_id`: the skin it is sent for, if stated; `corrects`:
    the campaign that they replace."""
    store, table = request.app.state.store, request.app.state.table
    sentences: list[str] = []
    for in_file in map(checked, look.campaigns):
        if in_file.campaign is None:
            continue
        earlier = store.read(repeats.earlier_campaign, in_file.campaign, skin_id, corrects)
        if earlier is not None:
            sentences.append(earlier[0])
        if store.read(repeats.changes_nothing, in_file.campaign, skin_id, corrects):
            sentences.append("it says the same as the campaign that it corrects: nothing would change.")
        stored_skin_id = store.read(repeats.otherwise_named, in_file.campaign, corrects)
        if stored_skin_id is not None:
            sentences.append(
                f"the file names skin {in_file.campaign.skin.id}, not {stored_skin_id}, that of the campaign that it "
                "corrects: the name below decides."
            )
        sentences += [
            *doubts(in_file.campaign),
            *d33_cache.foreseen(table, in_file.campaign),
        ]
    return sentences


def counts_pressing_negative(looked: InspectedFile) -> bool:
    """Whether curves of a file count pressing negative."""
    held = [
        checked_campaign.campaign
        for checked_campaign in map(checked, looked.campaigns)
        if checked_campaign.campaign is not None
    ]
    return any(curve_preparation.findings(campaign) for campaign in held)


async def in_turn(work: Callable[..., _Result], *arguments: Any) -> _Result:
    """The result of `work`, which reads files for preview: two at once, the others wait without a thread."""
    async with READING_SLOTS:
        return await run_in_threadpool(work, *arguments)


def looked(request: Request, pending: PendingUpload, number: int) -> InspectedFile:
    """One file, read; raises Missing if there is none of that number any more."""
    if not 0 <= number < len(pending.files) or pending.kept_at is not None:
        raise Missing("There is no such file in this upload.")
    with pending.shelf.in_use(pending):
        most_bytes = request.app.state.settings.max_body_bytes
        inspected = look(pending.files[number], pending.rig, most_bytes, pending.files)
    campaigns = [campaign.with_estimator(pending.estimator) for campaign in inspected.campaigns]
    return replace(
        inspected, campaigns=[campaign.with_curves_turned() for campaign in campaigns] if pending.turned else campaigns
    )


def look_at_all(request: Request, pending: PendingUpload) -> None:
    """Read every file and draw the figures of the first. A rig description of earlier files is dropped if none of
    these has its channels."""
    if not _look_at_all(request, pending) and pending.remembered is not None:
        pending.lacking = pending.remembered
        pending.start_afresh()
        _look_at_all(request, pending)


def _look_at_all(request: Request, pending: PendingUpload) -> bool:
    """The same; whether a file has the channels of the rig description, or none has any channels."""
    fits: list[bool] = []
    summaries: list[FileSummary] = []
    drawn: list[Drawn] = []
    recordings = 0
    pending.negative = False
    for number, upload in enumerate(pending.files):
        inspected = looked(request, pending, number)
        if inspected.contents is not None and pending.rig is not None:
            fits.append(has_channels(pending.rig, inspected.contents))
        recordings += sum(campaign.recordings for campaign in inspected.campaigns)
        require_few(len(summaries) + len(inspected.campaigns), recordings)
        pending.negative |= counts_pressing_negative(inspected)
        sentences = worth_knowing(request, inspected, pending.skin, pending.corrects)
        summary = seen(upload, inspected, sentences)
        summaries.append(replace(summary, taken=_taken(inspected, _mapped(pending, inspected, summary))))
        if number == 0:
            drawn = _figures(pending, 0, inspected, summary)
    pending.seen, pending.drawn = summaries, {0: drawn}
    return any(fits) or not fits


async def shown(
    request: Request, pending: PendingUpload, number: int, first: int
) -> tuple[list[Drawn], Sequence[RecordingSummary]]:
    """The figures of a file and one page of its recordings, from number `first` on; the file is read if they are not
    cached."""
    drawn = pending.drawn.get(number)
    if drawn is not None and not first:
        return drawn, pending.seen[number].listed
    return await in_turn(_shown, request, pending, number, first)


def _shown(
    request: Request, pending: PendingUpload, number: int, first: int
) -> tuple[list[Drawn], Sequence[RecordingSummary]]:
    inspected = looked(request, pending, number)
    drawn = pending.drawn.get(number)
    if drawn is None:
        drawn = _figures(pending, number, inspected, pending.seen[number])
        pending.draw(number, drawn)
    return drawn, listed(inspected, first) if first else pending.seen[number].listed


def _figures(pending: PendingUpload, number: int, inspected: InspectedFile, summary: FileSummary) -> list[Drawn]:
    mapped = _mapped(pending, inspected, summary)
    force_course = course(inspected, summary, pending.rig, turned=pending.turned)
    return [*force_course, *figures(inspected, f"/upload/{pending.id}/{number}/", mapped)]


def _mapped(pending: PendingUpload, inspected: InspectedFile, summary: FileSummary) -> MappedFile | None:
    """The document that a mapping makes of a file, with curves inverted if requested."""
    mapped = mapped_file(inspected, summary, pending.rig)
    return mapped if mapped is None or not pending.turned else with_curves_turned(mapped)


def _taken(inspected: InspectedFile, mapped: MappedFile | None) -> dict[str, str]:
    """How each field was read, under the empty name how the text was read; a workbook has no separators."""
    layout = "" if inspected.contents is None else inspected.contents.layout
    taken = dict(mapped.taken) if mapped is not None else {"": layout} if layout else {}
    if inspected.kind == _WORKBOOK and "" in taken:
        taken[""] = taken[""].replace(_OF_TEXT, "")
    return taken


def channels_of(pending: PendingUpload) -> list[ChannelSummary]:
    """Channels of all files by name, first those of files with the mapping's channels."""
    by_name = {channel.name: channel for file in reversed(pending.seen) for channel in reversed(file.channels)}
    return list(reversed(by_name.values()))


def held_by_some(pending: PendingUpload) -> dict[str, list[str]]:
    """For channels that only some of the files with channels have, by name, these files."""
    files = [(file.label, {channel.name for channel in file.channels}) for file in pending.seen if file.channels]
    holders: dict[str, list[str]] = {}
    for label, names in files:
        for name in names:
            holders.setdefault(name, []).append(label)
    return {name: labels for name, labels in holders.items() if len(labels) < len(files)}


def used_twice(pending: PendingUpload, channels: Sequence[ChannelSummary]) -> dict[str, str]:
    """Channels that the form uses twice, with the first use."""
    names = {channel.name for channel in channels}
    used = [(str(error["value"]), error["field"].removeprefix("channels.")) for error in pending.refused]
    return {name: field for name, field in used if name in names and field in CHOICES}


def is_unsaid(pending: PendingUpload, file: FileSummary) -> bool:
    """Whether the channels of a file are not assigned yet."""
    return pending.rig is None and bool(file.channels)
