"""The stress in the layer under a sphere."""

from typing import Any

import numpy as np

from service.schemas.field import FieldAnswer, FieldQuery
from service.usecases.tables import requested_contact
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.prediction.answers import lab_columns
from underskin.prediction.stress_field import field_from_lab
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import to_lab

_OPTIONS = {"contact", "r_points", "depth_points", "units_checked"}


def field_answer(table: SigmaTable, query: FieldQuery) -> FieldAnswer:
    """The stress that is asked for; raises InvalidInput."""
    values = query.model_dump(exclude=_OPTIONS)
    contact = requested_contact(table, query.contact)
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
