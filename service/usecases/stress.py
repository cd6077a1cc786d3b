"""Charge on every sensor of an array under several contacts or a pressure map."""

from service.problems import Refusal
from service.schemas.columns import Columns
from underskin.array_stress.answer import answer
from underskin.array_stress.request import LoadCase
from underskin.errors import TableError
from underskin.surrogate.influence_table import InfluenceTable


def stress(table: InfluenceTable, request: LoadCase) -> Columns:
    """Charge and stress on each sensor."""
    try:
        result = answer(table, request)
    except TableError as error:
        raise Refusal(503, str(error)) from error
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
