"""Skins: described, joined if two ids mean one; d33 of their sensors over time, with trends and exclusions."""

from collections.abc import Collection, Mapping, Sequence
from datetime import datetime
from typing import Any, Literal

import numpy as np
import orjson
from sqlalchemy import Connection

from service.ingest import repeats
from service.problems import Refusal
from service.schemas import skins as models
from service.schemas.skins import SkinDetail
from service.store import AnyRow, Database, Missing, campaigns, inversions, skins
from service.usecases import adopted_models, changes, d33_cache
from underskin import InvalidInput
from underskin.errors import conflicting
from underskin.inversion.array_history import FEWEST, SIGNIFICANT, Trend, array_history, holm, trend
from underskin.surrogate.sigma_table import SigmaTable

_YEAR_S = 365.25 * 86400
_LEAST_SPAN_S = 86400.0
_DECLARED = ("thickness_mm", "youngs_modulus_mpa", "poisson_ratio", "sensor_radius_mm")  # of a skin as a whole
_SensorPoint = tuple[str, models.Point]


def join(store: Database, skin_id: str, other: str, reason: str, joined_from: str | None) -> None:
    """Count `other` as `skin_id` from now on; raises InvalidInput, Missing, or Refusal where one was joined before."""
    if skin_id == other:
        raise conflicting("skin_id", other, "must be another skin")
    with store.writing() as connection:
        rows = skins.lock(connection, [skin_id, other])
        for name in (skin_id, other):
            if name not in rows:
                raise Missing(f"There is no skin {name!r}.")
            if rows[name].root_id != name:
                raise Refusal(409, f"Skin {name!r} was joined to {rows[name].joined_to!r}: use {rows[name].root_id!r}.")
        skins.join(connection, skin_id, other, reason, joined_from)


def entry(row: AnyRow) -> models.SkinEntry:
    """A row of a list of skins."""
    tags = changes.words(row.tags)
    return models.SkinEntry(id=row.id, created_at=row.created_at, campaigns=row.campaigns, title=row.title, tags=tags)


def detail(connection: Connection, skin_id: str) -> SkinDetail:
    """A skin and those joined to it; of a joined one, the skin that it counts as. Raises Missing."""
    row = skins.find(connection, skins.require_root(connection, skin_id))
    assert row is not None
    rig = skins.rig_of(connection, row.id)
    joined_skins = skins.joined_to(connection, row.id)
    return SkinDetail(
        id=row.id,
        created_at=row.created_at,
        title=row.title,
        remark=row.remark,
        tags=changes.words(row.tags),
        discarded_at=row.discarded_at,
        joined=[joined(joined_skin) for joined_skin in joined_skins],
        differences=differences(connection, [row.id, *(joined_skin.id for joined_skin in joined_skins)]),
        rig=None if rig is None else orjson.loads(rig),
    )


def differences(connection: Connection, ids: Sequence[str]) -> list[str]:
    """Differences between the declarations of several skins by their campaigns, in words."""
    rows = {skin_id: campaigns.describing(connection, skin_id, alone=True) for skin_id in ids}
    declared = {skin_id: row.about["skin"] for skin_id, row in rows.items() if row is not None}
    messages = []
    for name in _DECLARED:
        values = {skin_id: skin[name] for skin_id, skin in declared.items() if skin.get(name) is not None}
        if len(set(values.values())) > 1:
            messages.append(
                f"{name} is " + " and ".join(f"{value:g} of {skin_id}" for skin_id, value in values.items())
            )
    return messages


def sensors(connection: Connection, root: str) -> list[Mapping[str, Any]]:
    """All sensors of a skin, each once, at the position given by the latest campaign in use that has it; first those
    of the campaign that describes the skin, which takes precedence."""
    describing = campaigns.describing(connection, root)
    if describing is None:
        return []
    current = [row for row in campaigns.of_skin(connection, root) if campaigns.state(row) == "current"]
    by_time = sorted(current, key=lambda row: (row.recorded_at or row.received_at, row.number), reverse=True)
    places: dict[str, Mapping[str, Any]] = {}
    for row in [describing, *by_time]:
        for sensor in row.about["skin"]["sensors"]:
            places.setdefault(sensor["id"], sensor)
    return list(places.values())


def history_by_model(
    store: Database,
    table: SigmaTable,
    root: str,
    model: Literal["paper", "adopted"],
    computed: Mapping[str, Mapping[str, Any]],
) -> models.History:
    """The history of a skin and of those joined to it; `computed`: answers that `d33_cache.complete` had to compute.
    Raises Refusal without an adopted model."""
    if model == "adopted":
        return _adopted_history(store, table, root)
    return store.read(_paper_history, root, table.sha256, computed)


