"""Upload: files are looked at, told of channel by channel, and kept only when somebody says so."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from service.auth import session
from service.dependencies import WRITE, Store, Table
from service.ingest.accept import RIG
from service.ingest.reading import READING_SLOTS, Look, look, require_few
from service.ingest.uploads import Upload, received
from service.pages.shared import same_request
from service.pages.shared.figures import Drawn, csv_answer
from service.pages.shared.forms import OWN_FORM, TOKEN, Form, require_own, see
from service.pages.shared.html import page
from service.pages.upload import alike, before_keeping, exported_skin, rig_in_use
from service.pages.upload.figures import figures, lines_columns, trace_columns
from service.pages.upload.file_summary import MOST_LISTED, ChannelSeen, FileSeen, seen
from service.pages.upload.keep import CORRECTS, SKIN_FIELD, all_told, keep_good
from service.pages.upload.mapping import (
    CHANNELS,
    KINDS,
    RECORDING,
    SKIN,
    document_of,
    guessed,
    passed_over,
    sensors_text,
)
from service.pages.upload.pending_uploads import Shelf, Shelved
from service.problems import Refusal
from service.store import campaigns, skins
from service.store.engine import Database
from service.store.errors import Missing
from service.usecases import d33_cache
from underskin import InvalidInput
from underskin.recordings import rig_description

router = APIRouter(prefix="/upload")

_LONGEST_FIELD = 1000  # bytes of a field beside the files
_MOST_SKINS = 200  # that the form offers
_MOST_NAMED = 5  # files in the request that does the same


@router.get("")
def form(
    request: Request,
    store: Store,
    skin: Annotated[str, Query(max_length=200)] = "",
    corrects: Annotated[str, Query(max_length=200)] = "",
) -> Response:
    """Asks for files; `corrects`: the campaign whose place they take."""
    with store.reading() as connection:
        known = [row.id for row in skins.listed(connection, None, None, _MOST_SKINS)]
    return page(
        request,
        "upload.html",
        skin=skin,
        corrects=corrects,
        known=known,
        most_mb=request.app.state.settings.max_upload_mb,
        same=same_request.files(request, ["monday.tdms"], "rig.yaml", skin),
    )


@router.post("", dependencies=WRITE)
async def send(request: Request, store: Store) -> Response:
    """Takes files to be looked at; none is kept."""
    shelf: Shelf = request.app.state.shelf
    cookie = session.cookie_in(dict(request.scope["headers"]))
    async with received(request, request.app.state.uploads) as sent:
        fields = {one.field: _short(one) for one in sent if one.label is None}
        require_own(request, fields.get(TOKEN, ""))
        given = [one for one in sent if one.label and one.field != RIG]
        rig = next((one for one in sent if one.field == RIG and one.label), None)
        if not given:
            raise Refusal(422, "No file came. Choose one, or drop it on the page.", title="No file")
        corrects = fields.get(CORRECTS) or None
        skin = fields.get(SKIN_FIELD) or await run_in_threadpool(rig_in_use.skin_of, store, corrects)
        rig_and_errors = await run_in_threadpool(rig_in_use.rig, store, rig, skin)
        shelved = shelf.put(cookie, given)
    shelved.skin, shelved.corrects = skin, corrects
    shelved.rig, shelved.refused = rig_and_errors
    shelved.rig_label = None if rig is None or shelved.rig is None else rig.label
    try:
        if await run_in_threadpool(exported_skin.holds_skin, shelved):
            await exported_skin.look(store, shelved)
        else:
            async with READING_SLOTS:
                await run_in_threadpool(_look, request, shelved)
    except BaseException:
        shelf.discard(shelved)
        raise
    return see(f"/upload/{shelved.id}")


@router.get("/{upload_id}")
def understood(request: Request, upload_id: str, store: Store, file: Annotated[int, Query(ge=0)] = 0) -> Response:
    """What was understood, file by file."""
    shelved = _find(request, upload_id)
    if shelved.kept_at is not None:
        return see(shelved.kept_at)
    if shelved.skin_seen is not None:
        return exported_skin.shown(request, shelved)
    file = min(file, len(shelved.files) - 1)
    if file not in shelved.drawn:
        _draw(shelved, file, _looked(request, shelved, file))
    with store.reading() as connection:
        known = [row.id for row in skins.listed(connection, None, None, _MOST_SKINS)]
        about = _latest(store, shelved.skin or shelved.seen[file].skin)
    channels = _channels(shelved)
    said = shelved.draft or (shelved.rig.document if shelved.rig is not None else None)
    document = said or guessed(channels, shelved.seen[file].properties, about)
    return page(
        request,
        "understood.html",
        shelved=shelved,
        number=file,
        file=shelved.seen[file],
        groups=alike.of_files(shelved.seen),
        refusals=alike.of_recordings(shelved.seen[file]),
        figures=shelved.drawn[file],
        good=sum(one.recordings for one in shelved.seen),
        refused=sum(len(one.refused) or len(one.errors) for one in shelved.seen if not _unsaid(shelved, one)),
        unsaid=_unsaid(shelved, shelved.seen[file]),
        most_listed=MOST_LISTED,
        known=known,
        skin=shelved.skin or shelved.seen[file].skin or "",
        channels=channels,
        passed_over=[] if said else passed_over(channels),
        twice=_twice(shelved, channels),
        document=document,
        layout=sensors_text(document),
        kinds=KINDS,
        fields=CHANNELS,
        skin_fields=SKIN,
        recording_fields=RECORDING,
        same=same_request.files(
            request,
            [one.label for one in shelved.seen[:_MOST_NAMED]],
            shelved.rig_label,
            shelved.skin or "",
        ),
    )


@router.post("/{upload_id}/mapping", dependencies=WRITE)
async def mapping(request: Request, upload_id: str, sent: Form) -> Response:
    """Reads the files again, as a form says what they are."""
    shelved = _find(request, upload_id)
    base = shelved.draft or (shelved.rig.document if shelved.rig is not None else {})
    shelved.skin = sent.get(SKIN_FIELD, shelved.skin or "").strip() or None
    shelved.draft, wrong = document_of(sent, base)
    try:
        rig = rig_description.from_dict(shelved.draft)
    except InvalidInput as error:
        wrong.append(error)
    shelved.refused = [told for error in wrong for told in all_told(error)]
    if wrong:
        return see(f"/upload/{upload_id}")
    shelved.rig, shelved.draft, shelved.rig_label = rig, None, "rig.json"  # as the page saves it
    async with READING_SLOTS:
        await run_in_threadpool(_look, request, shelved)
    return see(f"/upload/{upload_id}")


@router.post("/{upload_id}/keep", dependencies=WRITE)
async def keep(request: Request, upload_id: str, sent: Form, store: Store, table: Table) -> Response:
    """Keeps what is good of it."""
    shelved = _find(request, upload_id)
    async with READING_SLOTS:
        kept = await run_in_threadpool(keep_good, request, shelved, sent, store)
        await run_in_threadpool(d33_cache.derive, store, table, kept)
    return see(shelved.kept_at or f"/upload/{upload_id}")


@router.post("/{upload_id}/skin", dependencies=[*WRITE, OWN_FORM])
async def bring_in(request: Request, upload_id: str, store: Store) -> Response:
    """Brings in an exported skin."""
    shelved = _find(request, upload_id)
    if shelved.skin_seen is None:
        raise Missing("There is no exported skin in this upload.")
    await exported_skin.bring_in(request, store, shelved)
    return see(shelved.kept_at or f"/upload/{upload_id}")


@router.post("/{upload_id}/discard", dependencies=[*WRITE, OWN_FORM])
def discard(request: Request, upload_id: str) -> Response:
    """Removes it."""
    request.app.state.shelf.discard(_find(request, upload_id))
    return see("/upload")


@router.get("/{upload_id}/rig.json")
def rig_json(request: Request, upload_id: str) -> Response:
    """The rig description in use."""
    rig = _find(request, upload_id).rig
    if rig is None:
        raise Missing("There is no rig description yet.")
    content = orjson.dumps(rig.document, option=orjson.OPT_INDENT_2)
    headers = {"Content-Disposition": 'attachment; filename="rig.json"', "X-Content-Type-Options": "nosniff"}
    return Response(content, headers=headers, media_type="application/json")


@router.get("/{upload_id}/{file}/traces.csv")
def traces_csv(request: Request, upload_id: str, file: int) -> Response:
    """The channels of a file's first part."""
    return csv_answer("traces", trace_columns(_looked(request, _find(request, upload_id), file)))


