"""A campaign: its FRFs, the FRF against preload, the array's response, d33 with intervals."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from threading import Lock
from typing import Annotated, Any
from urllib.parse import quote

from fastapi import APIRouter, Depends, Query, Request, Response

from service.dependencies import CampaignId, Store, Table
from service.pages.shared import same_request, verdicts
from service.pages.shared.downloads import Numbers, downloadable, file_name, numbers_of_rows
from service.pages.shared.figures import CLICK, Drawn, columns_of, drawn, drawn_curves, drawn_frf, sensors_of
from service.pages.shared.formats import condition_columns
from service.pages.shared.forms import Refused, RefusedForm, in_form_words, number
from service.pages.shared.html import page
from service.pages.shared.verdicts import attention
from service.schemas.campaign_d33 import D33Value
from service.store import AnyRow, Database, annotations, campaigns, diagnoses
from service.usecases import changes, d33_cache
from service.usecases.figure_data import frf_columns
from underskin.errors import InvalidInput
from underskin.figures.array import frf_versus_preload, response_per_sensor
from underskin.figures.array_map import Quantity, array_map, disc_size, significance_note
from underskin.recordings.campaign import Campaign

router = APIRouter(prefix="/campaigns/{campaign_id}")


_AGAINST_PRELOAD = (
    "indenter_radius_mm", "preload_n", "frf_pc_per_n", "frf_uncertainty_pc_per_n", "model_frf_pc_per_n",
)  # fmt: skip
_MOST_CURVES = 24
_MOST_CACHED = 64
Which = tuple[str, int, str, str, str]  # campaign, revision, table, band, shown part
_cache: dict[Which, list[Drawn]] = {}
_keeping = Lock()
_MOST_LISTED = 60  # recordings on a page of the list
_MOST_OFFERED = 1000  # recordings, to be excluded
_MOST_DIAGNOSES = 5
_LABELS = {"band_low_hz": "from [Hz]", "band_high_hz": "to [Hz]", "band_hz": "band [Hz]"}
_EndText = Annotated[str, Query(max_length=40)]


def figures(
    store: Database, row: AnyRow, answer: Mapping[str, Any], numbers: Mapping[str, Any], show: str, *, curves: bool
) -> list[Drawn]:
    """All figures of a campaign in its present state. `answer`: its d33 as in `/d33`, with its `numbers`; `show` as
    in `measured`; `curves`: whether it has recordings other than FRFs. Recent figures are cached."""
    basis = (row.id, row.revision, answer["table_sha256"], _chosen(answer))
    loaded = cache(lambda: store.read(campaigns.load, row, with_excluded=False))

    def draw_curves() -> list[Drawn]:
        return drawn_curves(loaded().recordings, _MOST_CURVES, " recordings", f"/campaigns/{row.id}/curves.csv")

    makers: dict[str, Callable[[], list[Drawn]]] = {
        **({"curves": draw_curves} if curves else {}),
        f"lines {show}": lambda: drawn_frf(row, loaded, answer, numbers["spreads"], show),
        f"d33 {show}": lambda: _d33(row, answer, numbers, show),
    }
    all_figures = []
    for name, make in makers.items():
        before = _cache.get((*basis, name))
        all_figures += before if before is not None else _keep((*basis, name), make())
    return all_figures


def _keep(which: Which, drawn_now: list[Drawn]) -> list[Drawn]:
    with _keeping:
        while len(_cache) >= _MOST_CACHED:
            del _cache[next(iter(_cache))]
        _cache[which] = drawn_now
    return drawn_now


def band_query(band_hz: tuple[float, float]) -> str:
    """A band in an address."""
    return f"band_low_hz={band_hz[0]!r}&band_high_hz={band_hz[1]!r}"


def _chosen(answer: Mapping[str, Any]) -> str:
    """The band of the address if the reader chose it."""
    band = answer["band"]
    return band_query((band["low_hz"], band["high_hz"])) if band is not None and band["chosen_by_user"] else ""


def _d33(row: AnyRow, answer: Mapping[str, Any], numbers: Mapping[str, Any], show: str) -> list[Drawn]:
    """d33 against preload, per sensor and as a map; if `show` is a sensor, only its points against preload, and it
    is marked."""
    if answer["band"] is None:
        return []
    names, d33, uncertainty, low, high, x_mm, y_mm, reasons = columns_of(
        sensors_of(row, answer), "sensor", *D33Value.model_fields, "x_mm", "y_mm", "reasons"
    )
    array, radius = answer["array_relative"], row.about["skin"].get("sensor_radius_mm")
    limits = None if array is None else (array["d33_low_pc_per_n"], array["d33_high_pc_per_n"])
    sensor = show if show in names else None
    rows = _of_sensor(numbers["recordings"], sensor)
    titles = [f"{name}, sensor {sensor}" for name, sensor in zip(rows["recording"], rows["sensor"], strict=True)]
    page, chosen = f"/campaigns/{row.id}", _chosen(answer)
    chosen = f"?{chosen}" if chosen else ""
    quantity = Quantity("d33", "pC/N", intervals=tuple(zip(low, high, strict=True)))
    return [
        drawn(
            "preload",
            frf_versus_preload(titles, *(rows[name] for name in _AGAINST_PRELOAD)),
            f"FRF in the flat zone against preload{'' if sensor is None else f' of {sensor}'}, for each sphere (radius "
            "R) with 95 % intervals; dashed lines are the paper's model with the array's d33, in the sphere's colour.",
            f"{page}/preload.csv{chosen}",
        ),
        drawn(
            "response",
            response_per_sensor(names, d33, low, high, limits, reasons, sensor),
            f"d33 of each sensor with its 95 % interval. {CLICK}",
            f"{page}/d33.csv{chosen}",
        ),
        drawn(
            "map",
            array_map(names, x_mm, y_mm, d33, uncertainty, reasons, quantity, sensor, radius),
            f"Each sensor where it lies, coloured by its d33. {disc_size(x_mm, y_mm, radius)} "
            f"{significance_note(d33, uncertainty)} {CLICK}",
            f"{page}/d33.csv{chosen}",
        ),
    ]


def _of_sensor(columns: Mapping[str, Sequence[Any]], sensor: str | None) -> dict[str, list[Any]]:
    """The rows of one sensor, or all."""
    row_indices = [row for row, name in enumerate(columns["sensor"]) if sensor in (None, name)]
    return {name: [values[row] for row in row_indices] for name, values in columns.items()}


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
    refused: Refused = None,
) -> Response:
    """The page of a campaign. `show`: the sensor or recording whose lines are drawn; `first`: index of the first
    listed recording. Values are averaged over the band of the address; if that is invalid, over the flat zone, with
    the reason in the form."""
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


@downloadable(router, "/frf")
def frf_csv(campaign_id: CampaignId, store: Store, show: str = "") -> Numbers:
    """Every line of the recordings, or of those of `show`, as stored or estimated."""
    name = _file(store.read(campaigns.find, campaign_id), "frf")
    return Numbers(name, frf_columns(_loaded(store, campaign_id), show))


@downloadable(router, "/preload")
def preload_csv(campaign_id: CampaignId, store: Store, table: Table, band: BandOfQuery) -> Numbers:
    """The FRF in the flat zone of each recording, and the model's."""
    row = store.read(campaigns.find, campaign_id)
    return Numbers(_file(row, "frf-against-preload"), d33_cache.with_numbers(store, table, row, band)[1]["recordings"])