def _paper_history(
    connection: Connection, root: str, table_sha256: str, computed: Mapping[str, Mapping[str, Any]]
) -> models.History:
    """From stored answers, and from computed ones that could not be stored."""
    rows = inversions.history(connection, root, table_sha256)
    points = [(row.sensor, _point(row, row.d33_pc_per_n, row.d33_uncertainty_pc_per_n, None)) for row in rows]
    for row in inversions.missing_of_skin(connection, root, table_sha256) if computed else []:
        of_sensors = d33_cache.of_sensors(computed[row.id]) if row.id in computed else {}
        points += [(sensor, _point(row, *values, None)) for sensor, values in of_sensors.items()]
    return _history(connection, root, points, {})


def _adopted_history(store: Database, table: SigmaTable, root: str) -> models.History:
    model_in_force = adopted_models.model_in_force(store, root)
    points: list[_SensorPoint] = []
    unfit: dict[str, str] = {}
    rows = [row for row in store.read(campaigns.of_skin, root) if campaigns.state(row) == "current"]
    for row in rows:
        try:
            answer = d33_cache.adopted_answer(store, table, row, model_in_force, None)
        except InvalidInput as error:
            unfit[row.id] = f"has no d33 by the adopted model: {error}"
            continue
        for sensor_answer in answer["sensors"]:
            value, uncertainty = sensor_answer["d33_pc_per_n"], sensor_answer["d33_uncertainty_pc_per_n"]
            if value is not None:
                points.append((sensor_answer["sensor"], _point(row, value, uncertainty, model_in_force.model_id)))
    return store.read(_history, root, points, unfit)


def _history(
    connection: Connection, root: str, points: Sequence[_SensorPoint], unfit: Mapping[str, str]
) -> models.History:
    repeated = repeats.left_out(connection, root, {(point.campaign_id, sensor) for sensor, point in points})
    by_sensor: dict[str, list[models.Point]] = {sensor: [] for sensor, _ in points}
    for sensor, point in sorted(points, key=lambda item: item[1].time):
        if (point.campaign_id, sensor) not in repeated:
            by_sensor[sensor].append(point)
    names = sorted(by_sensor)
    array, departures = _of_array({name: by_sensor[name] for name in names})
    used = {point.campaign_id for points in by_sensor.values() for point in points}
    campaigns_out, recordings_out = _excluded(connection, root, used, unfit, repeats.of_campaigns(repeated))
    joined_skins = skins.joined_to(connection, root)
    return models.History(
        skin_id=root,
        joined=[joined(row) for row in joined_skins],
        differences=differences(connection, [root, *(joined_skin.id for joined_skin in joined_skins)]),
        array=array,
        sensors=[
            models.SensorHistory(
                sensor=name,
                points=by_sensor[name],
                trend=line,
                no_trend=_no_trend(by_sensor[name]),
                departure=departures.get(name),
            )
            for name, line in zip(names, _trends([by_sensor[name] for name in names]), strict=True)
        ],
        left_out_campaigns=campaigns_out,
        left_out_points=[
            models.LeftOutPoint(campaign_id=campaign_id, sensor=sensor, repeats=repeat.campaign_id, reason=repeat.words)
            for (campaign_id, sensor), repeat in sorted(repeated.items())
            if campaign_id in used
        ],
        left_out_recordings=recordings_out,
    )


def joined(row: AnyRow) -> models.JoinedSkin:
    """A row of a skin that was joined to another."""
    return models.JoinedSkin(id=row.id, joined_to=row.joined_to, joined_at=row.joined_at, reason=row.join_reason)


def _point(row: AnyRow, d33: float, uncertainty: float, model_id: str | None) -> models.Point:
    return models.Point(
        campaign_id=row.id,
        time=row.recorded_at or row.received_at,
        time_is="received" if row.recorded_at is None else "recorded",
        model="paper" if model_id is None else "adopted",
        model_id=model_id,
        d33_pc_per_n=d33,
        d33_uncertainty_pc_per_n=uncertainty,
    )