@router.get("/{upload_id}/{file}/frf.csv")
def frf_csv(request: Request, upload_id: str, file: int) -> Response:
    """The FRFs of a file."""
    return csv_answer("frf", lines_columns(_looked(request, _find(request, upload_id), file)))


def _find(request: Request, upload_id: str) -> Shelved:
    shelf: Shelf = request.app.state.shelf
    return shelf.find(session.cookie_in(dict(request.scope["headers"])), upload_id)


def _looked(request: Request, shelved: Shelved, number: int) -> Look:
    if not 0 <= number < len(shelved.files) or shelved.kept_at is not None:
        raise Missing("There is no such file in this upload.")
    return look(shelved.files[number], shelved.rig, request.app.state.settings.max_body_bytes)


def _look(request: Request, shelved: Shelved) -> None:
    """Read every file; the figures of the first one are drawn with it."""
    summaries: list[FileSeen] = []
    drawn: list[Drawn] = []
    recordings = 0
    for number, upload in enumerate(shelved.files):
        found = _looked(request, shelved, number)
        recordings += sum(one.recordings for one in found.found)
        require_few(len(summaries) + len(found.found), recordings)
        summaries.append(
            seen(upload, found, before_keeping.worth_knowing(request, found, shelved.skin, shelved.corrects))
        )
        if number == 0:
            drawn = figures(found, f"/upload/{shelved.id}/0/")
    shelved.seen, shelved.drawn = summaries, {0: drawn}


