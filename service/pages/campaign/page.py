"""A campaign: its FRFs, the FRF against preload, the array's response, d33 with intervals."""

from typing import Annotated, Any
from urllib.parse import quote

from fastapi import APIRouter, Depends, Query, Request, Response

from service.dependencies import CampaignId, Store, Table
from service.pages.campaign.figures import band_query, figures
from service.pages.shared import same_request, verdicts
from service.pages.shared.attention import attention
from service.pages.shared.conditions import condition_columns
from service.pages.shared.figures import csv_answer, csv_of_rows, file_name
from service.pages.shared.forms import RefusedForm, in_form_words, number
from service.pages.shared.html import page
from service.schemas.campaign_d33 import D33Value
from service.store import AnyRow, Database, annotations, campaigns, diagnoses
from service.usecases import changes, d33_cache
from service.usecases.figure_data import frf_columns
from underskin.errors import InvalidInput
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/campaigns/{campaign_id}")

_MOST_LISTED = 60  # recordings on a page of the list
_MOST_OFFERED = 1000  # recordings, to be excluded
_MOST_DIAGNOSES = 5
_LABELS = {"band_low_hz": "from [Hz]", "band_high_hz": "to [Hz]", "band_hz": "band [Hz]"}
_EndText = Annotated[str, Query(max_length=40)]


def _band(band_low_hz: _EndText = "", band_high_hz: _EndText = "") -> d33_cache.BandHz | None:
    """The band chosen by the reader; None: the flat zone. Raises InvalidInput."""
    if not band_low_hz and not band_high_hz:
        return None
    return number("band_low_hz", band_low_hz), number("band_high_hz", band_high_hz)


BandOfQuery = Annotated[d33_cache.BandHz | None, Depends(_band)]


@router.get("")
def campaign(
    request: Request,
    campaign_id: CampaignId,
    store: Store,
    table: Table,
    show: str = "",
    first: Annotated[int, Query(ge=0, le=10**9)] = 0,
) -> Response:
    """The page of a campaign. `show`: the sensor or recording whose lines are drawn; `first`: index of the first
    listed recording. Values are averaged over the band of the address; if that is invalid, over the flat zone, with
    the reason in the form."""
    return shown(request, campaign_id, store, table, show, first=first)


def shown(
    request: Request,
    campaign_id: str,
    store: Database,
    table: SigmaTable,
    show: str = "",
    refused: RefusedForm | None = None,
    first: int = 0,
) -> Response:
    """The page; `refused`: a form of it that was sent and is invalid."""
    typed = [request.query_params.get(name, "")[:40] for name in ("band_low_hz", "band_high_hz")]
    with store.reading() as connection:
        row = campaigns.find(connection, campaign_id)
        recordings = campaigns.recordings_of(connection, row.number)
        latest = diagnoses.listed(connection, diagnoses.DiagnosisFilters(campaign=campaign_id), None, _MOST_DIAGNOSES)
        verdict_of = verdicts.of_rows(connection, latest)
        changed = changes.of_campaign(connection, campaign_id)
        may_be_discarded = annotations.may_be_discarded(connection, row)
    try:
        band = _band(*typed)
        answer, numbers = d33_cache.with_numbers(store, table, row, band)
    except InvalidInput as error:
        band = None
        answer, numbers = d33_cache.with_numbers(store, table, row, band)
        refused = refused or RefusedForm("band", in_form_words(error, _LABELS), {}, 200)
    sensors = sorted({recording.sensor for recording in recordings if recording.sensor is not None})
    show = show if show in {"", *sensors, *(recording.id for recording in recordings)} else ""
    path = f"/v1/campaigns/{quote(row.id, safe='')}/d33" + (f"?{band_query(band)}" if band else "")
    return page(
        request,
        "campaign.html",
        status=200 if refused is None else refused.status,
        refused=refused,
        band_typed=typed,
        changes=changed,
        may_be_discarded=may_be_discarded,
        row=row,
        state=campaigns.state(row),
        answer=answer,
        attention=attention(answer, row),
        described=row.about["skin"],
        recordings=recordings,
        conditions=condition_columns(recording.scalars.get("conditions") for recording in recordings),
        first=first if first < len(recordings) else 0,
        most_listed=_MOST_LISTED,
        most_offered=_MOST_OFFERED,
        listed="first" in request.query_params,
        sensors=sensors,
        diagnoses=list(verdict_of.values()),
        figures=figures(
            store, row, answer, numbers, show, curves=any(recording.kind != "frf" for recording in recordings)
        ),
        show=show,
        band=band,
        same=same_request.get(request, path, f"client.campaigns.d33({row.id!r}" + (f", {band})" if band else ")")),
    )


@router.get("/frf.csv")
def frf_csv(campaign_id: CampaignId, store: Store, show: str = "") -> Response:
    """Every line of the recordings, or of those of `show`, as stored or estimated."""
    name = _file(store.read(campaigns.find, campaign_id), "frf")
    return csv_answer(name, frf_columns(_loaded(store, campaign_id), show))


@router.get("/preload.csv")
def preload_csv(campaign_id: CampaignId, store: Store, table: Table, band: BandOfQuery) -> Response:
    """The FRF in the flat zone of each recording, and the model's."""
    row = store.read(campaigns.find, campaign_id)
    return csv_answer(
        _file(row, "frf-against-preload"), d33_cache.with_numbers(store, table, row, band)[1]["recordings"]
    )


@router.get("/d33.csv")
def d33_csv(campaign_id: CampaignId, store: Store, table: Table, band: BandOfQuery) -> Response:
    """d33 of each sensor, and of each sensor, sphere and preload."""
    row = store.read(campaigns.find, campaign_id)
    answer = d33_cache.answer(store, table, row, band)
    names = ("sensor", "indenter_radius_mm", "preload_n", "recordings", *D33Value.model_fields)
    return csv_of_rows(_file(row, "d33"), names, [*answer["sensors"], *answer["cells"]])


@router.get("/curves.csv")
def curves_csv(campaign_id: CampaignId, store: Store) -> Response:
    """Every sample of the indentation and compression recordings."""
    columns: dict[str, list[Any]] = {name: [] for name in ("recording", "displacement_mm", "force_n")}
    for curve in _loaded(store, campaign_id).curves:
        columns["recording"] += [curve.id] * len(curve.force_n)
        columns["displacement_mm"] += curve.displacement_mm.tolist()
        columns["force_n"] += curve.force_n.tolist()
    return csv_answer(_file(store.read(campaigns.find, campaign_id), "curves"), columns)


def _file(row: AnyRow, what: str) -> str:
    """The name of a file of a campaign, without its ending."""
    return file_name(row.skin_id, row.name, what)


def _loaded(store: Database, campaign_id: str) -> Campaign:
    with store.reading() as connection:
        return campaigns.load(connection, campaigns.find(connection, campaign_id), with_excluded=False)
