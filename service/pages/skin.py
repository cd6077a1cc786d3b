"""A skin: its array as a map, its sensors over time, its campaigns; for a chosen sensor also its FRFs."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from functools import partial
from typing import Annotated, Any, Literal
from urllib.parse import quote, urlencode

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy import Connection
from starlette.background import BackgroundTask

from service.dependencies import SkinId, Store, Table, number_of_cursor
from service.pages.shared import same_request, verdicts
from service.pages.shared.downloads import Numbers, downloadable, file_name, numbers_of_rows
from service.pages.shared.figures import (
    CLICK,
    RESTS,
    By,
    Drawn,
    columns_of,
    drawn,
    drawn_frf,
    drawn_history,
    sensors_of,
)
from service.pages.shared.forms import Refused
from service.pages.shared.html import page
from service.pages.shared.verdicts import adopted_versions, answer_by_it, attention, change_percent
from service.schemas.campaign_d33 import D33Value
from service.schemas.diagnoses import DiagnosisKind
from service.schemas.skins import History, SensorHistory, TrendAnswer
from service.store import (
    AnyRow,
    Database,
    annotations,
    campaigns,
    diagnosed_together,
    diagnoses,
    inversions,
    models,
    overview,
    skins,
)
from service.usecases import changes, d33_cache
from service.usecases import skins as usecase
from underskin.figures.array_map import Quantity, array_map, disc_size, significance_note
from underskin.inversion.array_history import interval
from underskin.inversion.mixed_model import SDS_OF_95
from underskin.recordings.readers.text import in_lab
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/skins/{skin_id}")


_MOST_NAMED = 5  # sensors, in a sentence
Shown = Literal["d33", "uncertainty", "trend"]

# Column of the values, column of their uncertainties, name, unit, reference of the colour scale.
_QUANTITIES: dict[Shown, tuple[str, str, str, str, Literal["others", "zero", "nothing"]]] = {
    "d33": ("d33_pc_per_n", "d33_uncertainty_pc_per_n", "d33", "pC/N", "others"),
    "uncertainty": ("d33_uncertainty_pc_per_n", "d33_uncertainty_pc_per_n", "uncertainty of d33", "pC/N", "nothing"),
    "trend": ("slope_pc_per_n_per_year", "slope_uncertainty_pc_per_n_per_year", "trend", "pC/N a year", "zero"),
}
_ENDS: dict[Shown, tuple[str, str]] = {
    "d33": ("d33_low_pc_per_n", "d33_high_pc_per_n"),
    "trend": ("slope_low_pc_per_n_per_year", "slope_high_pc_per_n_per_year"),
}  # columns of 95 % intervals
_ON_A_PAGE = 50
_SEVERAL: tuple[DiagnosisKind, ...] = ("skin", "fleet")
_MOST_TOGETHER = 5  # of the latest diagnoses of each kind
_AT_ONCE = 2  # campaigns whose d33 a page computes before it answers
_MAP_COLUMNS = (
    "sensor", "x_mm", "y_mm", *D33Value.model_fields,
    "slope_pc_per_n_per_year", "slope_uncertainty_pc_per_n_per_year", "absent",
)  # fmt: skip
_HISTORY_COLUMNS = (
    "sensor", "campaign_id", "time", "time_is", "d33_pc_per_n", "d33_uncertainty_pc_per_n", "model", "model_id",
)  # fmt: skip
ByQuery = Annotated[By, Query(alias="model")]


def map_rows(
    row: AnyRow, answer: Mapping[str, Any] | None, history: History, places: Sequence[Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """A row per sensor in `places`, with its trend if known: from the answer of a campaign, or else its last value
    in `history` with the date (`absent`), or else without a value."""
    answered = {} if answer is None else {sensor["sensor"]: sensor for sensor in sensors_of(row, answer)}
    histories = {sensor_history.sensor: sensor_history for sensor_history in history.sensors}
    rows = []
    for position in places:
        name = position["id"]
        of_sensor = histories.get(name)
        its = answered.get(name) or _last_value(of_sensor)
        trend: dict[str, Any] = {"no_trend": "never measured with FRFs" if of_sensor is None else of_sensor.no_trend}
        if of_sensor is not None and of_sensor.trend is not None:
            trend = _trend(of_sensor.trend, len(of_sensor.points))
        rows.append({"sensor": name, "x_mm": position["x_mm"], "y_mm": position["y_mm"], "absent": "", **its, **trend})
    return rows


def _last_value(of_sensor: SensorHistory | None) -> dict[str, Any]:
    """The last value of a sensor that the latest campaign did not measure."""
    if of_sensor is None or not of_sensor.points:
        return {"reasons": "", "absent": "never measured with FRFs"}
    point = of_sensor.points[-1]
    half = SDS_OF_95 * point.d33_uncertainty_pc_per_n
    return {
        "d33_pc_per_n": point.d33_pc_per_n,
        "d33_uncertainty_pc_per_n": point.d33_uncertainty_pc_per_n,
        "d33_low_pc_per_n": point.d33_pc_per_n - half,
        "d33_high_pc_per_n": point.d33_pc_per_n + half,
        "reasons": "",
        "absent": f"last measured on {_day(point.time)}",
    }


def _day(time: str) -> str:
    """The day of a time of the store in the lab's zone, as the axis of a history has it."""
    return in_lab(datetime.fromisoformat(time)).strftime("%d %b %Y")


