"""Why the paper's model says nothing of a measured value, on the page of a few of them."""

from collections.abc import Mapping
from typing import Any

from service.schemas.columns_answer import Columns
from underskin.prediction.domain_checks import RowConditions, beyond
from underskin.surrogate.sigma_table import SigmaTable


def reasons(document: Mapping[str, Any], answer: Columns, table: SigmaTable) -> list[str]:
    """Of each row outside the table, which value is and what is allowed; `document`: the request of the answer."""
    numbers = [answer.full(name) for name in ("a_over_h", "rt_over_h", "load_parameter")]
    status = answer.status()
    skin = document["youngs_modulus_mpa"], document["poisson_ratio"]
    return [
        f"row {row + 1}, " + beyond(RowConditions(force, radius, *skin), [float(part[row]) for part in numbers], table)
        for row, (force, radius) in enumerate(zip(document["preload_n"], document["indenter_radius_mm"], strict=True))
        if status[row] != "ok"
    ]
