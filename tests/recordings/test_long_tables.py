"""One row a line or sample: columns that say of which recording a row is."""

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import openpyxl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.campaign_documents import SKIN
from underskin.errors import FileError, InvalidInput
from underskin.recordings import Reading, read_file, rig_description
from underskin.recordings.campaign import FrfRecording, IndentationRecording

SENSORS = ("s01", "s02", "Ärmel 3")
PLACED = [{"id": sensor, "x_mm": 8.0 * number, "y_mm": 0} for number, sensor in enumerate(SENSORS)]
LINES = ((10.0, 7.0, -2.0), (20.0, 7.25, -4.5), (40.0, 7.5, -9.0))
HEADINGS = (
    "Sensor",
    "Time",
    "Sphere diameter [mm]",
    "Preload [mN]",
    "Room [°C]",
    "f [Hz]",
    "|H| [pC/N]",
    "Phase [deg]",
)
RIG: dict[str, Any] = {
    "schema": "rig/1",
    "kind": "frf",
    "skin": {**SKIN, "sensors": PLACED},
    "recording": {
        "sensor": {"channel": "Sensor"},
        "recorded_at": {"channel": "Time"},
        "indenter_radius_mm": {"channel": "radius"},
        "preload_n": {"channel": "Preload"},
        "dynamic_force_n": 0.05,
        "conditions": {"room_c": {"channel": "Room"}, "operator": "mb"},
        "position_mm": [{"channel": "x"}, {"channel": "y"}],
    },
    "derived": {"radius": "'Sphere diameter [mm]' / 2", "x": "2 * radius", "y": "-radius"},
    "channels": {
        "frequency_hz": {"channel": "f"},
        "frf_magnitude_pc_per_n": {"channel": "|H|"},
        "frf_phase_deg": {"channel": "Phase"},
    },
}
Condition = tuple[str, str, float, float, float]  # sensor, time, diameter [mm], preload [mN], room [°C]


def read(data: bytes, name: str = "glove.csv", **changes: Any) -> Reading:
    return read_file(data, name, rig_description.from_dict({**RIG, **changes}))


def written(rows: Sequence[Sequence[Any]], separator: str, decimal: str, headings: Sequence[str] = HEADINGS) -> bytes:
    cells = [[str(cell).replace(".", decimal) if isinstance(cell, float) else cell for cell in row] for row in rows]
    return "\r\n".join(separator.join(map(str, row)) for row in [headings, *cells]).encode()


@st.composite
def tables(draw: st.DrawFn) -> tuple[list[Condition], list[list[Any]]]:
    """Conditions of recordings, and the rows of all in some order."""
    when = st.sampled_from(["2026-05-04T09:00:00Z", "2026-05-04T09:04:00Z"])
    condition = st.tuples(
        st.sampled_from(SENSORS), when, st.sampled_from([8.0, 4.0]), st.sampled_from([250.0, 500.0]), st.just(21.5)
    )
    conditions = draw(st.lists(condition, min_size=1, max_size=6, unique=True))
    rows = [[*condition, *line] for condition in conditions for line in LINES]
    return conditions, draw(st.sampled_from([rows, [rows[i] for i in draw(st.permutations(range(len(rows))))]]))


def assert_are(reading: Reading, conditions: Sequence[Condition]) -> None:
    assert reading.problems == []
    recordings = {
        (
            recording.sensor,
            recording.recorded_at,
            2 * recording.indenter_radius_mm,
            1e3 * recording.preload_n,
            (recording.conditions or {})["room_c"],
        ): recording
        for recording in reading.campaign.of(FrfRecording)
    }
    assert recordings.keys() == set(conditions)
    for (_, _, diameter, *_), recording in recordings.items():
        assert recording.position_mm == (diameter, -diameter / 2)
        assert recording.conditions == {"room_c": 21.5, "operator": "mb"}
        frf = [size * np.exp(1j * np.radians(phase)) for _, size, phase in LINES]
        assert recording.frequency_hz == pytest.approx([hz for hz, *_ in LINES])
        assert recording.frf_re_pc_per_n == pytest.approx(np.real(frf))
        assert recording.frf_im_pc_per_n == pytest.approx(np.imag(frf))


