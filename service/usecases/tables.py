"""The tables in use (domain and origin of each; those other than σ's are read when a request first needs them), and
the answers that are read from them: σ, the stress under a sphere, the charge of an array."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from service.schemas.columns import Columns
from service.schemas.field import FieldAnswer, FieldQuery
from service.schemas.sigma import SigmaColumns
from service.schemas.tables import TableAxis, TableEntry, Tables
from underskin.array_stress.answer import answer
from underskin.array_stress.request import LoadCase
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.prediction import answers
from underskin.prediction.answers import lab_columns
from underskin.prediction.columns import rows
from underskin.prediction.stress_field import field_from_lab
from underskin.surrogate.hdf5_format import CONTACT_TABLE, ContactTable, load_contact
from underskin.surrogate.influence_table import INFLUENCE_TABLE, InfluenceTable, load_influence
from underskin.surrogate.sigma_table import SigmaTable
from underskin.surrogate.solved_contact import contact_model
from underskin.units import to_lab

_NAMED = {"schema", "data_sha256", "default"}
_OPTIONS = {"contact", "r_points", "depth_points", "units_checked"}


@cache
def influence_table(folder: Path) -> InfluenceTable:
    """γ_n and γ_t; raises TableError."""
    return load_influence(folder / INFLUENCE_TABLE)


@cache
def _contact_table(folder: Path) -> ContactTable:
    """The finite-strain contact; raises TableError."""
    return load_contact(folder / CONTACT_TABLE)


def tables(sigma_table: SigmaTable, folder: Path) -> Tables:
    """The tables that answers come from; those of `folder` beside that of σ."""
    return Tables(tables=[_entry(sigma_table), _entry(influence_table(folder)), _entry(_contact_table(folder))])


def _entry(table: SigmaTable | InfluenceTable | ContactTable) -> TableEntry:
    axes = [
        TableAxis(name=name, low=low, high=high, nodes=len(nodes))
        for (name, (low, high)), nodes in zip(table.domain.items(), table.axes, strict=True)
    ]
    about = {name: np.asarray(value).tolist() for name, value in table.attributes.items() if name not in _NAMED}
    schema = str(table.attributes["schema"])
    name = str(table.attributes["quantity"])
    return TableEntry(name=name, table_schema=schema, table_sha256=table.sha256, axes=axes, about=about)


def sigma(table: SigmaTable, _: object, request: SigmaColumns) -> Columns:
    """σ for each row; the store, from which other answers take adopted models, is not used."""
    columns = {name: request.column(name) for name in ("a_over_h", "rt_over_h", "load_parameter")}
    count = rows(columns)
    answer = answers.sigma(table, columns, request.model)
    return Columns(
        rows=count,
        model=request.model,
        table_sha256=table.sha256 if request.model == "layer" else None,
        inside=answer.inside,
        columns=answer.columns,
        limits=answer.limits,
    )


def stress(table: InfluenceTable, request: LoadCase) -> Columns:
    """Charge and stress on each sensor."""
    result = answer(table, request)
    return Columns(
        rows=len(result.sensors),
        model="linear_layer",
        table_sha256=table.sha256,
        inside=result.inside,
        shared={
            "contact": request.contact,
            "reach_mm": result.reach_mm,
            "contact_radius_mm": result.contact_radius_mm,
            "findings": [finding.in_columns() for finding in result.findings],
        },
        names={"sensor": result.sensors},
        columns=result.columns,
        limits=result.limits,
    )


def field_answer(table: SigmaTable, query: FieldQuery) -> FieldAnswer:
    """The stress that is asked for; raises InvalidInput."""
    values = query.model_dump(exclude=_OPTIONS)
    contact = contact_model(table, query.contact)
    field = field_from_lab(contact, values, query.r_points, query.depth_points, units_checked=query.units_checked)
    inside, tabulated = bool(field.contact.inside[0]), query.poisson_ratio == INCOMPRESSIBLE
    return FieldAnswer(
        model="layer" if tabulated else "linear_layer",
        contact=contact.name,
        table_sha256=contact.sha256,
        status="ok" if inside else "out_of_domain",
        limit=field.limits[0],
        **{name: _number(np.ravel(column)[0]) for name, column in lab_columns(field.contact).items()},
        section_error=_number(field.section_error[0]) if tabulated else None,
        r_mm=to_lab("r_mm", field.r).tolist() if inside else None,
        depth_mm=to_lab("depth_mm", field.depth).tolist() if inside else None,
        sigma_zz_mpa=to_lab("sigma_zz_mpa", field.sigma_zz[0]).tolist() if inside else None,
    )


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None
