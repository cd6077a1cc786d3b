"""Campaigns: sent, listed, read, withdrawn, corrected, their recordings excluded, their d33."""

from functools import partial
from typing import Annotated, Any, Literal

import orjson
from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool

from service.dependencies import CampaignId, Cursor, Limit, Store, Table, number_of_cursor, sender
from service.ingest.accept import RIG, IngestOptions, accept
from service.ingest.reading import keeping
from service.ingest.uploads import FILE, received, split
from service.middleware.json_bodies import JsonRoute
from service.routes.idempotency import IdempotencyKey
from service.routes.temporary_files import made_file
from service.schemas import campaigns as models
from service.schemas.campaign_d33 import D33
from service.store import campaigns
from service.store.times import stored
from service.usecases import campaigns as usecase
from service.usecases import d33_cache
from underskin.errors import conflicting, wrong_type

router = APIRouter(prefix="/v1", tags=["campaigns"], route_class=JsonRoute)


_FILE: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}
_CAMPAIGN: dict[str, Any] = {"$ref": "#/components/schemas/Campaign"}
EXAMPLE: dict[str, Any] = {
    "schema": "campaign/1",
    "name": "first day",
    "skin": {
        "id": "palm-3",
        "thickness_mm": 2.5,
        "youngs_modulus_mpa": 16.0,
        "poisson_ratio": 0.5,
        "sensor_radius_mm": 1.5,
        "sensors": [{"id": "s01", "x_mm": 0.0, "y_mm": 0.0}],
    },
    "recordings": [
        {
            "id": name,
            "sensor": "s01",
            "indenter_radius_mm": 4.0,
            "preload_n": preload,
            "dynamic_force_n": 0.09,
            "recorded_at": "2017-05-03T09:00:00Z",
            "frequency_hz": [10.0, 20.0, 40.0],
            "frf_re_pc_per_n": lines,
            "frf_im_pc_per_n": [0.1, 0.0, 0.0],
        }
        for name, preload, lines in (("r1", 1.0, [7.1, 7.0, 7.0]), ("r2", 2.0, [6.8, 6.7, 6.7]))
    ],
}
_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "description": "One campaign as JSON (`campaign/1`), a JSON list of them, one file as the whole body, or a "
        "form with any number of files; its part `rig` is a rig description, for files that do not say what their "
        "channels are. What the query says may be fields of the form instead; what both say must be the same. "
        "Other fields that are no files are refused.",
        "content": {
            "application/json": {
                "schema": {
                    "anyOf": [_CAMPAIGN, {"type": "array", "items": _CAMPAIGN, "minItems": 1}],
                    "description": "One campaign, or a list of them.",
                },
                "example": EXAMPLE,
            },
            "application/octet-stream": {**_FILE, "example": orjson.dumps(EXAMPLE).decode()},
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "description": "Files, what their channels are, and the options of the query.",
                    "properties": {
                        FILE: {
                            "type": "array",
                            "items": _FILE["schema"],
                            "description": "Files of campaigns, or as instruments write them.",
                        },
                        RIG: {"type": "string", "description": "A rig description, `rig/1`, as YAML or JSON."},
                        **models.SendOptions.model_json_schema()["properties"],
                    },
                    "additionalProperties": {**_FILE["schema"], "description": "More files, by any other names."},
                },
                "example": {FILE: [orjson.dumps(EXAMPLE).decode()], "together": "palm 3 on Monday"},
            },
        },
    }
}


