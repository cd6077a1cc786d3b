"""The figures of a campaign's page, and their numbers."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from threading import Lock
from typing import Any

from service.pages.shared.figures import CLICK, Drawn, columns_of, drawn, drawn_curves, sensors_of
from service.pages.shared.frf import drawn_frf
from service.schemas.campaign_d33 import D33Value
from service.store import AnyRow, Database, campaigns

_AGAINST_PRELOAD = (
    "indenter_radius_mm", "preload_n", "frf_pc_per_n", "frf_uncertainty_pc_per_n", "model_frf_pc_per_n",
)  # fmt: skip
_MOST_CURVES = 24
_MOST_CACHED = 64
Which = tuple[str, int, str, str, str]  # campaign, revision, table, band, shown part
_cache: dict[Which, list[Drawn]] = {}
_keeping = Lock()


def figures(
    store: Database, row: AnyRow, answer: Mapping[str, Any], numbers: Mapping[str, Any], show: str, *, curves: bool
) -> list[Drawn]:
    """All figures of a campaign in its present state. `answer`: its d33 as in `/d33`, with its `numbers`; `show` as
    in `measured`; `curves`: whether it has recordings other than FRFs. Recent figures are cached."""
    basis = (row.id, row.revision, answer["table_sha256"], _chosen(answer))
    loaded = cache(lambda: store.read(campaigns.load, row, with_excluded=False))

    def draw_curves() -> list[Drawn]:
        return drawn_curves(loaded().recordings, _MOST_CURVES, " recordings", f"/campaigns/{row.id}/curves.csv")

    makers: dict[str, Callable[[], list[Drawn]]] = {
        **({"curves": draw_curves} if curves else {}),
        f"lines {show}": lambda: drawn_frf(row, loaded, answer, numbers["spreads"], show),
        f"d33 {show}": lambda: _d33(row, answer, numbers, show),
    }
    all_figures = []
    for name, make in makers.items():
        before = _cache.get((*basis, name))
        all_figures += before if before is not None else _keep((*basis, name), make())
    return all_figures


def _keep(which: Which, drawn_now: list[Drawn]) -> list[Drawn]:
    with _keeping:
        while len(_cache) >= _MOST_CACHED:
            del _cache[next(iter(_cache))]
        _cache[which] = drawn_now
    return drawn_now


def band_query(band_hz: tuple[float, float]) -> str:
    """A band in an address."""
    return f"band_low_hz={band_hz[0]!r}&band_high_hz={band_hz[1]!r}"


def _chosen(answer: Mapping[str, Any]) -> str:
    """The band of the address if the reader chose it."""
    band = answer["band"]
    return band_query((band["low_hz"], band["high_hz"])) if band is not None and band["chosen_by_user"] else ""


def _d33(row: AnyRow, answer: Mapping[str, Any], numbers: Mapping[str, Any], show: str) -> list[Drawn]:
    """d33 against preload, per sensor and as a map; if `show` is a sensor, only its points against preload, and it
    is marked."""
    from underskin.figures.array import frf_versus_preload, response_per_sensor
    from underskin.figures.array_map import Quantity, array_map, disc_size, significance_note

    if answer["band"] is None:
        return []
    names, d33, uncertainty, low, high, x_mm, y_mm, reasons = columns_of(
        sensors_of(row, answer), "sensor", *D33Value.model_fields, "x_mm", "y_mm", "reasons"
    )
    array, radius = answer["array_relative"], row.about["skin"].get("sensor_radius_mm")
    limits = None if array is None else (array["d33_low_pc_per_n"], array["d33_high_pc_per_n"])
    sensor = show if show in names else None
    rows = _of_sensor(numbers["recordings"], sensor)
    titles = [f"{name}, sensor {sensor}" for name, sensor in zip(rows["recording"], rows["sensor"], strict=True)]
    page, chosen = f"/campaigns/{row.id}", _chosen(answer)
    chosen = f"?{chosen}" if chosen else ""
    quantity = Quantity("d33", "pC/N", intervals=tuple(zip(low, high, strict=True)))
    return [
        drawn(
            "preload",
            frf_versus_preload(titles, *(rows[name] for name in _AGAINST_PRELOAD)),
            f"FRF in the flat zone against preload{'' if sensor is None else f' of {sensor}'}, for each sphere (radius "
            "R) with 95 % intervals; dashed lines are the paper's model with the array's d33, in the sphere's colour.",
            f"{page}/preload.csv{chosen}",
        ),
        drawn(
            "response",
            response_per_sensor(names, d33, low, high, limits, reasons, sensor),
            f"d33 of each sensor with its 95 % interval. {CLICK}",
            f"{page}/d33.csv{chosen}",
        ),
        drawn(
            "map",
            array_map(names, x_mm, y_mm, d33, uncertainty, reasons, quantity, sensor, radius),
            f"Each sensor where it lies, coloured by its d33. {disc_size(x_mm, y_mm, radius)} "
            f"{significance_note(d33, uncertainty)} {CLICK}",
            f"{page}/d33.csv{chosen}",
        ),
    ]


def _of_sensor(columns: Mapping[str, Sequence[Any]], sensor: str | None) -> dict[str, list[Any]]:
    """The rows of one sensor, or all."""
    row_indices = [row for row, name in enumerate(columns["sensor"]) if sensor in (None, name)]
    return {name: [values[row] for row in row_indices] for name, values in columns.items()}
