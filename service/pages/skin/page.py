"""A skin: its array as a map, its sensors over time, its campaigns."""

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Annotated, Any, Literal
from urllib.parse import quote

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from starlette.background import BackgroundTask

from service.dependencies import WRITE, SkinId, Store, Table, number_of_cursor, sender
from service.pages.shared import same_request, verdicts
from service.pages.shared.adoption import answer_by_it, change_percent, of_rows
from service.pages.shared.figures import Drawn, csv_of_rows, drawn
from service.pages.shared.forms import Form, reason, see
from service.pages.shared.html import page
from service.schemas.skins import History, SensorHistory
from service.store import AnyRow, Database, campaigns, inversions, models, overview, skins
from service.usecases import d33_cache, histories
from service.usecases.adopted_models import model_in_force
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/skins/{skin_id}")

_ON_A_PAGE = 50
_MOST_POINTS = 600  # of a history that shows each sensor
_AT_ONCE = 2  # campaigns whose d33 a page waits for

Shown = Literal["d33", "uncertainty", "trend"]
By = Literal["paper", "adopted"]


@router.get("")
def skin(
    request: Request,
    skin_id: SkinId,
    store: Store,
    table: Table,
    show: Annotated[Shown, Query()] = "d33",
    sensor: Annotated[str | None, Query()] = None,
    before: Annotated[str | None, Query()] = None,
    by: Annotated[By | None, Query(alias="model")] = None,
) -> Response:
    """All at a glance; `sensor` picks the one whose history is drawn, `by` the model that it rests on: without it the
    one in force, or the paper's where that tells nothing of the latest campaign."""
    root, waiting = _completed(store, table, skin_id)
    with store.reading() as connection:
        filters = campaigns.CampaignFilters(skin=root, state=None)
        rows = campaigns.listed(connection, filters, number_of_cursor(before), _ON_A_PAGE + 1)
        last = campaigns.latest(connection, root)
        numbers = [row.number for row in rows]
        medians = overview.medians(connection, numbers, table.sha256)
        diagnosed = overview.latest_diagnoses(connection, numbers)
        model_row = models.last(connection, root)
        last_model = None if model_row is None else of_rows(connection, [model_row])[0]
        model = last_model if last_model is not None and last_model.withdrawn_at is None else None
        adopted = [] if model is None else [model.diagnosis_id]
        verdict = verdicts.of_rows(connection, list(diagnosed.values()), adopted)
        verdict_of = {number: verdict[row.id] for number, row in diagnosed.items()}
    serves = model is not None and model.outdated is None
    answer = None if last is None else d33_cache.answer(store, table, last, None)
    by_model, why_not = (None, None) if last is None or not serves else answer_by_it(store, table, root, last)
    by = (by or ("paper" if by_model is None else "adopted")) if serves else "paper"
    history = _history_by(store, table, root, by)
    sensor = sensor if sensor in {entry.sensor for entry in history.sensors} else None
    mapped = by_model if by == "adopted" else answer
    figures = []
    if last is not None and mapped is not None and mapped["sensors"]:
        figures.append(_map(root, last, mapped, history, show, by))
    if history.sensors:
        figures.append(_history(root, history, sensor, by))
    path = f"/v1/skins/{quote(root, safe='')}"
    made = page(
        request,
        "skin.html",
        skin_id=root,
        last=last,
        answer=answer,
        described=None if last is None else last.about["skin"],
        rows=[
            (row, campaigns.state(row), medians.get(row.number), verdict_of.get(row.number))
            for row in rows[:_ON_A_PAGE]
        ],
        following=rows[_ON_A_PAGE - 1].number if len(rows) > _ON_A_PAGE else None,
        history=history,
        model=model,
        withdrawn=last_model if model is None else None,
        by_model=by_model,
        why_not=why_not,
        change=None if by_model is None or answer is None else change_percent(_array(answer), _array(by_model)),
        by=by,
        figures=figures,
        show=show,
        sensor=sensor,
        waiting=waiting,
        same=same_request.get(
            request,
            f"{path}/history" + ("?model=adopted" if by == "adopted" else ""),
            f"client.skins.history({root!r}" + (", model='adopted')" if by == "adopted" else ")"),
        ),
    )
    if waiting:
        made.background = BackgroundTask(d33_cache.complete, store, table, root)
    return made