@router.post(
    "/campaigns",
    summary="Send campaigns",
    status_code=201,
    openapi_extra=_BODY,
    responses={201: {"model": models.CampaignResult | models.BatchResult}},
)
async def post_campaigns(
    request: Request,
    store: Store,
    table: Table,
    query: Annotated[models.SendOptions, Query()],
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Keeps the good recordings and says of each of the others what was wrong. What is answered is on the disk.

    One campaign is answered with its own entry, a form or a list with one entry a campaign: one in all where they go
    `together`.
    """
    settings, folder = request.app.state.settings, request.app.state.uploads
    async with received(request, folder) as parts, keeping(store):
        fields, uploads = await folder.threads.run(partial(split, parts, list(models.SendOptions.model_fields), [RIG]))
        options = IngestOptions(
            settings, sender(request), idempotency_key=idempotency_key, **query.with_form(fields).model_dump()
        )
        answer, repeats = await run_in_threadpool(accept, store, uploads, options)
        campaign_ids = [result["id"] for result in answer.get("campaigns", [answer]) if result["id"] is not None]
        await run_in_threadpool(d33_cache.derive, store, table, campaign_ids)
    headers = {"Idempotency-Replayed": "true"} if repeats else {}
    return Response(orjson.dumps(answer), status_code=201, headers=headers, media_type="application/json")


@router.get("/campaigns", operation_id="campaigns", summary="Campaigns, the latest first")
def listed(
    store: Store,
    skin: Annotated[str | None, Query(description="Of this skin and of those joined with it.")] = None,
    state: Annotated[models.State | Literal["all"], Query(description="Only those of this state.")] = "current",
    name_contains: Annotated[str | None, Query(description="Only those whose name contains this.")] = None,
    recorded_from: Annotated[str | None, Query(description="Only those recorded at this time or later.")] = None,
    recorded_to: Annotated[str | None, Query(description="Only those recorded before this time.")] = None,
    limit: Limit = 50,
    cursor: Cursor = None,
) -> models.CampaignList:
    """Without their recordings; a page holds `limit` of them."""
    filters = campaigns.CampaignFilters(
        skin=skin,
        state=None if state == "all" else state,
        name_contains=name_contains,
        recorded_from=_time("recorded_from", recorded_from),
        recorded_to=_time("recorded_to", recorded_to),
    )
    rows = store.read(campaigns.listed, filters, number_of_cursor(cursor), limit + 1)
    page = [models.CampaignEntry(**usecase.entry(row)) for row in rows[:limit]]
    return models.CampaignList(campaigns=page, next=str(rows[limit - 1].number) if len(rows) > limit else None)


@router.get("/campaigns/{campaign_id}", summary="One campaign")
def campaign(campaign_id: CampaignId, store: Store) -> models.CampaignDetail:
    """With its recordings, without their arrays."""
    return store.read(usecase.detail, campaign_id)


@router.get(
    "/campaigns/{campaign_id}/document",
    summary="One campaign as campaign/1",
    response_class=Response,
    responses={
        200: {
            "content": {
                "application/json": {"schema": _CAMPAIGN},
                "application/x-hdf5": _FILE,
            }
        }
    },
)
def campaign_document(
    campaign_id: CampaignId,
    request: Request,
    store: Store,
    file_format: Annotated[Literal["json", "hdf5"], Query(alias="format", description="JSON or HDF5.")] = "json",
) -> Response:
    """All recordings that were kept, arrays and all, those excluded later included."""
    row = store.read(campaigns.find, campaign_id)
    if file_format == "json":
        return StreamingResponse(usecase.json_parts(store, row), media_type="application/json")
    return made_file(
        request,
        f"{row.id}.h5",
        "application/x-hdf5",
        partial(usecase.write_hdf5, store, row),
    )


@router.get("/campaigns/{campaign_id}/d33", summary="d33 of each sensor")
def campaign_d33(
    campaign_id: CampaignId,
    store: Store,
    table: Table,
    band_low_hz: Annotated[
        float | None, Query(gt=0, description="Average from here [Hz], not over the flat zone.")
    ] = None,
    band_high_hz: Annotated[float | None, Query(gt=0, description="Average up to here [Hz].")] = None,
    model: Annotated[
        Literal["paper", "adopted"], Query(description="`adopted`: the model in force of the campaign's skin.")
    ] = "paper",
) -> D33:
    """By sensor, indenter and preload, with uncertainty, and what it leaves out."""
    if (band_low_hz is None) != (band_high_hz is None):
        raise conflicting("band_low_hz", band_low_hz, "band_low_hz and band_high_hz go together")
    band = None if band_low_hz is None or band_high_hz is None else (band_low_hz, band_high_hz)
    row = store.read(campaigns.find, campaign_id)
    return D33(**d33_cache.by_model(store, table, row, model, band))


@router.post("/campaigns/{campaign_id}/withdraw", summary="Withdraw it")
def withdraw_campaign(
    request: Request, campaign_id: CampaignId, withdrawal: models.Withdrawal, store: Store
) -> models.CampaignDetail:
    """Figures no longer use it; it can still be read."""
    with store.writing() as connection:
        campaigns.withdraw(connection, campaign_id, withdrawal.reason, sender(request))
        return usecase.detail(connection, campaign_id)


@router.post("/campaigns/{campaign_id}/exclusions", summary="Exclude a recording")
def exclude_recording(
    request: Request, campaign_id: CampaignId, exclusion: models.Exclusion, store: Store, table: Table
) -> models.CampaignDetail:
    """Figures no longer use it; it can still be read. A correction is the way back."""
    usecase.exclude(store, table, campaign_id, exclusion.recording, exclusion.reason, sender(request))
    return store.read(usecase.detail, campaign_id)


def _time(name: str, text: str | None) -> str | None:
    try:
        return None if text is None else stored(text)
    except ValueError:
        raise wrong_type(name, text, "must be a date and time like 2017-05-03T09:00:00Z") from None
