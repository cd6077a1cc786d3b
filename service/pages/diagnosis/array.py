"""The array on the page of a diagnosis: for the chosen sensor the FRFs with both models, a table, and its history."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from urllib.parse import quote

import orjson

from service.pages.shared.figures import CLICK, Drawn, columns_of, drawn, drawn_before, sensors_of
from service.pages.shared.history import drawn_history
from service.store import AnyRow, Database, campaigns, skins
from service.usecases import d33_cache
from service.usecases.skins import history_by_model
from underskin.surrogate.sigma_table import SigmaTable

_D33 = ("d33_pc_per_n", "d33_uncertainty_pc_per_n", "d33_low_pc_per_n", "d33_high_pc_per_n")
_ABOUT = (
    "One recording of {sensor} with the models before and after, the worst explained one first; below, measured less "
)
_ABOUT += "predicted on the band that 95 % of the noise stays in."


@dataclass(frozen=True)
class ShownArray:
    """The fitted sensors, the chosen one, the figures, and the rows of its recordings."""

    sensors: list[str]
    chosen: str | None
    figures: list[Drawn]
    rows: list[dict[str, Any]]


def shown_array(
    store: Database, table: SigmaTable, row: AnyRow, texts: Mapping[str, str], sensor: str | None
) -> ShownArray | None:
    """For the diagnosis `row` of one campaign with the figures `texts`; None if it shows no FRFs of sensors."""
    if "frf" not in texts:
        return None
    figure = orjson.loads(texts["frf"])
    meta = figure["layout"]["meta"]
    sensors = sorted(set(meta["sensors"]))
    sensor = sensor if sensor in sensors else None
    campaign = store.read(campaigns.find, row.campaign_id)
    of_sensors = sensors_of(campaign, d33_cache.answer(store, table, campaign, None))
    if not of_sensors:
        return None
    figures = [_map(campaign, of_sensors, sensor)]
    if sensor is None:
        return ShownArray(sensors, None, figures, [])
    indices = [number for number, name in enumerate(meta["sensors"]) if name == sensor]
    root = store.read(skins.require_root, campaign.skin_id)
    computed = d33_cache.complete(store, table, root)
    history = drawn_history(root, history_by_model(store, table, root, "paper", computed), sensor, "paper")
    about = _ABOUT.format(sensor=sensor)
    frf = drawn_before("frf", _only(figure, indices), about, f"/diagnoses/{row.id}/frf.csv")
    return ShownArray(sensors, sensor, [*figures, replace(frf, name="frf-of-sensor"), history], _rows(meta, indices))


def _map(campaign: AnyRow, rows: Sequence[Mapping[str, Any]], sensor: str | None) -> Drawn:
    from underskin.figures.array_map import Quantity, array_map, disc_size, significance_note

    names, d33, uncertainty, low, high, x_mm, y_mm, reasons = columns_of(
        rows, "sensor", *_D33, "x_mm", "y_mm", "reasons"
    )
    quantity = Quantity("d33", "pC/N", intervals=tuple(zip(low, high, strict=True)))
    radius = campaign.about["skin"].get("sensor_radius_mm")
    figure = array_map(names, x_mm, y_mm, d33, uncertainty, reasons, quantity, sensor, radius)
    about = (
        f"Each sensor where it lies, coloured by its d33 by the paper's model. {disc_size(x_mm, y_mm, radius)} "
        f"{significance_note(d33, uncertainty)} {CLICK}"
    )
    return drawn("map", figure, about, f"/campaigns/{quote(campaign.id, safe='')}/d33.csv")


def _only(figure: Mapping[str, Any], numbers: list[int]) -> str:
    """The FRF figure restricted to these recordings."""
    for menu in figure["layout"].get("updatemenus", []):
        menu["buttons"] = [menu["buttons"][number] for number in numbers]
    return orjson.dumps(figure).decode()


def _rows(meta: Mapping[str, Any], numbers: list[int]) -> list[dict[str, Any]]:
    """Recordings with sphere, preload and the residual of either model; figures of older versions have only the
    names."""
    columns = ("indenters_mm", "preloads_n", "left_percent")
    return [
        {"recording": meta["recordings"][number], **{name: meta[name][number] for name in columns if name in meta}}
        for number in numbers
    ]
