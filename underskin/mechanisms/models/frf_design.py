"""What the conditions of FRF recordings amount to for a model, worked out once: everything that no parameter changes.

Recordings share contacts (sphere, preload and what else a mechanism asks for), contacts at one place beside a sensor
are points, and a contact at one frequency is a line. Only these distinct ones are computed.
"""

from collections.abc import Collection
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from underskin.errors import required
from underskin.recordings.conditions import Conditions, FrfConditions, frf_of
from underskin.units import Floats, to_si

Indices = NDArray[np.intp]
NEIGHBOUR_PITCHES = 1.2


@dataclass(frozen=True, eq=False)
class FrfDesign:
    """Arrays over recordings, contacts, points, neighbours, lines and rows; SI."""

    sensor_ids: tuple[str, ...]
    sensor: Indices  # of each recording
    contact: Indices  # of each recording
    point: Indices  # of each recording: its contact beside its own sensor
    load_cycles: Floats  # of each recording, NaN where unknown
    force: Floats  # of each contact
    indenter_radius: Floats
    dynamic_force: Floats  # of each contact, where a mechanism asks; else 0
    dwell: Floats
    point_contact: Indices  # of each point
    point_x: Floats  # the contact's place, seen from the sensor's centre
    point_y: Floats
    neighbour_recording: Indices  # of each pair of a recording and a neighbour of its sensor
    neighbour_point: Indices
    line_contact: Indices  # of each distinct line
    line_frequency: Floats
    recording: Indices  # of each row
    line: Indices  # of each row
    row_dynamic_force: Floats
    row_frequency: Floats

    @classmethod
    @lru_cache(maxsize=8)  # by the conditions' identity: a diagnosis composes dozens of models of one campaign
    def of(cls, conditions: Conditions, fields: frozenset[str], neighbours: bool) -> "FrfDesign":
        """The design; `fields` may name what else tells contacts apart: "dwell_s", "dynamic_force_n"."""
        recordings = frf_of(conditions)
        sensor_ids = tuple(sensor.id for sensor in conditions.skin.sensors)
        number = {name: index for index, name in enumerate(sensor_ids)}
        places = to_si("thickness_mm", [(sensor.x_mm, sensor.y_mm) for sensor in conditions.skin.sensors])
        sensor = np.array([number[entry.sensor] for entry in recordings])
        position = np.array(
            [
                places[own] if entry.position_mm is None else to_si("thickness_mm", entry.position_mm)
                for own, entry in zip(sensor, recordings, strict=True)
            ]
        )
        keys = np.array([_contact_key(entry, fields) for entry in recordings])
        contacts, contact = np.unique(keys, axis=0, return_inverse=True)
        force, radius, dynamic_force, dwell = contacts.T
        pairs = _neighbours(places) if neighbours else np.zeros((len(places), len(places)), dtype=bool)
        pair_recording, other = np.nonzero(pairs[sensor])
        all_recordings = np.concatenate([np.arange(len(recordings)), pair_recording])
        beside = position[all_recordings] - places[np.concatenate([sensor, other])]
        points, point = np.unique(
            np.column_stack([contact[all_recordings], np.round(beside, 12)]), axis=0, return_inverse=True
        )
        lines_hz = [frequencies(entry) for entry in recordings]
        recording = np.repeat(np.arange(len(recordings)), [len(column) for column in lines_hz])
        row_frequency = np.concatenate(lines_hz)
        distinct, frequency = np.unique(row_frequency, return_inverse=True)
        lines, line = np.unique(contact[recording] * len(distinct) + frequency, return_inverse=True)
        return cls(
            sensor_ids=sensor_ids,
            sensor=sensor,
            contact=contact,
            point=point[: len(recordings)],
            load_cycles=np.array([np.nan if entry.load_cycles is None else entry.load_cycles for entry in recordings]),
            force=force,
            indenter_radius=radius,
            dynamic_force=dynamic_force,
            dwell=dwell,
            point_contact=points[:, 0].astype(np.intp),
            point_x=points[:, 1],
            point_y=points[:, 2],
            neighbour_recording=pair_recording,
            neighbour_point=point[len(recordings) :],
            line_contact=lines // len(distinct),
            line_frequency=distinct[lines % len(distinct)],
            recording=recording,
            line=line,
            row_dynamic_force=np.array([entry.dynamic_force_n for entry in recordings])[recording],
            row_frequency=row_frequency,
        )


def frf_design(conditions: Conditions, fields: Collection[str], *, neighbours: bool) -> FrfDesign:
    """`FrfDesign.of`, kept for the next model of the same conditions."""
    return FrfDesign.of(conditions, frozenset(fields) & {"dwell_s", "dynamic_force_n"}, neighbours)


def frequencies(entry: FrfConditions) -> Floats:
    """The lines of one FRF [Hz]; raises InvalidInput where they are yet to be estimated from a time series."""
    if entry.frequency_hz is None:
        raise required(f"recordings[{entry.id}].frequency_hz", "required for a prediction")
    return entry.frequency_hz


def _neighbours(places: Floats) -> NDArray[np.bool_]:
    """Which sensors (sensors, sensors) are within 1.2 pitches of which."""
    distance = cdist(places, places)
    np.fill_diagonal(distance, np.inf)
    near: NDArray[np.bool_] = distance <= NEIGHBOUR_PITCHES * distance.min()
    return near


def _contact_key(entry: FrfConditions, fields: Collection[str]) -> tuple[float, float, float, float]:
    dwell = entry.dwell_s if "dwell_s" in fields and entry.dwell_s is not None else 0.0
    dynamic_force = entry.dynamic_force_n if "dynamic_force_n" in fields else 0.0
    return entry.preload_n, float(to_si("indenter_radius_mm", entry.indenter_radius_mm)), dynamic_force, dwell


def largest_offset(design: FrfDesign, further: float) -> float:
    """The largest distance of a point's contact from its sensor's centre, plus `further` [m]."""
    return float(np.hypot(design.point_x, design.point_y).max()) + further