def _of_array(
    by_sensor: Mapping[str, Sequence[models.Point]],
) -> tuple[models.ArrayTrend | None, dict[str, models.SensorDeparture]]:
    """The trend of the array, by the campaigns with a time of recording, and each sensor relative to it."""
    timed = [point for points in by_sensor.values() for point in points if point.time_is == "recorded"]
    campaigns_in = list({point.campaign_id: point.time for point in sorted(timed, key=_seconds)}.items())
    column = {campaign_id: number for number, (campaign_id, _) in enumerate(campaigns_in)}
    value, uncertainty = np.full((2, len(by_sensor), len(column)), np.nan)
    for row, points in enumerate(by_sensor.values()):
        for point in points:
            if point.time_is == "recorded":
                value[row, column[point.campaign_id]] = point.d33_pc_per_n
                uncertainty[row, column[point.campaign_id]] = point.d33_uncertainty_pc_per_n
    moments = [datetime.fromisoformat(time) for _, time in campaigns_in]
    history = array_history(list(by_sensor), moments, value, uncertainty)
    if history is None:
        return None, {}
    trend_of_array = models.ArrayTrend(
        points=[
            models.ArrayPoint(
                campaign_id=campaigns_in[number][0],
                time=campaigns_in[number][1],
                d33_pc_per_n=d33,
                d33_uncertainty_pc_per_n=of_d33,
            )
            for number, d33, of_d33 in zip(
                history.dates, history.d33.tolist(), history.uncertainty.tolist(), strict=True
            )
        ],
        sensors=list(history.pooled),
        days=history.days,
        **_percent(history.value, history.low, history.high),
        significant=history.significant,
        dead_since={sensor: campaigns_in[number][1] for sensor, number in history.dead_since.items()},
        statement=history.statement,
    )
    return trend_of_array, {
        departure.sensor: models.SensorDeparture(
            **_percent(departure.value, departure.low, departure.high), significant=departure.significant
        )
        for departure in history.departures
    }


def _percent(value: float, low: float, high: float) -> dict[str, Any]:
    names = ("change_percent", "change_low_percent", "change_high_percent")
    return {name: 100 * relative for name, relative in zip(names, (value, low, high), strict=True)}


def _trends(sensors: Sequence[Sequence[models.Point]]) -> list[models.TrendAnswer | None]:
    lines = [_line(points) if _no_trend(points) is None else None for points in sensors]
    adjusted = iter(holm([line.p_value for line in lines if line is not None]))
    return [None if line is None else _answer(line, next(adjusted)) for line in lines]


def _no_trend(points: Sequence[models.Point]) -> str | None:
    """Why these points, by time, have no trend."""
    arrived = sum(point.time_is == "received" for point in points)
    if len(points) < FEWEST:
        return f"a trend needs {FEWEST} campaigns, and there {'is' if len(points) == 1 else 'are'} {len(points)}"
    if arrived:
        return f"{arrived} of {len(points)} points are timed by arrival: their recordings have no recorded_at"
    if _seconds(points[-1]) - _seconds(points[0]) < _LEAST_SPAN_S:
        return "the points span less than a day"
    return None


def _seconds(point: models.Point) -> float:
    return datetime.fromisoformat(point.time).timestamp()


def _line(points: Sequence[models.Point]) -> Trend | None:
    return trend(
        [_seconds(point) / _YEAR_S for point in points],
        [point.d33_pc_per_n for point in points],
        [point.d33_uncertainty_pc_per_n for point in points],
    )


def _answer(line: Trend, adjusted: float) -> models.TrendAnswer:
    return models.TrendAnswer(
        slope_pc_per_n_per_year=line.slope,
        slope_uncertainty_pc_per_n_per_year=line.slope_uncertainty,
        p_value=line.p_value,
        p_value_adjusted=adjusted,
        significant=adjusted < SIGNIFICANT,
    )


def _excluded(
    connection: Connection,
    root: str,
    used: Collection[str],
    unfit: Mapping[str, str],
    repeated: Mapping[str, repeats.Repeat],
) -> tuple[list[models.LeftOutCampaign], list[models.LeftOutRecording]]:
    campaigns_out, recordings_out = [], []
    for row in campaigns.of_skin(connection, root):
        if row.discarded_at is not None:
            continue
        if row.id in repeated and row.id not in used:
            repeat = repeated[row.id]
            campaigns_out.append(
                models.LeftOutCampaign(campaign_id=row.id, reason=repeat.words, repeats=repeat.campaign_id)
            )
            continue
        no_d33 = None if row.id in used else "no d33 of it is kept; its /d33 says why"
        reason = unfit.get(row.id) or campaigns.unused(row) or no_d33
        if reason is not None:
            campaigns_out.append(models.LeftOutCampaign(campaign_id=row.id, reason=reason))
        elif row.excluded:
            recordings_out += [
                models.LeftOutRecording(campaign_id=row.id, recording=exclusion.recording, reason=exclusion.reason)
                for exclusion in campaigns.excluded_of(connection, row.number)
            ]
    return campaigns_out, recordings_out
