"""Two campaigns side by side, of one skin or of two: maps with a common colour scale and the map of the difference;
for curves, the curves and Young's modulus."""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from sqlalchemy import Connection

from service.dependencies import Store, Table
from service.pages.shared import same_request
from service.pages.shared.downloads import Numbers, downloadable, file_name, numbers_of_rows
from service.pages.shared.figures import Drawn, columns_of, drawn, sensors_of
from service.pages.shared.html import page
from service.schemas.campaign_d33 import D33Value
from service.store import AnyRow, Database, campaigns
from service.usecases import d33_cache
from service.usecases.figure_data import measured, spreads, spreads_of
from underskin.figures.array_map import Quantity, array_map, disc_size, significance_note
from underskin.figures.curves import ForceCurve, curve_moduli, force_curves
from underskin.figures.frf import frf_pair
from underskin.inversion.comparison import in_words, mean_moduli, with_differences
from underskin.mechanisms.base import Kind
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/compare")


_OF_CURVES = ("which", "campaign", "recording", "youngs_modulus_mpa", "youngs_modulus_uncertainty_mpa", "statement")
_MOST_CURVES = 12  # of each campaign
_NAMES = ("first", "second")
_MODULUS = "youngs_modulus_mpa"
_MOST_LISTED = 200
_MOST_NAMED = 6  # sensors
_SAME_POSITION_MM = 0.01
_COLUMNS = (
    "sensor", "first_pc_per_n", "first_uncertainty_pc_per_n", "second_pc_per_n", "second_uncertainty_pc_per_n",
    "difference_pc_per_n", "difference_uncertainty_pc_per_n", "difference_percent", "beyond_chance",
)  # fmt: skip
KINDS: tuple[Kind, ...] = ("frf", "indentation", "compression")
WORDS = {"frf": "FRFs", "indentation": "indentations", "compression": "compressions"}
Chosen = Annotated[str, Query(max_length=200)]
ChosenKind = Annotated[Kind | None, Query()]


