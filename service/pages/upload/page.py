"""Upload: files are read, shown channel by channel, and stored only on confirmation."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from service.auth import session
from service.dependencies import Store, Table
from service.ingest import rig_words, skin_imports
from service.ingest.accept import RIG
from service.ingest.reading import MOST_RECORDINGS, InspectedFile, keeping
from service.ingest.uploads import UploadFolder, received, texts
from service.pages.shared import same_request
from service.pages.shared.downloads import Numbers, attachment, downloadable
from service.pages.shared.figures import Drawn
from service.pages.shared.formats import condition_columns
from service.pages.shared.forms import FORM_OF_SESSION, NOT_ASKED, TOKEN, Form, require_form_token, see
from service.pages.shared.html import page
from service.pages.upload import error_words, exported_skin, file_summary, templates
from service.pages.upload import mapping as mappings
from service.pages.upload.figures import lines_columns, trace_columns
from service.pages.upload.file_summary import MOST_LISTED, RecordingSummary
from service.pages.upload.looking import (
    CORRECTS,
    SKIN_FIELD,
    channels_of,
    field_errors,
    held_by_some,
    in_turn,
    is_unsaid,
    keep_good,
    look_at_all,
    looked,
    shown,
    skin_of,
    take_rig,
    used_twice,
)
from service.pages.upload.pending_uploads import Pending, PendingUpload, PendingUploads, UploadOfSession
from service.store import Database, Missing, campaigns, skins
from service.usecases import d33_cache
from underskin import InvalidInput
from underskin.recordings import rig_description
from underskin.recordings.frf.estimators import checked_estimator
from underskin.recordings.rig_guess import guessed

router = APIRouter(prefix="/upload")


_LONGEST_FIELD = 1000  # bytes of a field other than the files
_ESTIMATOR = "estimator"
_ESTIMATORS = {"H1": "noise in the charge", "H2": "noise in the force", "Hv": "noise in both"}  # for which each is
_MOST_SKINS = 200  # that the form offers
_MOST_NAMED = 5  # files in the request that does the same


@router.get("")
def form(
    request: Request,
    store: Store,
    skin: Annotated[str, Query(max_length=200)] = "",
    corrects: Annotated[str, Query(max_length=200)] = "",
    error: Annotated[str | None, NOT_ASKED] = None,
) -> Response:
    """Asks for files; `corrects`: the campaign that they replace."""
    skin_ids = [row.id for row in store.read(skins.listed, None, None, _MOST_SKINS)]
    corrected = store.read(campaigns.find, corrects) if corrects else None
    held: PendingUploads = request.app.state.pending_uploads
    cookie = session.cookie_of(request)
    return page(
        request,
        "upload.html",
        waiting=held.waiting(cookie),
        discarded=held.discarded(cookie),
        status=200 if error is None else 422,
        error=error,
        skin=skin,
        corrected=corrected,
        known=skin_ids,
        estimators=_ESTIMATORS,
        most_mb=request.app.state.settings.max_upload_mb,
        same=same_request.files(request, ["monday.tdms"], "rig.yaml", skin),
    )


@router.post("")
async def send(request: Request, store: Store) -> Response:
    """Receives files for preview; nothing is stored."""
    held: PendingUploads = request.app.state.pending_uploads
    folder: UploadFolder = request.app.state.uploads
    async with received(request, folder) as sent:
        unlabelled = [part for part in sent if part.label is None]
        fields = await folder.threads.run(partial(texts, unlabelled, _LONGEST_FIELD))
        require_form_token(request, fields.get(TOKEN, ""))
        given = [part for part in sent if part.label and part.field != RIG]
        rig = next((part for part in sent if part.field == RIG and part.label), None)
        if not given:
            error = "No file came. Choose one, or drop it on the page."
            filled = fields.get(SKIN_FIELD, ""), fields.get(CORRECTS, "")
            return await run_in_threadpool(form, request, store, *filled, error)
        corrects = fields.get(CORRECTS) or None
        estimator_typed = fields.get(_ESTIMATOR)
        estimator = checked_estimator(_ESTIMATOR, estimator_typed) if estimator_typed else None
        skin = fields.get(SKIN_FIELD) or await run_in_threadpool(skin_of, store, corrects)
        pending = await folder.threads.run(partial(held.put, session.cookie_of(request), given))
        pending.skin, pending.corrects, pending.estimator = skin, corrects, estimator
        await in_turn(take_rig, store, pending, rig)
    try:
        with held.in_use(pending):
            if await run_in_threadpool(exported_skin.holds_skin, pending):
                async with skin_imports.one_at_a_time:
                    await run_in_threadpool(exported_skin.look, store, pending)
            else:
                await in_turn(look_at_all, request, pending)
    except BaseException:
        held.remove(pending)
        raise
    return see(f"/upload/{pending.id}")


@router.get("/{upload_id}")
async def understood(
    request: Request,
    pending: Pending,
    store: Store,
    file: Annotated[int, Query(ge=0)] = 0,
    first: Annotated[int, Query(ge=0, le=MOST_RECORDINGS)] = 0,
) -> Response:
    """The preview, file by file; `first`: number of the first listed recording."""
    if pending.kept_at is not None:
        return see(pending.kept_at)
    if pending.skin_summary is not None:
        return await run_in_threadpool(exported_skin.shown, request, pending)
    file = min(file, len(pending.files) - 1)
    figures, recordings = await shown(request, pending, file, first)
    return await run_in_threadpool(_understood, request, pending, store, file, first, figures, recordings)


def _understood(
    request: Request,
    pending: PendingUpload,
    store: Database,
    file: int,
    first: int,
    figures: Sequence[Drawn],
    recordings: Sequence[RecordingSummary],
) -> Response:
    skin_ids = [row.id for row in store.read(skins.listed, None, None, _MOST_SKINS)]
    about = _latest(store, pending.skin or pending.seen[file].skin)
    channels = channels_of(pending)
    stated = pending.draft or (pending.rig.document if pending.rig is not None else None)
    seen = pending.seen[file]
    good = sum(summary.recordings for summary in pending.seen)
    document = stated or guessed(channels, seen.properties, about, seen.texts, dated=seen.began is not None)
    return page(
        request,
        "understood.html",
        pending=pending,
        corrected=None if pending.corrects is None else store.read(campaigns.find, pending.corrects),
        number=file,
        file=pending.seen[file],
        groups=error_words.of_files(pending.seen),
        refusals=error_words.of_recordings(pending.seen[file]),
        figures=figures,
        good=good,
        refused=sum(
            len(summary.refused) or len(summary.errors) for summary in pending.seen if not is_unsaid(pending, summary)
        ),
        unsaid=is_unsaid(pending, pending.seen[file]),
        is_unsaid=partial(is_unsaid, pending),
        lost=[
            (at, summary)
            for at, summary in enumerate(pending.seen)
            if good and not summary.recordings and not summary.refused
        ],
        held_by_some=held_by_some(pending),
        recordings=recordings,
        conditions=condition_columns(recording.conditions for recording in recordings),
        first=first,
        most_listed=MOST_LISTED,
        most_sensors=file_summary.MOST_SENSORS,
        apart=len({summary.day for summary in pending.seen if summary.day is not None}) > 1,
        known=skin_ids,
        skin=pending.skin or pending.seen[file].skin or "",
        channels=channels,
        passed_over=[] if stated else mappings.passed_over(channels, document),
        twice=used_twice(pending, channels),
        document=document,
        layout=mappings.sensors_text(document),
        mapping=mappings,
        error_words=error_words,
        rig_words=rig_words,
        is_stated=lambda name: name == rig_description.BLOCK_NAME or file_summary.may_state(pending.seen, name),
        carried_over=[] if pending.remembered is None or pending.rig is None else rig_words.typed_of(pending.rig),
        in_formulas=mappings.in_formulas(document, channels),
        wrong_formulas=mappings.formula_errors(pending.refused, pending.seen[file]),
        offered=templates.offered(store, pending, pending.seen[file]),
        same=same_request.files(
            request,
            [summary.label for summary in pending.seen[:_MOST_NAMED]],
            pending.rig_label,
            pending.skin or "",
            pending.estimator,
        ),
    )


@router.post("/{upload_id}/mapping")
async def mapping(request: Request, sent: Form, pending: Pending) -> Response:
    """Reads the files again with the values of the form."""
    base = pending.draft or (pending.rig.document if pending.rig is not None else {})
    pending.skin = sent.get(SKIN_FIELD, pending.skin or "").strip() or None
    document, wrong = mappings.document_of(sent, base)
    guess = guessed(channels_of(pending), pending.seen[0].properties, {}, pending.seen[0].texts)
    pending.draft = mappings.with_guesses(document, base, guess)
    of_files = mappings.typed_of_files(sent, pending.files)
    units_checked = bool(document.get("units_checked"))
    values, wrong_of_files = mappings.values_of_files(
        of_files, pending.files, document["kind"], units_checked=units_checked
    )
    wrong += wrong_of_files
    pending.refused = [detail for error in wrong for detail in field_errors(error)]
    try:
        rig = rig_description.from_dict(pending.draft)
    except InvalidInput as error:
        wrong.append(error)
        fields_refused = {detail["field"] for detail in pending.refused}
        pending.refused += [detail for detail in field_errors(error) if detail["field"] not in fields_refused]
    pending.of_files = of_files
    if not wrong:
        pending.state_of_files(of_files, values)
        pending.rig, pending.draft, pending.rig_label = rig, None, "rig.json"  # as the page saves it
        pending.remembered = pending.lacking = None
        pending.turned &= not pending.is_depth_composed
        await in_turn(look_at_all, request, pending)
    return see(f"/upload/{pending.id}")


@router.post("/{upload_id}/template", dependencies=[FORM_OF_SESSION])
async def use_template(request: Request, pending: Pending, store: Store) -> Response:
    """Reads the files as earlier files of the same instrument."""
    await run_in_threadpool(use_template_of, store, pending)
    await in_turn(look_at_all, request, pending)
    return see(f"/upload/{pending.id}")


@router.post("/{upload_id}/afresh", dependencies=[FORM_OF_SESSION])
async def start_afresh(request: Request, pending: Pending) -> Response:
    """Reads the files without values remembered from earlier ones."""
    pending.start_afresh()
    await in_turn(look_at_all, request, pending)
    return see(f"/upload/{pending.id}")


def use_template_of(store: Database, pending: PendingUpload) -> None:
    """The same with the skin that the form or the first file names; raises Missing where there is no template."""
    skin = next((file.skin for file in pending.seen), None)  # of an exported skin, no file was seen
    templates.use(store, pending, _latest(store, pending.skin or skin))


@router.post("/{upload_id}/signs")
async def turn_signs(request: Request, sent: Form, pending: Pending) -> Response:
    """Reads the files again with curves that count pressing negative inverted, or unchanged."""
    pending.turned = sent.get("turned") == "yes" and not pending.is_depth_composed
    await in_turn(look_at_all, request, pending)
    return see(f"/upload/{pending.id}")


@router.post("/{upload_id}/keep")
async def keep(request: Request, sent: Form, pending: Pending, store: Store, table: Table) -> Response:
    """Stores the valid part."""
    async with keeping(store):
        campaign_ids = await run_in_threadpool(keep_good, request, pending, sent, store)
        await run_in_threadpool(d33_cache.derive, store, table, campaign_ids)
    return see(pending.kept_at or f"/upload/{pending.id}")


@router.post("/{upload_id}/skin", dependencies=[FORM_OF_SESSION])
async def bring_in(pending: Pending, store: Store) -> Response:
    """Imports an exported skin."""
    if pending.skin_summary is None:
        raise Missing("There is no exported skin in this upload.")
    async with skin_imports.one_at_a_time:
        store.require_hope()
        await run_in_threadpool(exported_skin.bring_in, store, pending)
    return see(pending.kept_at or f"/upload/{pending.id}")


def _latest(store: Database, skin: str | None) -> Mapping[str, Any]:
    """What the campaigns of a skin say of it."""
    row = None if skin is None else store.read(campaigns.describing, skin)
    return {} if row is None else dict(row.about["skin"])


@router.get("/{upload_id}/rig.json")
def rig_json(pending: Pending) -> Response:
    """The rig description in use."""
    if pending.rig is None:
        raise Missing("There is no rig description yet.")
    content = orjson.dumps(pending.rig.document, option=orjson.OPT_INDENT_2)
    return attachment("rig.json", content, "application/json")


@downloadable(router, "/{upload_id}/{file}/traces")
async def traces_csv(request: Request, pending: Pending, file: int) -> Numbers:
    """The channels of a file's first part."""
    return await in_turn(_csv, "traces", trace_columns, request, pending, file)


@downloadable(router, "/{upload_id}/{file}/frf")
async def frf_csv(request: Request, pending: Pending, file: int) -> Numbers:
    """The FRFs of a file."""
    return await in_turn(_csv, "frf", lines_columns, request, pending, file)


def _csv(
    name: str,
    columns: Callable[[InspectedFile], Mapping[str, Sequence[Any]]],
    request: Request,
    pending: PendingUpload,
    file: int,
) -> Numbers:
    return Numbers(name, columns(looked(request, pending, file)))


@router.post("/{upload_id}/discard", dependencies=[FORM_OF_SESSION])
def discard(pending: Pending) -> Response:
    """Puts it aside; for a while it can be taken back."""
    pending.discarded = True
    return see("/upload")


@router.post("/{upload_id}/restore", dependencies=[FORM_OF_SESSION])
def restore(pending: UploadOfSession) -> Response:
    """Takes back that it was discarded."""
    pending.discarded = False
    return see(f"/upload/{pending.id}")