@downloadable(router, "/d33")
def d33_csv(campaign_id: CampaignId, store: Store, table: Table, band: BandOfQuery) -> Numbers:
    """d33 of each sensor, and of each sensor, sphere and preload."""
    row = store.read(campaigns.find, campaign_id)
    answer = d33_cache.answer(store, table, row, band)
    names = ("sensor", "indenter_radius_mm", "preload_n", "recordings", *D33Value.model_fields)
    return numbers_of_rows(_file(row, "d33"), names, [*answer["sensors"], *answer["cells"]])


@downloadable(router, "/curves")
def curves_csv(campaign_id: CampaignId, store: Store) -> Numbers:
    """Every sample of the indentation and compression recordings."""
    columns: dict[str, list[Any]] = {name: [] for name in ("recording", "displacement_mm", "force_n")}
    for curve in _loaded(store, campaign_id).curves:
        columns["recording"] += [curve.id] * len(curve.force_n)
        columns["displacement_mm"] += curve.displacement_mm.tolist()
        columns["force_n"] += curve.force_n.tolist()
    return Numbers(_file(store.read(campaigns.find, campaign_id), "curves"), columns)


def _file(row: AnyRow, what: str) -> str:
    """The name of a file of a campaign, without its ending."""
    return file_name(row.skin_id, row.name, what)


def _loaded(store: Database, campaign_id: str) -> Campaign:
    with store.reading() as connection:
        return campaigns.load(connection, campaigns.find(connection, campaign_id), with_excluded=False)
