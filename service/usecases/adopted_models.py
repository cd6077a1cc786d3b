"""A skin's adopted model: adoption, display with its evidence, and its application to the rows of a request."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection

from service.problems import Refusal
from service.schemas.diagnoses import ModelEntry, ModelVersion
from service.schemas.pressed_skin import ADOPTED_COLUMNS, FIELDS, PressedSkinColumns
from service.store import AnyRow, Conflict, Database, diagnoses, models, skins
from service.usecases.mechanisms import catalogue
from underskin.errors import conflicting, out_of_range, required
from underskin.physics.charge_response import gain
from underskin.prediction.adopted_model import AdoptedModel, adopted
from underskin.prediction.answers import limits_of_pressed, pressed
from underskin.prediction.pressed_skin import NOT_FINITE, Transmission, Words
from underskin.recordings.campaign import frf_conditions
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes, Floats, Mask, finite, non_negative

_LARGEST_LINES = 100_000  # distinct rows times frequencies: some seconds
_MOST_CACHED = 100
_cache: dict[str, AdoptedModel] = {}  # by diagnosis, which do not change once done
_ANY_LINE = np.array([1.0])
_OUTSIDE = "outside the tables, or the range of the law, by the adopted model"
_Responses = tuple[Complexes, NDArray[np.bool_]]


@dataclass(frozen=True)
class ModelInForce:
    """The model in force of a skin, and its id."""

    model: AdoptedModel
    model_id: str


def model_in_force(store: Database, skin_id: str) -> ModelInForce:
    """The model in force; raises Refusal 404 if there is none, Conflict if it is outdated."""
    with store.reading() as connection:
        skin = skins.find(connection, skin_id)
        row = None if skin is None else models.in_force(connection, skin.root_id)
        if row is None:
            raise Refusal(404, f"Skin {skin_id!r} has no adopted model; use model paper.")
        why = diagnoses.outdated(row)
        if why is not None:
            raise Conflict(
                f"Model {row.model_id!r} of skin {skin_id!r} serves no figures: its campaign {row.campaign_id!r} was "
                f"{why}. Diagnose it again and adopt that, or use model paper."
            )
        return ModelInForce(of_row(connection, row), row.model_id)


def of_row(connection: Connection, row: AnyRow) -> AdoptedModel:
    """The model of a finished diagnosis; raises InvalidInput if it cannot be used as a model."""
    model = _cache.get(row.id)
    if model is None:
        report = diagnoses.report_of(connection, row.number)
        assert report is not None
        campaign, _ = diagnoses.campaign_of(connection, row)
        catalogue()  # another server may have added a mechanism that it has
        model = adopted(report, campaign)
        if len(_cache) >= _MOST_CACHED:
            _cache.clear()  # by any thread at any time
        _cache[row.id] = model
    return model


def adopt(connection: Connection, skin_id: str, diagnosis_id: str, sender: str | None) -> AnyRow:
    """Make a diagnosis the model of a skin; raises Conflict, Missing, and InvalidInput where it cannot serve."""
    root = skins.require_root(connection, skin_id)
    diagnosis = diagnoses.find(connection, diagnosis_id)
    if diagnosis.state != "done":
        raise Conflict(f"Diagnosis {diagnosis.id!r} has no report: its state is {diagnosis.state}.")
    if diagnosis.kind != "campaign":
        raise Conflict(f"Diagnosis {diagnosis.id!r} is of several campaigns: adopt the diagnosis of one of them.")
    of_row(connection, diagnosis)  # which rejects unusable models
    return models.adopt(connection, root, diagnosis, sender)


def version(row: AnyRow) -> ModelVersion:
    """A model without its evidence."""
    names = [name for name in ModelVersion.model_fields if name not in ("diagnosis_id", "campaign_id")]
    values = {name: getattr(row, f"model_{name}") for name in names}
    return ModelVersion(**values, diagnosis_id=row.id, campaign_id=row.campaign_id)


def entry(connection: Connection, row: AnyRow) -> ModelEntry:
    """A model with the evidence of its diagnosis."""
    report = diagnoses.report_of(connection, row.number)
    assert report is not None
    model = of_row(connection, row)
    return ModelEntry(
        **version(row).model_dump(),
        outdated=diagnoses.outdated(row),
        **{name: report[name] for name in ("mechanisms", "probability", "statement", "fit", "provenance")},
        needs=list(model.needs),
        depends_on_frequency=bool(model.of_lines),
    )


def requested_model(store: Database, request: PressedSkinColumns) -> ModelInForce:
    """The model named by a request."""
    if request.skin_id is None:
        raise required("skin_id", "is required with model adopted")
    if "contact" in request.model_fields_set:
        raise conflicting("contact", request.contact, "must be left out with model adopted: the diagnosis decided")
    return model_in_force(store, request.skin_id)


@dataclass(frozen=True)
class RowsUnderModel:
    """The rows of a request under an adopted model."""

    model_in_force: ModelInForce
    columns: Mapping[str, Floats]  # as in the answer, those that an adopted model provides
    level: Floats  # (rows,) FRF over d33 on the plateau [-]
    inside: NDArray[np.bool_]  # (rows,)
    _request: PressedSkinColumns
    _respond: "partial[_Responses]"  # of the distinct rows, at frequencies
    _which: NDArray[np.intp]  # of each row
    _by_paper: Callable[[Mask], Words | None]  # which limit of the paper's model each row exceeds that is not inside

    def limits(self, inside: Mask) -> Words | None:
        """For each row outside the domain the limit that it exceeds; None if all are inside."""
        limits = self._by_paper(inside)
        return limits and [_OUTSIDE if words == NOT_FINITE else words for words in limits]

    def response(self, frequency_hz: Floats) -> Complexes:
        """FRF over d33 (rows, lines) [-]."""
        return self._respond(frequency_hz)[0][self._which]

    def require_lines(self, field: str) -> None:
        """Raises InvalidInput that names `field` where the model depends on frequency and it was not given."""
        if self.model_in_force.model.of_lines and getattr(self._request, field) is None:
            names = " and ".join(self.model_in_force.model.of_lines)
            raise required(field, f"is required: the adopted model depends on frequency ({names})")


def press(model_in_force: ModelInForce, table: SigmaTable, request: PressedSkinColumns, count: int) -> RowsUnderModel:
    """The `count` rows of a request under an adopted model; raises InvalidInput."""
    given = {name: request.column(name) for name in FIELDS}
    transmitted = pressed(table, given, request.units_checked)  # which checks them
    model_in_force.model.require_skin(given)
    for name, mechanism in model_in_force.model.needs.items():
        if getattr(request, name) is None:
            raise required(name, f"is required: the adopted model has {mechanism}")
    rows = _distinct_columns(request, given)
    stacked = np.column_stack([np.broadcast_to(column, (count,)) for column in rows.values()])
    distinct, which = np.unique(stacked, axis=0, return_inverse=True)
    by_row = dict(zip(rows, distinct.T, strict=True))
    respond = partial(_response, model_in_force.model, request, table, by_row)
    level, inside = respond(None)
    which = which.reshape(-1)
    on_plateau = level[:, 0].real[which]
    on_plateau = np.where(inside[which], on_plateau, np.nan)
    none = np.full((), np.nan)
    columns = {
        "contact_radius_mm": none,
        "a_over_h": none,
        "rt_over_h": transmitted.rt_over_h,
        "load_parameter": none,
        "sigma": on_plateau / gain(1.0, transmitted.rt_over_h),
        "rel_error": np.hypot(transmitted.rel_error, model_in_force.model.unsure),
        "mean_stress_mpa": none,
    }
    by_paper = partial(_limits, table, transmitted, given, count)
    return RowsUnderModel(model_in_force, columns, on_plateau, inside[which], request, respond, which, by_paper)


def _limits(
    table: SigmaTable, transmitted: Transmission, given: Mapping[str, Floats], count: int, inside: Mask
) -> Words | None:
    return limits_of_pressed(table, transmitted, given, inside, count)


def _distinct_columns(request: PressedSkinColumns, given: Mapping[str, Floats]) -> dict[str, Floats]:
    columns = {name: given[name] for name in ("indenter_radius_mm", "preload_n")}
    for name in ("offset_x_mm", "offset_y_mm"):
        columns[name] = np.zeros(()) if getattr(request, name) is None else finite(name, request.column(name))
    for name in ("dynamic_force_n", "dwell_s", "load_cycles"):
        if getattr(request, name) is not None:
            columns[name] = non_negative(name, request.column(name))
    return columns


def _response(
    model: AdoptedModel,
    request: PressedSkinColumns,
    table: SigmaTable,
    rows: Mapping[str, Floats],
    frequency_hz: Floats | None,
) -> _Responses:
    """FRF over d33 (rows, lines), on the plateau where there are no frequencies, and which rows are inside."""
    lines = _ANY_LINE if frequency_hz is None else frequency_hz
    count = len(rows["preload_n"])
    if count * len(lines) > _LARGEST_LINES:
        allowed = f"different rows times frequencies must be at most {_LARGEST_LINES} with an adopted model"
        raise out_of_range("frequency_hz", f"{count} rows, {len(lines)} frequencies", allowed)
    conditions = frf_conditions(model.skin, sensor=request.sensor, frequency_hz=lines, **rows)
    response = model.response(conditions, table, level=frequency_hz is None)
    return response.value.reshape(count, -1), np.logical_and.reduce(response.inside.reshape(count, -1), axis=1)


def require_paper(request: PressedSkinColumns) -> None:
    """Raises InvalidInput for a field that only an adopted model uses."""
    for name in ("skin_id", "sensor", *ADOPTED_COLUMNS):
        if getattr(request, name) is not None:
            given = np.asarray(getattr(request, name)).tolist()
            raise conflicting(name, given, "is used only with model adopted")
