"""The model of a skin, as pages head it: what it adds, since when and until when, and d33 by it beside the paper's."""

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import Connection

from service.pages.shared.verdicts import mechanisms_of
from service.problems import Refusal
from service.schemas.diagnoses import ModelVersion
from service.store import AnyRow, Conflict, Database, diagnoses
from service.usecases import adopted_models, d33_cache
from underskin import InvalidInput
from underskin.diagnosis.data.names import in_words
from underskin.surrogate.sigma_table import SigmaTable


class AdoptedVersion(ModelVersion):
    """A model that was adopted; `outdated`: why it serves no figures, None where it does."""

    mechanisms: str
    outdated: str | None


def of_rows(connection: Connection, rows: Sequence[AnyRow]) -> list[AdoptedVersion]:
    """Of rows of models."""
    reports = diagnoses.reports_of(connection, [row.number for row in rows])
    return [
        AdoptedVersion(
            **adopted_models.version(row).model_dump(),
            mechanisms=in_words(mechanisms_of(reports[row.number])),
            outdated=diagnoses.outdated(row),
        )
        for row in rows
    ]


def answer_by_it(store: Database, table: SigmaTable, row: AnyRow) -> tuple[Mapping[str, Any] | None, str | None]:
    """d33 of a campaign by the model in force, or why there is none."""
    try:
        return d33_cache.by_model(store, table, row, "adopted"), None
    except (InvalidInput, Conflict, Refusal) as error:
        return None, str(error)


def change_percent(by_paper: float | None, by_model: float | None) -> float | None:
    """How far d33 by the adopted model lies above the paper's [%]."""
    return None if not by_paper or by_model is None else 100 * (by_model / by_paper - 1)