def _trend(line: TrendAnswer, count: int) -> dict[str, Any]:
    low, high = interval(line.slope_pc_per_n_per_year, line.slope_uncertainty_pc_per_n_per_year, count)
    return {**line.model_dump(), "slope_low_pc_per_n_per_year": low, "slope_high_pc_per_n_per_year": high}


def drawn_map(
    root: str, row: AnyRow, rows: Sequence[Mapping[str, Any]], show: Shown, by: By, sensor: str | None
) -> Drawn:
    """The sensors of `map_rows` at their positions, one of them chosen; `row`: the campaign of the answer."""
    value, uncertainty, name, unit, against = _QUANTITIES[show]
    # With few campaigns a slope's uncertainty is smaller than Student's t allows, so its own test decides.
    significant = tuple(row.get("significant", False) for row in rows) if show == "trend" else None
    ends = _ENDS.get(show)
    intervals = None if ends is None else tuple((row.get(ends[0]), row.get(ends[1])) for row in rows)
    quantity = Quantity(name, unit, against, differing=significant, intervals=intervals)
    names, x_mm, y_mm, reasons = columns_of(rows, "sensor", "x_mm", "y_mm", "reasons")
    radius = row.about["skin"].get("sensor_radius_mm")
    values, uncertainties = columns_of(rows, value, uncertainty)
    # A trend is of all campaigns, whichever measured a sensor last.
    absent = ["" if show == "trend" else row["absent"] for row in rows]
    figure = array_map(names, x_mm, y_mm, values, uncertainties, reasons, quantity, sensor, radius, absent)
    compared = [math.nan if away else shown_value for away, shown_value in zip(absent, values, strict=True)]
    about = (
        f"Each sensor where it lies, coloured by {name}, in {row.name}, the latest campaign with FRFs, {RESTS[by]}. "
    )
    measured = sum(not row["absent"] for row in rows)
    about += f"It tells of {measured} of the {len(rows)} sensors. " if measured < len(rows) else ""
    about += "The hollow ones stand at their last value, with its date under the pointer. " if any(absent) else ""
    about += f"{disc_size(x_mm, y_mm, radius)} {significance_note(compared, uncertainties, quantity)} "
    about += _trends_of_single_sensors(rows) + _without_trend(rows) if show == "trend" else ""
    return drawn("map", figure, about + CLICK, f"/skins/{quote(root, safe='')}/map.csv?model={by}")


def _without_trend(rows: Sequence[Mapping[str, Any]]) -> str:
    """How many sensors have no trend, and the most frequent reason."""
    reasons = Counter(row["no_trend"] for row in rows if row.get("no_trend"))
    if not reasons:
        return ""
    (most, count), of = reasons.most_common(1)[0], reasons.total()
    have = "sensor has" if of == 1 else "sensors have"
    return f"{of} {have} no trend, {'' if count == of else f'{count} of them since '}{most}. "


def _trends_of_single_sensors(rows: Sequence[Mapping[str, Any]]) -> str:
    """Which sensors have a trend by their own interval but not by the test over the whole array: few campaigns of
    many sensors hardly show any."""
    low, high = _ENDS["trend"]
    names = [
        row["sensor"] for row in rows if not row.get("significant", False) and row.get(low, 0) * row.get(high, 0) > 0
    ]
    if not names:
        return ""
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return (
        f"Taken alone, {', '.join(names[:_MOST_NAMED])}{more} would have a trend (95 %), as one sensor in twenty has "
        "by chance: more campaigns tell which, and Compare shows what differs between two. "
    )