def modulus_rows(kind: str, both: Sequence[AnyRow], answers: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Young's modulus of each curve of a kind, first campaign first."""
    return [
        {"which": name, "campaign": row.id, **modulus}
        for name, row, answer in zip(_NAMES, both, answers, strict=True)
        for modulus in answer["moduli"]
        if modulus["kind"] == kind
    ]


def _mean_moduli(of_curves: Sequence[Mapping[str, Any]]) -> list[Any]:
    """The mean modulus of each campaign, and the difference second − first."""
    first, second = (np.array([row[_MODULUS] for row in of_curves if row["which"] == name]) for name in _NAMES)
    return mean_moduli(first, second)


def _curve_figures(
    store: Database, kind: str, both: Sequence[AnyRow], of_curves: Sequence[Mapping[str, Any]]
) -> list[Drawn]:
    """The curves of both, each campaign in a colour, and the modulus of each curve."""
    curves, counts = [], []
    for name, row in zip(_NAMES, both, strict=True):
        campaign = store.read(campaigns.load, row, with_excluded=False)
        curves_of_kind = [curve for curve in campaign.curves if curve.kind == kind]
        counts.append(f"{min(len(curves_of_kind), _MOST_CURVES)} of {len(curves_of_kind)} of the {name}")
        curves += [
            ForceCurve(recording.id, recording.displacement_mm, recording.force_n, of=name)
            for recording in curves_of_kind[:_MOST_CURVES]
        ]
    about = f"Curves as they were recorded: {' and '.join(counts)}."
    which, names, modulus, uncertainty = columns_of(
        of_curves, "which", "recording", _MODULUS, "youngs_modulus_uncertainty_mpa"
    )
    page = f"/compare/moduli.csv?first={both[0].id}&second={both[1].id}&kind={kind}"
    description = "Young's modulus of each curve, with its 95 % interval by the noise of that curve alone."
    return [
        drawn("curves", force_curves(curves), about),
        *([drawn("moduli", curve_moduli(which, names, modulus, uncertainty), description, page)] if of_curves else []),
    ]


@router.get("")
def compare(
    request: Request,
    store: Store,
    table: Table,
    first: Chosen = "",
    second: Chosen = "",
    skin: Chosen = "",
    kind: ChosenKind = None,
) -> Response:
    """Compares the campaigns `first` and `second`. A missing one is chosen from those with recordings of a `kind` in
    use: of `skin` the one recorded first or last, otherwise the last two of one skin. The default kind is the first
    of `KINDS` that the first campaign, or any, has."""
    kind = kind or _kind(store, table, skin, first)
    with store.reading() as connection:
        offered = [
            kind_name for kind_name in KINDS if campaigns.current_by_time(connection, skin or None, 1, kind=kind_name)
        ]
        latest = campaigns.current_by_time(connection, skin or None, _MOST_LISTED + 1, kind=kind)
        listed = list(latest[:_MOST_LISTED])
        if listed:
            first, second = _pair(connection, skin, kind, listed, first, second)
        both = [campaigns.find(connection, campaign_id) for campaign_id in (first, second) if campaign_id]
    listed += [row for row in both if row.id not in {campaign.id for campaign in listed}]
    with_numbers = [d33_cache.with_numbers(store, table, row, None) for row in both]
    answers = [answer for answer, _ in with_numbers]
    is_two = first != second
    rows = _rows(answers) if is_two and kind == "frf" else []
    of_curves = modulus_rows(kind, both, answers) if is_two and kind != "frf" else []
    maps = drawn_maps(both, answers, rows)
    if maps:
        maps += _overlaid(store, both, [numbers["spreads"] for _, numbers in with_numbers])
    elsewhere = moved(both, rows)
    return page(
        request,
        "compare.html",
        skin=skin,
        kind=kind,
        offered=offered,
        words=WORDS,
        listed=listed,
        most_listed=_MOST_LISTED if len(latest) > _MOST_LISTED else None,
        first=first,
        second=second,
        both=both,
        rows=rows,
        lead=in_words(rows),
        without_common=without_common(answers) if is_two and kind == "frf" else [],
        most_named=_MOST_NAMED,
        moved=elsewhere[:_MOST_NAMED],
        more_moved=len(elsewhere[_MOST_NAMED:]),
        means=_mean_moduli(of_curves) if of_curves else [],
        figures=_curve_figures(store, kind, both, of_curves) if is_two and kind != "frf" and both else maps,
        same=same_request.get(request, f"/v1/campaigns/{first}/d33", f"client.campaigns.d33({first!r})"),
    )


def _pair(
    connection: Connection, skin: str, kind: Kind, listed: Sequence[AnyRow], first: str, second: str
) -> tuple[str, str]:
    """The campaigns to compare if one is not named; `listed`: the candidates, the latest first."""
    if not (skin or first or second):
        for skin_id in dict.fromkeys(row.skin_id for row in listed):
            last = campaigns.current_by_time(connection, skin_id, 2, kind=kind)
            if len(last) == 2:
                return last[1].id, last[0].id
    (oldest,) = campaigns.current_by_time(connection, skin or None, 1, kind=kind, oldest_first=True)
    first = first or oldest.id
    of_first = next((row.skin_id for row in listed if row.id == first), None)
    others = sorted((row for row in listed if row.id != first), key=lambda row: row.skin_id != of_first)
    return first, second or next((row.id for row in others), first)


def without_common(answers: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """The ids of the sensors of both campaigns, if both have some and none in common; else empty."""
    ids = [[sensor["sensor"] for sensor in answer["sensors"]] for answer in answers]
    return ids if len(ids) == 2 and all(ids) and set(ids[0]).isdisjoint(ids[1]) else []


def moved(both: Sequence[AnyRow], rows: Sequence[Mapping[str, Any]]) -> list[tuple[str, float]]:
    """Of each compared sensor whose position differs between the campaigns its id and the distance [mm]."""
    if len(both) < 2:
        return []
    first, second = (
        {sensor["id"]: (sensor["x_mm"], sensor["y_mm"]) for sensor in row.about["skin"]["sensors"]} for row in both
    )
    shared = [row["sensor"] for row in rows if row["difference_pc_per_n"] is not None]
    gaps = [(name, math.dist(first[name], second[name])) for name in shared]
    return [(name, gap) for name, gap in gaps if gap > _SAME_POSITION_MM]


def _kind(store: Database, table: SigmaTable, skin: str, first: str) -> Kind:
    """The first of `KINDS` that the campaign `first` has, or else any campaign."""
    if first:
        answer = _answer(store, table, first)
        has = {modulus["kind"] for modulus in answer["moduli"]} if not answer["sensors"] else {KINDS[0]}
    else:
        with store.reading() as connection:
            has = {
                kind_name
                for kind_name in KINDS
                if campaigns.current_by_time(connection, skin or None, 1, kind=kind_name)
            }
    return next((kind_name for kind_name in KINDS if kind_name in has), KINDS[0])


@downloadable(router, "/moduli")
def moduli_csv(store: Store, table: Table, first: Chosen, second: Chosen, kind: Kind) -> Numbers:
    """Young's modulus of each curve of both campaigns."""
    both = [store.read(campaigns.find, campaign_id) for campaign_id in (first, second)]
    rows = modulus_rows(kind, both, [d33_cache.answer(store, table, row, None) for row in both])
    return numbers_of_rows(_file(both, "moduli"), _OF_CURVES, rows)


@downloadable(router, "/difference")
def difference_csv(store: Store, table: Table, first: Chosen, second: Chosen) -> Numbers:
    """d33 of each sensor in both campaigns, and the second less the first."""
    both = [store.read(campaigns.find, campaign_id) for campaign_id in (first, second)]
    rows = _rows([d33_cache.answer(store, table, row, None) for row in both])
    return numbers_of_rows(_file(both, "difference"), _COLUMNS, rows)


def _file(both: Sequence[AnyRow], what: str) -> str:
    """The name of a file of two campaigns, without its ending; of one skin it names that once."""
    ids = dict.fromkeys(row.skin_id for row in both)
    names = [row.name for row in both] if len(ids) == 1 else [f"{row.skin_id}-{row.name}" for row in both]
    return file_name(*(ids if len(ids) == 1 else ()), *names, what)


def _answer(store: Database, table: SigmaTable, campaign_id: str) -> dict[str, Any]:
    return d33_cache.answer(store, table, store.read(campaigns.find, campaign_id), None)


def _rows(answers: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The rows of the sensors of two campaigns; a sensor of only one has no difference."""
    if len(answers) < 2:
        return []
    of_sensor: dict[str, dict[str, Any]] = {}
    for which, answer in zip(("first", "second"), answers, strict=True):
        for sensor in answer["sensors"]:
            row = of_sensor.setdefault(sensor["sensor"], dict.fromkeys(_COLUMNS) | {"sensor": sensor["sensor"]})
            row[f"{which}_pc_per_n"] = sensor["d33_pc_per_n"]
            for part in ("uncertainty", "low", "high"):
                row[f"{which}_{part}_pc_per_n"] = sensor[f"d33_{part}_pc_per_n"]
    return with_differences(list(of_sensor.values()))


def _overlaid(store: Database, both: Sequence[AnyRow], stored: Sequence[Any]) -> list[Drawn]:
    """The FRFs of both, laid over each other under each sphere and preload that both have."""
    of_each = [
        spreads(of_row) if of_row else spreads_of(measured(store.read(campaigns.load, row, with_excluded=False)))
        for row, of_row in zip(both, stored, strict=True)
    ]
    figure = frf_pair(*of_each)
    about = (
        "Median magnitude and phase, and lowest coherence, under each sphere (radius R) and preload of both campaigns."
    )
    return [] if figure is None else [drawn("frf", figure, about + " Dashed: the first; solid: the second.")]


def drawn_maps(
    both: Sequence[AnyRow], answers: Sequence[Mapping[str, Any]], rows: Sequence[Mapping[str, Any]]
) -> list[Drawn]:
    """The maps of both with a common colour scale, and that of the difference; none if no d33 is known."""
    if not rows or not all(answer["sensors"] for answer in answers):
        return []
    values = [row[f"{which}_pc_per_n"] for row in rows for which in ("first", "second")]
    finite_values = [value for value in values if value is not None]
    if not finite_values:
        return []
    ends = min(finite_values), max(finite_values)
    maps = []
    for name, row, answer in zip(("first", "second"), both, answers, strict=True):
        sensors = sensors_of(row, answer)
        names, x_mm, y_mm, reasons = columns_of(sensors, "sensor", "x_mm", "y_mm", "reasons")
        d33, uncertainty, *intervals = columns_of(sensors, *D33Value.model_fields)
        quantity = Quantity("d33", "pC/N", ends=ends, intervals=tuple(zip(*intervals, strict=True)))
        radius = row.about["skin"].get("sensor_radius_mm")
        figure = array_map(names, x_mm, y_mm, d33, uncertainty, reasons, quantity, None, radius)
        figure.update_layout(title=f"d33, {name}")
        scale = significance_note(d33, uncertainty, quantity)
        about = f"{row.name}, skin {row.skin_id}; colours as on the other map. {disc_size(x_mm, y_mm, radius)} {scale}"
        maps.append(drawn(f"map-{name}", figure, about))
    places = {sensor["id"]: sensor for row in both for sensor in row.about["skin"]["sensors"]}
    shared = [row for row in rows if row["difference_pc_per_n"] is not None]
    if not shared:
        return maps
    names, gap, uncertainty = columns_of(
        shared, "sensor", "difference_pc_per_n", "difference_uncertainty_pc_per_n"
    )  # by id, since skins of one make have their arrays in common
    x_mm, y_mm = ([places[name][axis] for name in names] for axis in ("x_mm", "y_mm"))
    quantity = Quantity("difference of d33", "pC/N", "zero")
    radius = both[1].about["skin"].get("sensor_radius_mm")
    figure = array_map(names, x_mm, y_mm, gap, uncertainty, [""] * len(names), quantity, None, radius)
    figure.update_layout(title="Difference of d33")
    note = significance_note(gap, uncertainty, quantity)
    about = f"The second's d33 less the first's, 0 in the middle of the colours. {note}"
    csv_address = f"/compare/difference.csv?first={both[0].id}&second={both[1].id}"
    return [*maps, drawn("map-difference", figure, about, csv_address)]
