"""Reading the files of an upload by its rig description and its form, for preview."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from fastapi import Request
from starlette.concurrency import run_in_threadpool

from service.ingest.reading import READING_SLOTS, InspectedFile, look, require_few
from service.pages.shared.figures import Drawn
from service.pages.upload import course_figure
from service.pages.upload.figures import figures
from service.pages.upload.file_summary import ChannelSummary, FileSummary, RecordingSummary, listed, seen
from service.pages.upload.keep import counts_pressing_negative, worth_knowing
from service.pages.upload.mapping import CHOICES, mapped_file
from service.pages.upload.pending_uploads import PendingUpload, PendingUploads
from service.pages.upload.turned_curves import with_curves_turned
from service.store import Missing
from underskin.recordings.rig_mapping import MappedFile, has_channels

_Result = TypeVar("_Result")

_WORKBOOK, _OF_TEXT = "XLSX", ", separated by tabs, with decimal points"


async def in_turn(work: Callable[..., _Result], *arguments: Any) -> _Result:
    """The result of `work`, which reads files for preview: two at once, the others wait without a thread."""
    async with READING_SLOTS:
        return await run_in_threadpool(work, *arguments)


def looked(request: Request, pending: PendingUpload, number: int) -> InspectedFile:
    """One file, read; raises Missing if there is none of that number any more."""
    if not 0 <= number < len(pending.files) or pending.kept_at is not None:
        raise Missing("There is no such file in this upload.")
    pending_uploads: PendingUploads = request.app.state.pending_uploads
    with pending_uploads.in_use(pending):
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
    force_course = course_figure.course(inspected, summary, pending.rig, turned=pending.turned)
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
