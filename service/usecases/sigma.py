"""σ of points in columns."""

from service.schemas.columns import Columns
from service.schemas.sigma import SigmaColumns
from underskin.prediction import answers
from underskin.prediction.columns import rows
from underskin.surrogate.sigma_table import SigmaTable


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
