"""An array under loads: the fields of its forms, and the request of `POST /v1/stress` made from them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from fastapi import Request

from service.pages.shared.figures import Drawn, drawn
from service.pages.shared.forms import UNLIKELY, in_form_words, label_of, number
from service.pages.shared.skin_values import FIELDS, UNITS, shown
from service.pages.shared.wrong_fields import NOTHING_WRONG, WrongFields, errors_together, quantities, wrong_fields
from service.store import Database, campaigns, skins
from service.usecases.tables import influence_table
from underskin.array_stress.answer import ArrayStress, answer
from underskin.array_stress.request import read_request
from underskin.errors import InvalidInput, UnderskinError, all_of, noting, out_of_range, wrong_type
from underskin.findings.codes import Reason
from underskin.recordings.validation import not_negative
from underskin.surrogate.sigma_table import SigmaTable

_MOST_SENSORS = 10_000
# The L up to which the addition by finite strain is known, and that addition in percent (docs/http-api.md).
_KNOWN_UP_TO_L, _ADDED_PERCENT = 0.1, 3
GRID = (("columns", "sensors along x", ""), ("rows", "sensors along y", ""), ("pitch_mm", "pitch", "mm"))
_DEFAULTS = {"columns": "4", "rows": "4", "pitch_mm": "8"}
GLUE = "glue_stiffness"
LOAD = "load in line"  # as errors call one of the loads, with its number
_LABELS = {
    **{name: f"{words} [{unit}]" if unit else words for name, words, unit, *_ in (*FIELDS, *GRID)},
    GLUE: "glue line, κ",
    "contacts": "loads",
    "pressure_map": "the map",
}


@dataclass(frozen=True)
class Described:
    """The array in a form: values as sent, or else those of the skin's campaigns or of the prototype."""

    skin_id: str | None
    values: Mapping[str, str]
    glue: str
    units_checked: bool
    sensors: Sequence[Mapping[str, Any]] | None  # the skin's; None: a grid of the form's
    taken: Sequence[str]  # sentences on undeclared values

    @property
    def fields(self) -> Sequence[tuple[str, str, str]]:
        """The fields of the form."""
        return FIELDS if self.sensors is not None else (*FIELDS, *GRID)

    def document(self) -> dict[str, Any]:
        """The request without its loads; raises SeveralInvalid."""
        with errors_together() as wrong:
            document: dict[str, Any] = {}
            with noting(wrong):
                document |= quantities(self.values, [name for name, *_ in FIELDS], units_checked=self.units_checked)
            if self.glue.strip():
                with noting(wrong):
                    document[GLUE] = not_negative(GLUE, number(GLUE, self.glue), self.units_checked)
            if self.units_checked:
                document[UNITS] = True
            document["sensors"] = _grid(self.values) if self.sensors is None else list(self.sensors)
            return document


def described(store: Database, table: SigmaTable, given: Mapping[str, str], skin_id: str | None) -> Described:
    """The array of a form's fields; a regular grid if no campaign of the skin names sensors."""
    sensors = None if skin_id is None else _sensors(store, skin_id)
    values, taken = shown(store, table, given, skin_id)
    if skin_id is not None and sensors is None:
        taken = [*taken, "No campaign of the skin names its sensors, so they are a grid here"]
    values |= {name: given.get(name, default) for name, default in _DEFAULTS.items()}
    return Described(skin_id, values, given.get(GLUE, ""), UNITS in given, sensors, taken)


def findings(answer: ArrayStress | None, lines: Sequence[int] = ()) -> list[tuple[str, str]]:
    """Implausible values, each with the label of its field in these forms; `lines`: the line numbers of the loads."""
    stated = [] if answer is None else answer.findings
    return [(label_of(finding.field, _LABELS, lines), finding.statement) for finding in stated]