@given(tables(), st.sampled_from([(",", "."), (";", ","), (";", "."), ("\t", ","), ("\t", ".")]))
def test_rows_with_the_same_conditions_are_a_recording(
    table: tuple[list[Condition], list[list[Any]]], style: tuple[str, str]
) -> None:
    """Sensor, time, sphere, preload and a condition of the lab's own come from columns, in any order of the rows."""
    conditions, rows = table
    assert_are(read(written(rows, *style)), conditions)


def test_a_sensor_that_is_written_once_is_that_of_each_preload_below() -> None:
    conditions: list[Condition] = [
        (sensor, "2026-05-04T09:00:00Z", 8.0, preload, 21.5) for sensor in SENSORS for preload in (250.0, 500.0)
    ]
    rows = [[*condition, *line] for condition in conditions for line in LINES]
    blanks = [["" if number % (2 * len(LINES)) else row[0], *row[1:]] for number, row in enumerate(rows)]
    assert_are(read(written(blanks, ";", ",")), conditions)


def test_a_workbook_of_rows() -> None:
    conditions: list[Condition] = [(sensor, "2026-05-04T09:00:00Z", 8.0, 250.0, 21.5) for sensor in SENSORS]
    book = openpyxl.Workbook()
    book.active.append(HEADINGS)
    for condition in conditions:
        for line in LINES:
            book.active.append([*condition, *line])
    stream = io.BytesIO()
    book.save(stream)
    assert_are(read(stream.getvalue(), "glove.xlsx"), conditions)


@pytest.mark.parametrize(
    ("headings", "recording", "message"),
    [
        (HEADINGS, {"preload_n": {"channel": "f"}}, r"column 'f': has 3 values in 6 rows, which makes 6 recordings"),
        (HEADINGS, {"sensor": {"channel": "Place"}}, r"it lacks Place"),
        ((*HEADINGS[:3], "Preload", *HEADINGS[4:]), {}, r"channel 'Preload': has no unit in the file"),
    ],
)
def test_columns_that_say_no_recording(headings: Sequence[str], recording: Mapping[str, Any], message: str) -> None:
    rows = [[sensor, "2026-05-04T09:00:00Z", 8.0, 250.0, 21.5, *line] for sensor in SENSORS[:2] for line in LINES]
    with pytest.raises(FileError, match=message):
        read(written(rows, ",", ".", headings), recording={**RIG["recording"], **recording})


@pytest.mark.parametrize(
    ("recording", "field"),
    [
        ({"preload_n": {"channel": "Preload", "sign": "auto"}}, "recording.preload_n.sign"),
        ({"preload_n": {"channel": "Preload", "sensitivity": 2}}, "recording.preload_n.sensitivity"),
        ({"conditions": {"room_c": {"chanel": "Room"}}}, "recording.conditions.room_c.chanel"),
        ({"position_mm": [{"channel": 5}, 0]}, r"recording.position_mm\[0\].channel"),
    ],
)
def test_wrong_columns_are_refused_by_field(recording: Mapping[str, Any], field: str) -> None:
    with pytest.raises(InvalidInput, match=field):
        rig_description.from_dict({**RIG, "recording": recording})


def test_curves_of_a_long_table() -> None:
    """Presses of an indenter in one table, told apart by a well that is a number."""
    rows = [[well, depth, well * depth**1.5] for depth in (0.0, 0.01, 0.02, 0.03) for well in (3.0, 5.0)]
    reading = read(
        written(rows, ";", ",", ("Well", "Depth [mm]", "Load [mN]")),
        kind="indentation",
        skin={"poisson_ratio": 0.5, "sensors": [{"id": well, "x_mm": 0, "y_mm": 0} for well in ("3", "5")]},
        recording={"indenter_radius_mm": 1, "sensor": {"channel": "Well"}},
        derived={},
        channels={"displacement_mm": {"channel": "Depth"}, "force_n": {"channel": "Load"}},
    )
    assert reading.problems == []
    curves = {recording.sensor: recording for recording in reading.campaign.of(IndentationRecording)}
    assert curves.keys() == {"3", "5"}
    for well, curve in curves.items():
        assert curve.displacement_mm == pytest.approx([0, 0.01, 0.02, 0.03])
        assert 1e3 * curve.force_n == pytest.approx(float(str(well)) * curve.displacement_mm**1.5)
