"""A skin: its array as a map, its sensors over time, its campaigns; for a chosen sensor also its FRFs."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, Any
from urllib.parse import quote, urlencode

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy import Connection
from starlette.background import BackgroundTask

from service.dependencies import SkinId, Store, Table, number_of_cursor
from service.pages.shared import same_request, verdicts
from service.pages.shared.attention import attention
from service.pages.shared.figures import Drawn, csv_of_rows, file_name
from service.pages.shared.forms import RefusedForm
from service.pages.shared.frf import drawn_frf
from service.pages.shared.history import By, drawn_history
from service.pages.shared.html import page
from service.pages.shared.verdicts import adopted_versions, answer_by_it, change_percent
from service.pages.skin.figures import Shown, drawn_map, map_rows
from service.schemas.campaign_d33 import D33Value
from service.schemas.diagnoses import DiagnosisKind
from service.schemas.skins import History
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
    skin_changes,
    skins,
)
from service.usecases import changes, d33_cache
from service.usecases import skins as usecase
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/skins/{skin_id}")

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
) -> Response:
    """The page of a skin. `sensor`: the one whose FRFs and history are drawn; `by`: the model of d33, by default the
    one in force, or the paper's if that has no d33 of the latest campaign with FRFs."""
    return shown(request, skin_id, store, table, show, sensor, before, by)


def shown(
    request: Request,
    skin_id: str,
    store: Database,
    table: SigmaTable,
    show: Shown = "d33",
    sensor: str | None = None,
    before: str | None = None,
    by: By | None = None,
    refused: RefusedForm | None = None,
) -> Response:
    """The page; `refused`: a form of it that was sent and cannot be used."""
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
        mark = skin_changes.mark(connection, root, table.sha256)
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
        return {"mark": skin_changes.mark(connection, skins.require_root(connection, skin_id), table.sha256)}


@router.get("/map.csv")
def map_csv(skin_id: SkinId, store: Store, table: Table, by: ByQuery = "paper") -> Response:
    """d33 of each sensor in the latest campaign with FRFs, or its last value and since when that stands (`absent`), and
    its trend."""
    root, _, computed = _completed(store, table, skin_id)
    history = usecase.history_by_model(store, table, root, by, computed)
    row = store.read(campaigns.describing, root)
    if row is None:
        return csv_of_rows(file_name(root, "map"), _MAP_COLUMNS, [])
    places = store.read(usecase.sensors, root)
    rows = map_rows(row, d33_cache.by_model(store, table, row, by), history, places)
    return csv_of_rows(file_name(root, "map"), _MAP_COLUMNS, rows)


@router.get("/history.csv")
def history_csv(skin_id: SkinId, store: Store, table: Table, by: ByQuery = "paper") -> Response:
    """d33 of every sensor in every current campaign, and the model that each value rests on."""
    root, _, computed = _completed(store, table, skin_id)
    points = [
        {"sensor": sensor_history.sensor, **point.model_dump(), "model_id": point.model_id or ""}
        for sensor_history in usecase.history_by_model(store, table, root, by, computed).sensors
        for point in sensor_history.points
    ]
    return csv_of_rows(file_name(root, "history"), _HISTORY_COLUMNS, points)


def _completed(store: Database, table: SigmaTable, skin_id: str) -> tuple[str, int, dict[str, dict[str, Any]]]:
    """The skin's root id, the number of campaigns whose d33 is still to be computed, and the answers computed now (a
    few at a time), by campaign id."""
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        missing = len(inversions.missing_of_skin(connection, root, table.sha256))
    if 0 < missing <= _AT_ONCE:
        return root, 0, d33_cache.complete(store, table, root)
    return root, missing, {}
