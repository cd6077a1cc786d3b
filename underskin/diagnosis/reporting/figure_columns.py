"""The numbers of a diagnosis' figures, as columns."""

import base64
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
import orjson

from underskin.diagnosis.reporting.wording import answers, unit

FigureColumns = dict[str, list[Any]]


def columns(name: str, report: Mapping[str, Any], figures: Mapping[str, str]) -> FigureColumns:
    """The columns of the figure `name`; raises KeyError if it has none."""
    return _OF_REPORT[name](report) if name in _OF_REPORT else _OF_FIGURE[name](orjson.loads(figures[name]))


def _explanations(report: Mapping[str, Any]) -> FigureColumns:
    rows = [(" + ".join(row["mechanisms"]), row["probability"], row["why_not"]) for row in answers(report)]
    return _by_name(("explanation", "probability", "why_not"), rows)


def _parameters(report: Mapping[str, Any]) -> FigureColumns:
    names = ("mechanism", "parameter", "unit", "value", "low", "high")
    rows = [
        (mechanism["name"], parameter["name"], unit(parameter["unit"]), *(parameter[name] for name in names[3:]))
        for mechanism in report["mechanisms"]
        for parameter in mechanism["parameters"]
    ]
    return _by_name(names, rows)


def _sensors(report: Mapping[str, Any]) -> FigureColumns:
    names = ("campaign", "sensor", "unit", "value", "low", "high")
    return _by_name(names, [[row[name] for name in names] for row in report["d33"]["per_sensor"]])


def _population(report: Mapping[str, Any]) -> FigureColumns:
    names = ("skin", "value", "low", "high")
    rows = [
        (parameter["parameter"], parameter["unit"], parameter["mean"], parameter["sd"], *(skin[name] for name in names))
        for parameter in report["population"]
        for skin in parameter["skins"]
    ]
    return _by_name(("parameter", "unit", "mean", "sd", *names), rows)


def _where(figure: Mapping[str, Any]) -> FigureColumns:
    (trace,) = figure["data"]
    layout = figure["layout"]
    heads = [layout[axis]["title"]["text"] or axis for axis in ("xaxis", "yaxis")]
    places = product(layout["yaxis"]["ticktext"], layout["xaxis"]["ticktext"])
    values = zip(places, _numbers(trace["z"]), _numbers(trace["customdata"]), strict=True)
    rows = [(x, y, None if np.isnan(value) else value, int(count)) for (y, x), value, count in values]
    return _by_name((*heads, layout["title"]["text"].removeprefix("Where: "), "points"), rows)


def _before_after(figure: Mapping[str, Any]) -> FigureColumns:
    points = [trace for trace in figure["data"] if trace.get("mode") == "markers"]
    rows = [
        (trace["name"], recording, predicted, measured)
        for trace in points
        for recording, predicted, measured in zip(
            trace["text"], _numbers(trace["x"]), _numbers(trace["y"]), strict=True
        )
    ]
    unit = figure["layout"]["xaxis"]["title"]["text"].removeprefix("predicted ")
    return _by_name(("model", "recording", f"predicted {unit}", f"measured {unit}"), rows)


def _curve(figure: Mapping[str, Any]) -> FigureColumns:
    """Samples, predictions, residuals and marks of every recording, one below the other."""
    rows = []
    for trace in figure["data"]:
        meta = trace["meta"]
        for x, y in zip(_numbers(trace["x"]), _numbers(trace["y"]), strict=True):
            rows.append((meta["recording"], meta["shows"], _rounded(x * meta["mm"]), _rounded(y * meta["n"])))
    return _by_name(("recording", "shows", "depth_mm", "force_n"), rows)


def _frf(figure: Mapping[str, Any]) -> FigureColumns:
    """Lines, model predictions, residuals and noise band of every recording."""
    layout, meta = figure["layout"], figure["layout"]["meta"]
    first = {axis: [trace[axis] for trace in figure["data"]] for axis in ("x", "y")}
    buttons = [button for menu in layout.get("updatemenus", []) for button in menu["buttons"]]
    views = [{**first, **button["args"][0]} for button in buttons] or [first]
    rows: list[tuple[Any, ...]] = []
    for name, sensor, numbers in zip(meta["recordings"], meta["sensors"], views, strict=True):
        lines = zip(*map(_numbers, (numbers["x"][0], *numbers["y"])), strict=True)
        rows += [(name, sensor, *line) for line in lines]
    return _by_name(("recording", "sensor", "frequency_hz", *map(_with_unit, meta["shows"])), rows)


def _with_unit(heading: str) -> str:
    unit = "deg" if "phase" in heading else "percent" if " " in heading else "pc_per_n"
    return f"{heading.replace(' ', '_')}_{unit}"


def _rounded(value: float) -> float:
    """To the digits of a number of four bytes."""
    return float(f"{value:.6g}")


def _by_name(names: Sequence[str], rows: Sequence[Sequence[Any]]) -> FigureColumns:
    return {name: [row[number] for row in rows] for number, name in enumerate(names)}


def _numbers(column: Any) -> list[float]:
    """A column as plotly writes it: a list, or the bytes of an array; a two-dimensional one row by row."""
    if isinstance(column, Mapping):
        values: list[float] = np.frombuffer(base64.b64decode(column["bdata"]), dtype=column["dtype"]).tolist()
        return values
    return [float("nan") if value is None else float(value) for value in column]


_OF_REPORT: dict[str, Callable[[Mapping[str, Any]], FigureColumns]] = {
    "explanations": _explanations,
    "parameters": _parameters,
    "sensors": _sensors,
    "population": _population,
}
_OF_FIGURE: dict[str, Callable[[Mapping[str, Any]], FigureColumns]] = {
    "where": _where,
    "frf": _frf,
    "curve": _curve,
    "before_after": _before_after,
}