def finite_strain(answer: ArrayStress | None) -> str | None:
    """A warning that finite strain, which neither charge nor error includes, adds more than is known; None for
    smaller loads."""
    for finding in [] if answer is None else answer.findings:
        load = finding.arguments.get("load_parameter", 0.0)
        if finding.reason is Reason.LOAD_NOT_LINEAR and load > _KNOWN_UP_TO_L:
            return (
                f"The ± does not include finite strain. At L = {_KNOWN_UP_TO_L:g} that adds {_ADDED_PERCENT} % to the "
                f"stress on a sensor beneath the sphere; here L reaches {load:.2g}, beyond where it is known what it "
                "adds."
            )
    return None


def tried(
    request: Request, make: Callable[[], dict[str, Any]], lines: Sequence[int] = ()
) -> tuple[dict[str, Any], ArrayStress | None, WrongFields]:
    """The request made by `make`, with its answer or its errors; `lines` as for `findings`."""
    document: dict[str, Any] = {}
    try:
        document = make()
        return document, answered(request, document), NOTHING_WRONG
    except UnderskinError as error:
        in_words = partial(in_form_words, labels=_LABELS, lines=lines, unlikely=UNLIKELY)
        return document, None, wrong_fields(error, in_words, _form_field)


def _form_field(error: InvalidInput) -> str:
    """The form's field of an error."""
    loads = error.field.startswith(("contacts", LOAD))
    return "loads" if loads else "map" if error.field.startswith("pressure_map") else error.field


def answered(request: Request, document: Mapping[str, Any]) -> ArrayStress:
    """The answer of `POST /v1/stress`; raises UnderskinError."""
    table = influence_table(request.app.state.settings.tables)
    with np.errstate(all="ignore"):  # an overflow is out of reach
        return answer(table, read_request(document))


def charge_columns(answer: ArrayStress) -> dict[str, list[Any]]:
    """Charge and stress on each sensor."""
    return {"sensor": list(answer.sensors), **{name: column.tolist() for name, column in answer.columns.items()}}


def charge_figure(
    answer: ArrayStress, loads_mm: Sequence[tuple[float, float]], radius_mm: float, numbers: str
) -> Drawn:
    """The sensors coloured by charge, with the loads if they have positions; `radius_mm`: sensor radius."""
    from underskin.figures.array_map import disc_size
    from underskin.figures.loads import loaded_array

    x, y, charge, error = (answer.columns[name] for name in ("x_mm", "y_mm", "charge_pc", "charge_error_pc"))
    figure = loaded_array(answer.sensors, x, y, charge, error, loads_mm, radius_mm)
    about = f"Each sensor where it lies, coloured by its charge. {disc_size(x, y, radius_mm)}"
    if (np.abs(charge) <= error).any():
        about += " Grey: the charge is 0 within its ±."
    if np.isnan(charge).any():
        about += " Not filled: no load is within reach."
    return drawn("charge", figure, about, numbers)


def _grid(typed: Mapping[str, str]) -> list[dict[str, Any]]:
    readings = {name: partial(_count, name, typed[name]) for name in ("columns", "rows")}
    values = all_of({**readings, "pitch_mm": partial(number, "pitch_mm", typed["pitch_mm"])})
    columns, rows, pitch = values["columns"], values["rows"], values["pitch_mm"]
    if not (1 <= columns <= 1000 and 1 <= rows <= 1000 and columns * rows <= _MOST_SENSORS):
        raise out_of_range("columns", f"{columns:g} × {rows:g}", f"must be 1 to {_MOST_SENSORS} sensors in all")
    return [
        {"id": f"s{1 + row * int(columns) + column:02d}", "x_mm": pitch * column, "y_mm": pitch * row}
        for row in range(int(rows))
        for column in range(int(columns))
    ]


def _count(name: str, typed: str) -> float:
    value = number(name, typed)
    if not value.is_integer():
        raise wrong_type(name, f"{value:g}", "must be a whole number")
    return value


def _sensors(store: Database, skin_id: str) -> Sequence[Mapping[str, Any]] | None:
    """The sensors of the campaign that describes the skin; None if there are none."""
    with store.reading() as connection:
        row = campaigns.describing(connection, skins.require_root(connection, skin_id))
    return None if row is None else row.about["skin"]["sensors"] or None