@router.post("/model/withdraw", dependencies=WRITE)
def withdraw_model(request: Request, skin_id: SkinId, sent: Form, store: Store) -> Response:
    """Has no model in force."""
    with store.writing() as connection:
        root = skins.require_root(connection, skin_id)
        models.withdraw(connection, root, reason(sent), sender(request))
    return see(f"/skins/{quote(root, safe='')}")


@router.get("/map.csv")
def map_csv(skin_id: SkinId, store: Store, table: Table, by: Annotated[By, Query(alias="model")] = "paper") -> Response:
    """d33 of each sensor in the latest campaign, and its trend."""
    root, _ = _completed(store, table, skin_id)
    trends = {entry.sensor: entry.trend for entry in _history_by(store, table, root, by).sensors}
    with store.reading() as connection:
        row = campaigns.latest(connection, root)
    rows: list[dict[str, Any]] = []
    if row is not None:
        answer = (
            d33_cache.answer(store, table, row, None)
            if by == "paper"
            else d33_cache.adopted_answer(store, table, row, model_in_force(store, root), None)
        )
        places = {entry["id"]: entry for entry in row.about["skin"]["sensors"]}
        for entry in answer["sensors"]:
            line = trends.get(entry["sensor"])
            rows.append({**entry, **places[entry["sensor"]], **({} if line is None else line.model_dump())})
    return csv_of_rows("map", (*_MAP_COLUMNS, *_TREND_COLUMNS), rows)


_MAP_COLUMNS = (
    "sensor", "x_mm", "y_mm", "d33_pc_per_n", "d33_uncertainty_pc_per_n", "d33_low_pc_per_n", "d33_high_pc_per_n",
)  # fmt: skip
_HISTORY_COLUMNS = (
    "sensor", "campaign_id", "time", "time_is", "d33_pc_per_n", "d33_uncertainty_pc_per_n", "model", "model_id",
)  # fmt: skip
_TREND_COLUMNS = ("slope_pc_per_n_per_year", "slope_uncertainty_pc_per_n_per_year")


@router.get("/history.csv")
def history_csv(
    skin_id: SkinId, store: Store, table: Table, by: Annotated[By, Query(alias="model")] = "paper"
) -> Response:
    """d33 of every sensor in every current campaign, and the model that each value rests on."""
    root, _ = _completed(store, table, skin_id)
    history = _history_by(store, table, root, by)
    points = [
        {"sensor": entry.sensor, **point.model_dump(), "model_id": point.model_id or ""}
        for entry in history.sensors
        for point in entry.points
    ]
    return csv_of_rows("history", _HISTORY_COLUMNS, points)


def _array(answer: Mapping[str, Any]) -> float | None:
    return None if answer["array"] is None else answer["array"]["d33_pc_per_n"]


def _completed(store: Database, table: SigmaTable, skin_id: str) -> tuple[str, int]:
    """The skin's own id, and of how many campaigns d33 is still to be computed; a few are computed at once."""
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        missing = len(inversions.missing_of_skin(connection, root, table.sha256))
    if 0 < missing <= _AT_ONCE:
        d33_cache.complete(store, table, root)
        return root, 0
    return root, missing


def _history_by(store: Database, table: SigmaTable, root: str, by: By) -> History:
    if by == "adopted":
        return histories.adopted_history(store, table, root)
    with store.reading() as connection:
        return histories.history(connection, root, table.sha256)


