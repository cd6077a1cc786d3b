"""Figures: every sensor and recording is in them, in lab units, told apart by more than colour."""

import numpy as np
import plotly.graph_objects as go
import pytest

from underskin.diagnosis.reporting.page_styles import PAPER
from underskin.errors import InvalidInput
from underskin.figures.array import frf_versus_preload, response_per_sensor
from underskin.figures.curves import ForceCurve, force_curves
from underskin.figures.frf import frf_overview, frf_recordings
from underskin.figures.history import SensorPoints, d33_history
from underskin.figures.traces import raw_traces
from underskin.recordings.channels import Channel
from underskin.recordings.frf.thinned_lines import FrfLines, FrfSpread

SDS_OF_95 = 1.959963984540054  # half the width of a 95 % interval of a normal distribution

SENSORS = ("s1", "s2", "s3")
D33 = np.array([14.0, 15.0, 3.0])
REASONS = ("", "", "weak: 21 % of the array's median")


def test_frf_against_preload_points_line() -> None:
    """Frf against preload has points and a line for each indenter."""
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


def test_response_sensor_interval_arrays() -> None:
    """The response of each sensor has its interval and the arrays."""
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


def test_column_length_refused_name() -> None:
    """A column of another length is refused by name."""
    with pytest.raises(InvalidInput, match="high_pc_per_n"):
        response_per_sensor(SENSORS, D33, D33, D33[:2], (1.0, 2.0), REASONS)


def test_raw_trace_many_samples_keeps_extremes() -> None:
    """A raw trace of many samples keeps its extremes."""
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


def test_a_unit_that_a_name_has_stands_once() -> None:
    figure = raw_traces([Channel(name, "s", np.arange(5.0)) for name in ("Time [s]", "Time", "[s]", "t (s)")], None)
    titles = [figure.layout[f"yaxis{number}"].title.text for number in ("", 2, 3, 4)]
    assert titles == ["Time<br>[s]", "Time<br>[s]", "[s]<br>[s]", "t<br>[s]"]


def test_ticks_no_prefixes_small_force_unit() -> None:
    """Ticks have no prefixes and a small force its own unit."""
    figure = force_curves([ForceCurve("c", np.array([0.0, 2e-3]), np.array([0.0, 3e-5]))])
    assert figure.layout.yaxis.title.text == "force [µN]"
    assert figure.layout.xaxis.title.text == "displacement [µm]"
    assert figure.data[0].y.tolist() == pytest.approx([0, 30])
    assert figure.layout.template.layout.yaxis.exponentformat == "none"


def test_history_date_days_under_axis() -> None:
    """A history of one date has days under its axis."""
    points = SensorPoints("s", ["2026-11-27T09:00:00+00:00"], [14.0], [0.1], "no trend")
    axis = d33_history([points]).layout.xaxis
    assert (axis.dtick, axis.tickformat) == (86_400_000, "%d %b %Y")


def test_value_under_pointer_unit() -> None:
    """The value under the pointer has its unit."""
    frequency = np.array([1.0, 10.0])
    entry = FrfLines("a", frequency, np.array([7.0, 7.1]), np.array([0.0, -1.0]), np.array([1.0, 0.99]))
    magnitude, phase, coherence = (trace.hovertemplate for trace in frf_recordings([entry], None).data)
    assert " pC/N<extra>" in magnitude
    assert "°<extra>" in phase
    assert "}<extra>" in coherence


def test_axis_single_campaign_spans_days() -> None:
    """The axis of a single campaign spans days."""

    def history(*times: str) -> go.Figure:
        return d33_history([SensorPoints("s01", times, [14.0] * len(times), [0.1] * len(times), "")])

    low, high = history("2026-05-03T09:00:00.000000Z").layout.xaxis.range
    assert (high - low).days == 2
    assert history("2026-05-03T09:00:00Z", "2026-07-03T09:00:00Z").layout.xaxis.range is None
    assert history().layout.xaxis.range is None


def test_intervals_long_history_faint_keep() -> None:
    """Intervals of a long history are faint and keep their length."""

    def line(days: int) -> go.Scatter:
        times = [f"2026-{1 + day // 28:02d}-{1 + day % 28:02d}T09:00:00Z" for day in range(days)]
        (trace,) = d33_history([SensorPoints("s01", times, [14.0] * days, [0.1] * days, "")]).data
        np.testing.assert_allclose(trace.error_y.array, 0.1 * SDS_OF_95)
        return trace

    few, many = line(60), line(61)
    assert (few.error_y.color, few.error_y.width, few.marker.size) == (None, 3, 8)
    assert (many.error_y.color, many.error_y.width, many.marker.size) == ("rgba(0,114,178,0.25)", 0, 4)