def _draw(shelved: Shelved, number: int, found: Look) -> None:
    shelved.draw(number, figures(found, f"/upload/{shelved.id}/{number}/"))


def _latest(store: Database, skin: str | None) -> Mapping[str, Any]:
    """What the latest campaign of a skin says of it."""
    if skin is None:
        return {}
    with store.reading() as connection, suppress(Missing):
        root = skins.require_root(connection, skin)
        rows = campaigns.listed(connection, campaigns.Filters(skin=root, state="current"), None, 1)
        return dict(rows[0].about["skin"]) if rows else {}
    return {}


def _unsaid(shelved: Shelved, file: FileSeen) -> bool:
    """Whether nobody has said yet what the channels of a file are."""
    return shelved.rig is None and bool(file.channels)


def _channels(shelved: Shelved) -> list[ChannelSeen]:
    """Of all files, by name; those that hold the mapping's channels first come first."""
    found = {channel.name: channel for one in reversed(shelved.seen) for channel in reversed(one.channels)}
    return list(reversed(found.values()))


def _twice(shelved: Shelved, channels: Sequence[ChannelSeen]) -> dict[str, str]:
    """Channels that the form took for what another one is already, and that."""
    names = {channel.name for channel in channels}
    told = [(str(error["value"]), error["field"].removeprefix("channels.")) for error in shelved.refused]
    return {name: field for name, field in told if name in names and field in CHANNELS}


def _short(field: Upload) -> str:
    with field.path.open("rb") as file:
        return file.read(_LONGEST_FIELD).decode("utf-8", "replace").strip()