@router.get("")
def skin(
    request: Request,
    skin_id: SkinId,
    store: Store,
    table: Table,
    show: Shown = "d33",
    sensor: str | None = None,
    before: str | None = None,
    by: Annotated[By | None, Query(alias="model")] = None,
    refused: Refused = None,
) -> Response:
    """The page of a skin. `sensor`: the one whose FRFs and history are drawn; `by`: the model of d33, by default the
    one in force, or the paper's if that has no d33 of the latest campaign with FRFs."""
    root, waiting, computed = _completed(store, table, skin_id)
    with store.reading() as connection:
        rows = campaigns.by_time(connection, root, number_of_cursor(before), _ON_A_PAGE + 1)
        last = campaigns.describing(connection, root)
        is_latest = last is None or campaigns.latest(connection, root) == last
        numbers = [row.number for row in rows]
        medians = overview.medians(connection, numbers, table.sha256)
        measured = overview.measured_sensors(connection, numbers, table.sha256)
        diagnosed = overview.latest_diagnoses(connection, numbers if last is None else [*numbers, last.number])
        about = skins.find(connection, root)
        changed = changes.of_skin(connection, root)
        used = annotations.in_use(connection, root)
        places = usecase.sensors(connection, root)
        mark = overview.mark(connection, root, table.sha256)
        together = [row for kind in _SEVERAL for row in _latest(connection, root, kind)]
        may_be_together = diagnosed_together.count_usable(connection, root) > 1
        model_row = models.last(connection, root)
        last_model = None if model_row is None else adopted_versions(connection, [model_row])[0]
        model = last_model if last_model is not None and last_model.withdrawn_at is None else None
        adopted = [] if model is None else [model.diagnosis_id]
        verdict = verdicts.of_rows(connection, list(diagnosed.values()), adopted)
        of_several = verdicts.of_rows(connection, together)
        verdict_of = {number: verdict[row.id] for number, row in diagnosed.items()}
    serves = model is not None and model.outdated is None
    answer = None if last is None else d33_cache.answer(store, table, last, None)
    by_model, why_not = (None, None) if last is None or not serves else answer_by_it(store, table, last)
    by = (by or ("paper" if by_model is None else "adopted")) if serves else "paper"
    history = usecase.history_by_model(store, table, root, by, computed)
    sensor = sensor if sensor in {sensor_history.sensor for sensor_history in history.sensors} else None
    mapped = by_model if by == "adopted" else answer
    figures = []
    if last is not None and (history.sensors or (mapped is not None and mapped["sensors"])):
        figures.append(drawn_map(root, last, map_rows(last, mapped, history, places), show, by, sensor))
    if history.sensors:
        figures.append(drawn_history(root, history, sensor, by))
    chosen = {"show": show, **({"model": by} if serves else {}), **({} if sensor is None else {"sensor": sensor})}
    shown_of = None if sensor is None or last is None else _measured_last(store, last, answer, history, sensor)
    frfs = [] if sensor is None or shown_of is None else _frfs(store, table, shown_of, sensor)
    path = f"/v1/skins/{quote(root, safe='')}"
    made = page(
        request,
        "skin.html",
        status=200 if refused is None else refused.status,
        refused=refused,
        about=about,
        changes=changed,
        may_be_discarded=about is not None and about.discarded_at is None and not used,
        skin_id=root,
        last=last,
        answer=answer,
        is_latest=is_latest,
        attention=attention(answer, last, dead=[] if history.array is None else list(history.array.dead_since)),
        of_last=None if last is None else verdict_of.get(last.number),
        described=None if last is None else last.about["skin"],
        rows=[
            (row, campaigns.state(row), medians.get(row.number), verdict_of.get(row.number))
            for row in rows[:_ON_A_PAGE]
        ],
        measured=measured,
        diagnosed_together=list(of_several.values()),
        may_be_together=may_be_together,
        latest=None if before is None else urlencode(chosen),
        earlier=urlencode({"before": rows[_ON_A_PAGE - 1].number, **chosen}) if len(rows) > _ON_A_PAGE else None,
        history=history,
        model=model,
        withdrawn=last_model if model is None else None,
        by_model=by_model,
        why_not=why_not,
        change=change_percent(overview.of_array(answer), overview.of_array(by_model)),
        by=by,
        of_sensor=_of_sensor(history, sensor),
        figures=figures,
        frfs=frfs,
        shown_of=shown_of,
        sensors=len(places),
        show=show,
        sensor=sensor,
        waiting=waiting,
        mark=mark,
        same=same_request.get(
            request,
            f"{path}/history" + ("?model=adopted" if by == "adopted" else ""),
            f"client.skins.history({root!r}" + (", model='adopted')" if by == "adopted" else ")"),
        ),
    )
    if waiting:
        made.background = BackgroundTask(d33_cache.complete, store, table, root)
    return made


