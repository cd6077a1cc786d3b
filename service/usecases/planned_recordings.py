"""The recordings of a plan: how many have arrived, and each one's rig description (`rig/1`)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import orjson
from sqlalchemy import Connection, select

from service.store import AnyRow, skins
from service.store.campaigns import CURRENT
from service.store.tables import campaigns, recordings
from underskin.recordings.rig_description import SCHEMA
from underskin.units import Floats

# Relative difference up to which a condition is the planned one.
_ALIKE = {"indenter_radius_mm": 0.01, "preload_n": 0.05, "dynamic_force_n": 0.1, "dwell_s": 0.1}
_NEAR_MM = 0.1
_NOT_INHERITED = ("position_mm", "dwell_s")  # conditions that no other recording hands on
_COLUMNS = ("frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n")
_OF_SKIN = ("thickness_mm", "youngs_modulus_mpa", "poisson_ratio", "sensor_radius_mm", "sensors")


def arrived(connection: Connection, diagnosis: AnyRow, planned: Sequence[Mapping[str, Any]]) -> list[int]:
    """How many of each planned recording arrived for the skin since it was diagnosed, at most `repeats`; each
    recording in use counts once."""
    root = skins.require_root(connection, diagnosis.skin_id)
    since = campaigns.c.skin_id.in_(skins.members(root)) & CURRENT & (campaigns.c.received_at > diagnosis.asked_at)
    diagnosed = select(campaigns.c.about).where(campaigns.c.id == diagnosis.campaign_id)
    sensor_places = _places(connection.execute(diagnosed).scalar_one())
    places = {row.number: _places(row.about) for row in connection.execute(select(campaigns).where(since))}
    query = select(recordings.c.campaign, recordings.c.scalars).where(recordings.c.campaign.in_(places))
    query = query.where(recordings.c.excluded_at.is_(None), recordings.c.kind == "frf")
    counts = [0] * len(planned)
    for number, recorded in connection.execute(query.order_by(recordings.c.campaign, recordings.c.position)):
        off_centre_mm = _off_centre_mm(recorded, places[number])
        for index, planned_recording in enumerate(planned):
            if (
                counts[index] == planned_recording["repeats"]
                or planned_recording["sensor"] not in sensor_places
                or not _is_planned(recorded, planned_recording)
            ):
                continue
            if np.hypot(*(off_centre_mm - _off_centre_mm(planned_recording, sensor_places))) <= _NEAR_MM:
                counts[index] += 1
                break
    return counts


def _places(about: Mapping[str, Any]) -> dict[str, list[float]]:
    """Where the sensors of a campaign lie, x and y [mm]."""
    return {sensor["id"]: [sensor["x_mm"], sensor["y_mm"]] for sensor in about["skin"].get("sensors", [])}


def _off_centre_mm(conditions: Mapping[str, Any], places: Mapping[str, list[float]]) -> Floats:
    """Offset of the sphere from the sensor's position, x and y [mm]; 0 if no position is given."""
    sensor_position = places[conditions["sensor"]]
    return np.subtract(conditions.get("position_mm") or sensor_position, sensor_position)


def _is_planned(recorded: Mapping[str, Any], planned: Mapping[str, Any]) -> bool:
    """Of the right sensor, under the planned conditions."""
    return recorded["sensor"] == planned["sensor"] and all(
        np.isclose(recorded.get(name, np.nan), planned[name], rtol=tolerance, atol=0)
        for name, tolerance in _ALIKE.items()
        if name in planned
    )


def rig_description(connection: Connection, row: AnyRow, planned: Mapping[str, Any]) -> dict[str, Any]:
    """The rig description for a file of one planned recording: channels as in the skin's own rig description of
    FRFs, or else named as the fields. `row`: the diagnosed campaign."""
    stored = skins.rig_of(connection, row.skin_id)
    document: dict[str, Any] = {} if stored is None else orjson.loads(stored)
    if document.get("kind", "frf") != "frf":
        document = {"skin": document.get("skin", {})}  # its channels and conditions are those of curves
    described = {name: row.about["skin"][name] for name in _OF_SKIN if row.about["skin"].get(name) is not None}
    conditions = {name: value for name, value in planned.items() if name != "repeats" and value not in (None, [])}
    common = {name: value for name, value in document.get("recording", {}).items() if name not in _NOT_INHERITED}
    return {
        "schema": SCHEMA,
        "kind": "frf",
        **{name: value for name, value in document.items() if name != "name"},
        "skin": {**document.get("skin", {}), **described},
        "recording": {**common, **conditions},
        "channels": document.get("channels") or {name: {"channel": name} for name in _COLUMNS},
    }
