"""Figures: every sensor and recording is in them, in lab units, told apart by more than colour."""

import numpy as np
import pytest

from underskin.diagnosis.reporting.page_styles import PAPER
from underskin.errors import InvalidInput
from underskin.figures.array import frf_versus_preload, response_per_sensor
from underskin.figures.curves import ForceCurve, force_curves
from underskin.figures.frf import frf_recordings
from underskin.figures.history import SensorPoints, d33_history
from underskin.figures.traces import raw_traces
from underskin.recordings.channels import Channel
from underskin.recordings.frf.thinned_lines import FrfLines

SDS_OF_95 = 1.959963984540054  # half the width of a 95 % interval of a normal distribution

SENSORS = ("s1", "s2", "s3")
D33 = np.array([14.0, 15.0, 3.0])
REASONS = ("", "", "weak: 21 % of the array's median")


def test_frf_against_preload_has_points_and_a_line_for_each_indenter() -> None:
    radius, preload = np.array([4.0, 4.0, 10.0, 10.0, 4.0]), np.array([1.0, 0.5, 0.5, 1.0, 1.0])
    frf = np.array([6.0, 6.2, 7.0, 6.9, 6.1])
    figure = frf_versus_preload(("a", "b", "c", "d", "e"), radius, preload, frf, 0.1 * frf, frf + 0.05)
    points = {trace.name: trace for trace in figure.data}
    assert set(points) == {"R 4 mm, measured", "R 4 mm, model", "R 10 mm, measured", "R 10 mm, model"}
    assert sorted(points["R 4 mm, measured"].y) == [6.0, 6.1, 6.2]
    assert list(points["R 4 mm, model"].x) == [0.5, 1.0]
    assert points["R 4 mm, measured"].marker.symbol != points["R 10 mm, measured"].marker.symbol
    assert points["R 4 mm, measured"].marker.color != points["R 10 mm, measured"].marker.color
    assert {points[f"R {size} mm, model"].line.dash for size in (4, 10)} == {PAPER}
    assert points["R 4 mm, model"].line.color == points["R 4 mm, measured"].marker.color
    np.testing.assert_allclose(points["R 4 mm, measured"].error_y.array, SDS_OF_95 * 0.1 * points["R 4 mm, measured"].y)


def test_the_response_of_each_sensor_has_its_interval_and_the_arrays() -> None:
    figure = response_per_sensor(SENSORS, D33, D33 - 1, D33 + 2, (13.5, 14.5), REASONS)
    assert [name for trace in figure.data for name in trace.x] == list(SENSORS)
    np.testing.assert_allclose(figure.data[0].error_y.array, 2)
    np.testing.assert_allclose(figure.data[0].error_y.arrayminus, 1)
    band = figure.layout.shapes[0]
    assert (band.y0, band.y1) == (13.5, 14.5)
    ringed = response_per_sensor(SENSORS, D33, D33 - 1, D33 + 2, None, REASONS, "s2").data[0]
    assert list(ringed.ids) == ["s1", "s2"]
    assert ringed.marker.line.width[1] > ringed.marker.line.width[0]
    assert figure.to_json()


def test_a_column_of_another_length_is_refused_by_name() -> None:
    with pytest.raises(InvalidInput, match="high_pc_per_n"):
        response_per_sensor(SENSORS, D33, D33, D33[:2], (1.0, 2.0), REASONS)


def test_a_raw_trace_of_many_samples_keeps_its_extremes() -> None:
    values = np.sin(np.arange(100_000) / 50)
    values[[4_321, 77_777]] = 9.0, -8.0
    figure = raw_traces([Channel("Load cell", "V", values), Channel("<b>", "", np.arange(5.0))], 1000.0)
    long, short = figure.data
    assert len(long.x) < 2_000
    assert dict(zip(long.x.tolist(), long.y.tolist(), strict=True))[4.321] == 9.0
    assert (long.y.max(), long.y.min()) == (9.0, -8.0)
    assert short.y.tolist() == [0, 1, 2, 3, 4]
    assert short.name == "&lt;b&gt;"
    assert "[V]" in figure.layout.yaxis.title.text
    assert "s: " in long.hovertemplate
    assert " V<extra>" in long.hovertemplate


def test_many_sensors_over_time_are_their_median_their_spread_and_those_that_stand_apart() -> None:
    random, times = np.random.default_rng(3), ("2026-05-03T09:00:00Z", "2026-07-03T09:00:00Z")
    d33 = 14.0 + 0.4 * random.normal(size=(60, 2))
    d33[17, 1], d33[[21, 20, 22, 23], 0] = 9.0, [20.0, 20.1, 20.2, 20.3]
    sensors = [SensorPoints(f"s{number:02}", times, own.tolist(), [0.2, 0.2], "") for number, own in enumerate(d33)]
    figure = d33_history(sensors)
    assert figure.layout.showlegend is False
    upper, lower, median, apart, every, pointed = figure.data
    assert (len(every.x), len(pointed.x)) == (120, 0)
    assert [value for sensor, value in zip(every.customdata, every.y, strict=True) if sensor == "s17"] == d33[
        17
    ].tolist()
    np.testing.assert_allclose(median.y, np.median(d33, axis=0))
    for number in range(2):
        inside = (d33[:, number] > lower.y[number]) & (d33[:, number] < upper.y[number])
        assert inside.sum() == 54  # 90 %
    written = dict(
        zip(apart.hovertext, zip(apart.text, apart.textposition, apart.x, apart.y, strict=True), strict=True)
    )
    assert written["s17"] == ("s17", "middle left", times[1], 9.0)  # within the axes, as the last of them
    assert written["s21"] == ("s20, s21, s22 and 1 more", "middle right", times[0], 20.0)  # as they lie too close
    assert [written[name][0] for name in ("s20", "s22", "s23")] == [""] * 3
    np.testing.assert_allclose(apart.error_y.array, 0.2 * SDS_OF_95)
    *_, chosen = d33_history(sensors, "s03").data
    assert (chosen.name, list(chosen.y)) == ("s03", d33[3].tolist())
    np.testing.assert_allclose(chosen.error_y.array, 0.2 * SDS_OF_95)
    (alone,) = d33_history(sensors[:5], "s03").data
    assert alone.name == "s03"
    few = d33_history(sensors[:5])
    assert [trace.name for trace in few.data] == [f"s0{number}" for number in range(5)]
    assert few.layout.showlegend is True


def test_measured_lines_are_solid_and_differ_however_many_they_are() -> None:
    count, lines = 12, np.array([1.0, 10.0])
    history = d33_history([SensorPoints(f"s{n}", ["2024-05-01T09:00:00Z"], [14.0], [0.1], "") for n in range(count)])
    recordings = frf_recordings([FrfLines(f"r{n}", lines, lines, 0 * lines, lines) for n in range(count)], None)
    curves = force_curves([ForceCurve(f"c{n}", lines, lines) for n in range(count)])
    for figure in (history, recordings, curves):
        drawn = [trace for trace in figure.data if trace.showlegend is not False]
        assert {trace.line.dash for trace in drawn} <= {None, "solid"}
        assert len({(trace.line.color, trace.mode, trace.marker.symbol) for trace in drawn}) == count
