"""The map of an array: who differs beyond chance is coloured, the others are grey, and discs never overlap."""

import numpy as np
import plotly.graph_objects as go
import pytest

from underskin.figures.array_map import Quantity, array_map, significance_note
from underskin.figures.loads import loaded_array
from underskin.inversion.array_history import differ_from_others
from underskin.units import Floats

SIDE = 8
SENSORS = [f"s{number:02}" for number in range(SIDE**2)]
X, Y = (4.0 * part.ravel() for part in np.meshgrid(np.arange(SIDE), np.arange(SIDE)))
GREY = "#cfd4d9"


def drawn(values: Floats, uncertainty: float = 0.12, quantity: Quantity | None = None) -> go.Figure:
    arguments = (SENSORS, X, Y, values, np.full(len(values), uncertainty), [""] * len(values))
    return array_map(*arguments) if quantity is None else array_map(*arguments, quantity)


def fills(figure: go.Figure) -> list[str]:
    return [shape.fillcolor for shape in figure.layout.shapes]


def test_sensors_that_are_alike_are_grey() -> None:
    random = np.random.default_rng(1)
    errors = 0.12 * random.normal(size=(400, 64))
    wrong = sum(bool(differ_from_others(13.1 + one, np.full(64, 0.12)).any()) for one in errors)
    assert 5 <= wrong <= 35  # 5 % of 400 are expected
    assert set(fills(drawn(np.full(64, 13.1)))) == {GREY}
    assert "no sensor's differs" in significance_note(np.full(64, 13.1), np.full(64, 0.12))


def test_who_differs_is_coloured_on_a_scale_that_reaches_as_far_as_chance() -> None:
    values = 13.1 + 0.12 * np.random.default_rng(2).normal(size=64)
    values[17] = 14.2
    figure = drawn(values)
    assert [row for row, fill in enumerate(fills(figure)) if fill != GREY] == [17]
    (differs,) = [trace for trace in figure.data if trace.name == "d33"]
    assert list(differs.ids) == ["s17"]
    low, high = differs.marker.cmin, differs.marker.cmax
    middle = float(np.median(values))
    assert (high - middle, middle - low) == pytest.approx((14.2 - middle, 14.2 - middle))
    assert high - low > 6 * 0.12
    assert "1 of 64 differ" in significance_note(values, np.full(64, 0.12))


@pytest.mark.parametrize("pitch", [0.5, 4.0, 40.0])
def test_discs_never_overlap_and_carry_their_ids(pitch: float) -> None:
    scale = pitch / 4.0
    figure = array_map(SENSORS, scale * X, scale * Y, np.full(64, 13.0), np.full(64, 0.1), [""] * 64)
    shapes = figure.layout.shapes
    diameters = [shape.x1 - shape.x0 for shape in shapes]
    assert max(diameters) < pitch  # in mm, so at any width of a window
    assert [(shape.x0 + shape.x1) / 2 for shape in shapes] == pytest.approx((scale * X).tolist())
    assert [text for trace in figure.data for text in trace.text] == SENSORS


def test_stands_out_chosen_rings_every_value() -> None:
    """Marked and chosen sensors have rings and every value its interval."""
    reasons = ["", "", "weak: 21 % of the array's median"]
    figure = array_map(SENSORS[:3], X[:3], Y[:3], [14.0, 14.1, 3.0], [0.1] * 3, reasons, chosen="s01")
    widths = [shape.line.width for shape in figure.layout.shapes]
    assert widths[0] < min(widths[1:])
    sensors = [trace for trace in figure.data if trace.ids is not None]
    told = {sensor: text for trace in sensors for sensor, text in zip(trace.ids, trace.customdata, strict=True)}
    assert told["s02"].startswith(f"s02: {reasons[2]}")
    assert "95 %: 13.8 to 14.2" in told["s00"]
    names = {trace.name for trace in figure.data}
    assert names == {"not different from the others", "marked"}
    (example,) = [trace for trace in figure.data if trace.name == "marked" and trace.showlegend is None]
    assert (
        example.marker.line.color == figure.layout.shapes[2].line.color
    )  # the legend shows the ring, whatever the disc's colour


def test_a_signed_charge_has_zero_in_the_middle_of_its_colours() -> None:
    figure = loaded_array(SENSORS[:3], X[:3], Y[:3], [5.0, -2.0, 0.001], [0.01] * 3, [])
    (charge,) = [trace for trace in figure.data if trace.name == "charge"]
    assert (charge.marker.cmin, charge.marker.cmax) == (-5.0, 5.0)
    assert fills(figure)[2] == GREY
    red, green, blue = zip(*(map(int, map(float, fill[4:-1].split(","))) for fill in fills(figure)[:2]), strict=True)
    assert red[0] > blue[0]  # orange above 0
    assert red[1] < blue[1]  # purple below
    assert green


def test_charges_of_one_sign_are_coloured_from_0_and_are_grey_within_their_error_alone() -> None:
    figure = loaded_array(SENSORS[:4], X[:4], Y[:4], [5.0, 0.0006, 0.0002, -0.001], [0.006, *[0.0003] * 3], [])
    (charge,) = [trace for trace in figure.data if trace.name == "charge"]
    (grey,) = [trace for trace in figure.data if trace.name == "0 within its ±"]
    assert (charge.marker.cmin, charge.marker.cmax) == (-0.001, 5.0)  # too little below 0 for colours to tell it apart
    assert list(grey.ids) == ["s02"]
    assert [fill == GREY for fill in fills(figure)] == [False, False, True, False]
    assert "within its ±: 0.0003 to 0.0009" in charge.customdata[1]
    drawn_in = loaded_array(SENSORS[:2], X[:2], Y[:2], [-5.0, -2.0], [0.01] * 2, []).data[0].marker
    assert (drawn_in.cmin, drawn_in.cmax) == (-5.0, 0.0)


def test_a_sensor_that_was_not_measured_with_the_others_is_hollow_and_compared_with_none() -> None:
    values = np.array([14.0, 14.05, 13.95, 2.0])
    told = ["", "", "", "last measured on 03 May 2026"]
    figure = array_map(SENSORS[:4], X[:4], Y[:4], values, np.full(4, 0.1), [""] * 4, absent=told)
    assert fills(figure) == [GREY] * 3 + ["#ffffff"]
    assert [shape.line.dash for shape in figure.layout.shapes] == [None] * 3 + ["dot"]
    sensors = [trace for trace in figure.data if trace.ids is not None]
    (hover,) = [text for one in sensors for name, text in zip(one.ids, one.customdata, strict=True) if name == "s03"]
    assert hover.startswith("s03: last measured on 03 May 2026<br>d33 2 pC/N<br>95 %: 1.804 to 2.196")
    assert "not in this campaign" in {trace.name for trace in figure.data if trace.showlegend is not False}