def test_many_sensors_over_time_median_spread() -> None:
    """Many sensors over time are their median their spread and those that stand apart."""
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


def test_measured_lines_solid_differ_however() -> None:
    """Measured lines are solid and differ however many they are."""
    count, lines = 12, np.array([1.0, 10.0])
    history = d33_history([SensorPoints(f"s{n}", ["2024-05-01T09:00:00Z"], [14.0], [0.1], "") for n in range(count)])
    recordings = frf_recordings([FrfLines(f"r{n}", lines, lines, 0 * lines, lines) for n in range(count)], None)
    curves = force_curves([ForceCurve(f"c{n}", lines, lines) for n in range(count)])
    for figure in (history, recordings, curves):
        drawn = [trace for trace in figure.data if trace.showlegend is not False]
        assert {trace.line.dash for trace in drawn} <= {None, "solid"}
        assert len({(trace.line.color, trace.mode, trace.marker.symbol) for trace in drawn}) == count


def test_lines_recordings_look_condition() -> None:
    """Lines of recordings look as those of their condition do.

    Colour by preload, marks by sphere, whether they are shown alone or as the median of many.
    """
    conditions, lines = [(4.0, 0.5), (4.0, 3.0), (10.0, 0.5), (10.0, 3.0)], np.array([1.0, 10.0])
    alone = frf_recordings([FrfLines("r", lines, lines, 0 * lines, lines)] * 4, None, conditions)
    three = (lines, lines, lines)
    together = frf_overview([FrfSpread(*one, 5, lines, three, three, three) for one in conditions], None)

    def looks(figure: go.Figure) -> list[tuple[str, str]]:
        shown = [trace for trace in figure.data if trace.showlegend]
        return [(trace.line.color, trace.mode) for trace in shown]

    assert looks(alone) == looks(together)
    (small, small_mode), (large, _), (also_small, marked_mode), (also_large, _) = looks(alone)
    assert (small, large) == (also_small, also_large)
    assert small != large
    assert (small_mode, marked_mode) == ("lines", "lines+markers")


def test_frfs_of_many_recordings_have_no_legend() -> None:
    one, frequency = np.ones(2), np.array([1.0, 10.0])
    entries = [FrfLines(f"r{number}", frequency, 7 * one, 0 * one, one) for number in range(40)]
    assert frf_recordings(entries, None).layout.showlegend is False
    assert frf_recordings(entries[:5], None).layout.showlegend is True


@pytest.mark.parametrize(("coherence", "lowest"), [(0.99, "xaxis3"), (np.nan, "xaxis2")])
def test_lowest_panel_drawn_frequency(coherence: float, lowest: str) -> None:
    """The lowest panel that is drawn has the frequency."""
    entry = FrfLines("a", np.array([1.0, 10.0]), np.array([7.0, 7.1]), np.array([0.0, -1.0]), np.full(2, coherence))
    layout = frf_recordings([entry], None).layout
    assert layout[lowest].title.text == "frequency [Hz]"
    assert layout[lowest].showticklabels


def test_ten_sensors_history_colours_differ() -> None:
    """Ten sensors of a history have colours that differ."""
    sensors = [SensorPoints(f"s{n}", ["2024-05-01T09:00:00Z"], [14.0], [0.1], "") for n in range(10)]
    colours = [trace.line.color for trace in d33_history(sensors).data]
    channels = np.array([[int(one[at : at + 2], 16) for at in (1, 3, 5)] for one in colours])
    apart = np.abs(channels[:, None] - channels).sum(axis=2)
    assert apart[~np.eye(10, dtype=bool)].min() > 60


@pytest.mark.parametrize(
    ("peak", "expected"), [(50.0, (None, None)), (90.0, ("log", "D2")), (5000.0, ("log", 1)), (7e11, ("log", 2))]
)
def test_logarithmic_axis_labelled_full_spans(peak: float, expected: tuple[str | None, object]) -> None:
    """A logarithmic axis is labelled in full and spans a decade."""
    frequency = np.geomspace(5, 800, 30)
    magnitude = np.where(frequency > 200, peak, 7.0)
    line = FrfLines("r1", frequency, magnitude, np.zeros(30), np.full(30, np.nan))
    layout = frf_recordings([line], None).layout
    assert (layout.yaxis.type, layout.yaxis.dtick) == expected
    assert layout.yaxis.tickformat == (None if peak == 50 else "~g")
    assert (layout.xaxis.dtick, layout.xaxis.tickformat) == ("D2", "~g")