def _map(root: str, row: AnyRow, answer: Mapping[str, Any], history: History, show: Shown, by: By) -> Drawn:
    from underskin.figures.array import Quantity, array_map

    places = {entry["id"]: entry for entry in row.about["skin"]["sensors"]}
    entries = answer["sensors"]
    names = [entry["sensor"] for entry in entries]
    if show == "trend":
        trends = {entry.sensor: entry.trend for entry in history.sensors}
        lines = [trends.get(name) for name in names]
        values = [None if line is None else line.slope_pc_per_n_per_year for line in lines]
        uncertainties = [None if line is None else line.slope_uncertainty_pc_per_n_per_year for line in lines]
        quantity = Quantity("trend", "pC/N a year", diverging=True)
    else:
        uncertainties = [entry["d33_uncertainty_pc_per_n"] for entry in entries]
        values = uncertainties if show == "uncertainty" else [entry["d33_pc_per_n"] for entry in entries]
        quantity = Quantity("uncertainty of d33", "pC/N") if show == "uncertainty" else Quantity("d33", "pC/N")
    figure = array_map(
        names,
        [places[name]["x_mm"] for name in names],
        [places[name]["y_mm"] for name in names],
        np.array(values, dtype=float),
        np.array(uncertainties, dtype=float),
        ["; ".join(flag["reason"] for flag in entry["flags"]) for entry in entries],
        quantity,
    )
    about = f"Each sensor where it lies, coloured by {quantity.name}, in the latest campaign, {row.name}, "
    about += "by the adopted model." if by == "adopted" else "by the paper's model."
    known = [entry for entry in entries if entry["d33_pc_per_n"] is not None]
    if show == "d33" and known:
        about += f" {_range(known)}"
    return drawn("map", figure, about, f"/skins/{quote(root, safe='')}/map.csv?model={by}")


def _range(known: Sequence[Mapping[str, Any]]) -> str:
    """How far apart the ends of the colours are, and how sure each value is."""
    values = [entry["d33_pc_per_n"] for entry in known]
    each = median(entry["d33_uncertainty_pc_per_n"] for entry in known)
    return f"They go from {min(values):.3g} to {max(values):.3g} pC/N, each ± {each:.2g}."


def _history(root: str, history: History, sensor: str | None, by: By) -> Drawn:
    from underskin.figures.history import SensorPoints, array_history, d33_history

    numbers = f"/skins/{quote(root, safe='')}/history.csv?model={by}"
    rests = "by the adopted model" if by == "adopted" else "by the paper's model"
    chosen = [entry for entry in history.sensors if sensor in (None, entry.sensor)]
    if sum(len(entry.points) for entry in chosen) > _MOST_POINTS and sensor is None:
        by_time: dict[str, list[float]] = {}
        for entry in chosen:
            for point in entry.points:
                by_time.setdefault(point.time, []).append(point.d33_pc_per_n)
        times = sorted(by_time)
        levels = [[pick(by_time[time]) for time in times] for pick in (min, median, max)]
        about = f"Median d33 over the sensors in each campaign, {rests}, and the range from the lowest to the highest."
        return drawn("history", array_history(times, *levels), about, numbers)
    points = [
        SensorPoints(
            entry.sensor,
            [point.time for point in entry.points],
            [point.d33_pc_per_n for point in entry.points],
            [point.d33_uncertainty_pc_per_n for point in entry.points],
            trend_in_words(entry),
        )
        for entry in chosen
    ]
    about = f"d33 of each sensor in every campaign, {rests}, ± its uncertainty."
    return drawn("history", d33_history(points), about, numbers)


def trend_in_words(entry: SensorHistory) -> str:
    """What the sensor's d33 does over time."""
    line = entry.trend
    if line is None:
        return f"no trend: {entry.no_trend}"
    slope = f"{line.slope_pc_per_n_per_year:+.2g} ± {line.slope_uncertainty_pc_per_n_per_year:.1g} pC/N a year"
    return slope if line.significant else f"no significant trend ({slope})"