def _measured_last(
    store: Database, last: AnyRow, answer: Mapping[str, Any] | None, history: History, sensor: str
) -> AnyRow:
    """The campaign that describes the skin if it measured the sensor, else the last one that did."""
    measured_sensors = [] if answer is None else [measured["sensor"] for measured in answer["sensors"]]
    points = [
        point
        for sensor_history in history.sensors
        if sensor_history.sensor == sensor
        for point in sensor_history.points
    ]
    return last if sensor in measured_sensors or not points else store.read(campaigns.find, points[-1].campaign_id)


def _frfs(store: Database, table: SigmaTable, row: AnyRow, sensor: str) -> list[Drawn]:
    """Those of a sensor in a campaign, unless it has none."""
    loaded = partial(store.read, campaigns.load, row, with_excluded=False)
    answer = d33_cache.answer(store, table, row, None)
    return [
        replace(figure, title=f"FRF of {sensor} in {row.name[:80]}")
        for figure in drawn_frf(row, loaded, answer, None, sensor)
    ]


def _of_sensor(history: History, sensor: str | None) -> dict[str, float]:
    """d33 [pC/N] of a sensor in each campaign, by the campaign's id."""
    chosen = [sensor_history for sensor_history in history.sensors if sensor_history.sensor == sensor]
    return {point.campaign_id: point.d33_pc_per_n for sensor_history in chosen for point in sensor_history.points}


def _latest(connection: Connection, root: str, kind: DiagnosisKind) -> Sequence[AnyRow]:
    return diagnoses.listed(connection, diagnoses.DiagnosisFilters(skin=root, kind=kind), None, _MOST_TOGETHER)


@router.get("/mark")
def mark(skin_id: SkinId, store: Store, table: Table) -> dict[str, str]:
    """A text that changes whenever anything on the page has changed."""
    with store.reading() as connection:
        return {"mark": overview.mark(connection, skins.require_root(connection, skin_id), table.sha256)}


@downloadable(router, "/map")
def map_csv(skin_id: SkinId, store: Store, table: Table, by: ByQuery = "paper") -> Numbers:
    """d33 of each sensor in the latest campaign with FRFs, or its last value and since when that stands (`absent`), and
    its trend."""
    root, _, computed = _completed(store, table, skin_id)
    history = usecase.history_by_model(store, table, root, by, computed)
    row = store.read(campaigns.describing, root)
    if row is None:
        return numbers_of_rows(file_name(root, "map"), _MAP_COLUMNS, [])
    places = store.read(usecase.sensors, root)
    rows = map_rows(row, d33_cache.by_model(store, table, row, by), history, places)
    return numbers_of_rows(file_name(root, "map"), _MAP_COLUMNS, rows)


@downloadable(router, "/history")
def history_csv(skin_id: SkinId, store: Store, table: Table, by: ByQuery = "paper") -> Numbers:
    """d33 of every sensor in every current campaign, and the model that each value rests on."""
    root, _, computed = _completed(store, table, skin_id)
    points = [
        {"sensor": sensor_history.sensor, **point.model_dump(), "model_id": point.model_id or ""}
        for sensor_history in usecase.history_by_model(store, table, root, by, computed).sensors
        for point in sensor_history.points
    ]
    return numbers_of_rows(file_name(root, "history"), _HISTORY_COLUMNS, points)


def _completed(store: Database, table: SigmaTable, skin_id: str) -> tuple[str, int, dict[str, dict[str, Any]]]:
    """The skin's root id, the number of campaigns whose d33 is still to be computed, and the answers computed now (a
    few at a time), by campaign id."""
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        missing = len(inversions.missing_of_skin(connection, root, table.sha256))
    if 0 < missing <= _AT_ONCE:
        return root, 0, d33_cache.complete(store, table, root)
    return root, missing, {}
