"""What sensors answer to contacts that all miss their places by the same vector, by the base model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.mechanisms.models.composed import compose
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.conditions import Conditions, SkinDescription
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats


@dataclass(frozen=True, eq=False)
class DisplacedResponse:
    """|FRF| of the base model [C/N] and how steep it is [C/N/mm] (displacements, recordings)."""

    value: Floats
    slope: Floats


def displaced_response(
    skin: SkinDescription,
    entries: Sequence[FrfRecording],
    sensors: Sequence[str],
    displacement_mm: Floats,
    table: SigmaTable,
) -> DisplacedResponse:
    """The response of one sensor to each recording's contact.

    Parameters
    ----------
    skin
        The array.
    entries
        The recordings; a contact without a place is on the sensor that the recording names.
    sensors
        (recordings,) the sensor that is to answer to each.
    displacement_mm
        (displacements, 2) by how much all contacts miss their places.
    table
        The σ table.
    """
    places = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in skin.sensors}
    contacts = tuple(
        entry.without_measurements(
            frequency_hz=np.ones(1), sensor=sensor, position_mm=_moved(entry.position_mm or places[entry.sensor], by)
        )
        for by in displacement_mm
        for entry, sensor in zip(entries, sensors, strict=True)
    )
    model = compose((), Conditions("contacts", skin, contacts), table, "frf")
    prediction = model.predict(np.array([parameter.start for parameter in model.parameters]))
    assert prediction.position_slopes is not None
    shape = len(displacement_mm), len(entries)
    slope = 1e-3 * np.hypot(*np.abs(prediction.position_slopes))
    return DisplacedResponse(*(np.nan_to_num(part).reshape(shape) for part in (np.abs(prediction.value), slope)))


def _moved(place: tuple[float, float], by: Floats) -> tuple[float, float]:
    return place[0] + float(by[0]), place[1] + float(by[1])
