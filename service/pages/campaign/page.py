"""A campaign: its FRFs, the FRF against preload, the array's response, d33 with intervals."""

from typing import Annotated, Any
from urllib.parse import quote

from fastapi import APIRouter, Depends, Query, Request, Response

from service.dependencies import WRITE, CampaignId, Store, Table
from service.pages.campaign.figures import band_query, figures
from service.pages.shared import same_request, verdicts
from service.pages.shared.figures import csv_answer, csv_of_rows
from service.pages.shared.forms import Form, reason, see
from service.pages.shared.html import page
from service.schemas.campaign_d33 import D33Value
from service.store import Database, campaigns, diagnoses
from service.usecases import d33_cache
from service.usecases.campaigns import exclude as exclude_recording
from service.usecases.figure_data import frf_columns
from underskin.errors import wrong_type
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording

router = APIRouter(prefix="/campaigns/{campaign_id}")

_MOST_LISTED = 60
_MOST_DIAGNOSES = 5


def _band(
    band_low_hz: Annotated[str, Query(max_length=40)] = "", band_high_hz: Annotated[str, Query(max_length=40)] = ""
) -> d33_cache.BandHz | None:
    """The band that the reader chose; None: the flat zone."""
    if not band_low_hz and not band_high_hz:
        return None
    try:
        low, high = float(band_low_hz), float(band_high_hz)
    except ValueError:
        raise wrong_type("band_low_hz", band_low_hz, "band_low_hz and band_high_hz must both be numbers") from None
    return low, high


BandOfQuery = Annotated[d33_cache.BandHz | None, Depends(_band)]


@router.get("")
def campaign(
    request: Request, campaign_id: CampaignId, store: Store, table: Table, band: BandOfQuery, show: str = ""
) -> Response:
    """All at a glance; `show` picks the sensor, or the recording, whose lines are drawn, `band` what is averaged."""
    with store.reading() as connection:
        row = campaigns.find(connection, campaign_id)
        recordings = campaigns.recordings_of(connection, row.number)
        latest = diagnoses.listed(connection, diagnoses.DiagnosisFilters(campaign=campaign_id), None, _MOST_DIAGNOSES)
        verdict_of = verdicts.of_rows(connection, latest)
    answer, numbers = d33_cache.with_numbers(store, table, row, band)
    sensors = sorted({entry.sensor for entry in recordings if entry.sensor is not None})
    show = show if show in {"", *sensors, *(entry.id for entry in recordings)} else ""
    path = f"/v1/campaigns/{quote(row.id, safe='')}/d33" + (f"?{band_query(band)}" if band else "")
    return page(
        request,
        "campaign.html",
        row=row,
        state=campaigns.state(row),
        answer=answer,
        described=row.about["skin"],
        recordings=recordings,
        most_listed=_MOST_LISTED,
        sensors=sensors,
        diagnoses=list(verdict_of.values()),
        figures=figures(store, row, answer, numbers, show, curves=any(entry.kind != "frf" for entry in recordings)),
        show=show,
        band=band,
        same=same_request.get(request, path, f"client.campaigns.d33({row.id!r}" + (f", {band})" if band else ")")),
    )


@router.get("/frf.csv")
def frf_csv(campaign_id: CampaignId, store: Store, show: str = "") -> Response:
    """Every line of the recordings, or of those of `show`, as they came or were estimated."""
    return csv_answer("frf", frf_columns(_loaded(store, campaign_id), show))


@router.get("/preload.csv")
def preload_csv(campaign_id: CampaignId, store: Store, table: Table, band: BandOfQuery) -> Response:
    """The FRF in the flat zone of each recording, and the model's."""
    row = store.read(campaigns.find, campaign_id)
    return csv_answer("frf-against-preload", d33_cache.with_numbers(store, table, row, band)[1]["recordings"])


@router.get("/d33.csv")
def d33_csv(campaign_id: CampaignId, store: Store, table: Table, band: BandOfQuery) -> Response:
    """d33 of each sensor, and of each sensor, sphere and preload."""
    row = store.read(campaigns.find, campaign_id)
    answer = d33_cache.answer(store, table, row, band)
    names = ("sensor", "indenter_radius_mm", "preload_n", "recordings", *D33Value.model_fields)
    return csv_of_rows("d33", names, [*answer["sensors"], *answer["cells"]])


@router.get("/curves.csv")
def curves_csv(campaign_id: CampaignId, store: Store) -> Response:
    """Every sample of the indentation and compression recordings."""
    columns: dict[str, list[Any]] = {name: [] for name in ("recording", "displacement_mm", "force_n")}
    for recording in _loaded(store, campaign_id).recordings:
        if isinstance(recording, IndentationRecording | CompressionRecording):
            columns["recording"] += [recording.id] * len(recording.force_n)
            columns["displacement_mm"] += recording.displacement_mm.tolist()
            columns["force_n"] += recording.force_n.tolist()
    return csv_answer("curves", columns)


@router.post("/exclude", dependencies=WRITE)
def exclude(campaign_id: CampaignId, sent: Form, store: Store, table: Table) -> Response:
    """Leave a recording out of all figures."""
    exclude_recording(store, table, campaign_id, sent.get("recording", ""), reason(sent))
    return see(f"/campaigns/{quote(campaign_id, safe='')}")


@router.post("/withdraw", dependencies=WRITE)
def withdraw(campaign_id: CampaignId, sent: Form, store: Store) -> Response:
    """Leave the campaign out of all figures."""
    store.write(campaigns.withdraw, campaign_id, reason(sent))
    return see(f"/campaigns/{quote(campaign_id, safe='')}")


def _loaded(store: Database, campaign_id: str) -> Campaign:
    with store.reading() as connection:
        return campaigns.load(connection, campaigns.find(connection, campaign_id), with_excluded=False)
