"""Models of skins: adopted from explained diagnoses, and shown with their evidence."""

from sqlalchemy import Connection

from service.schemas.diagnoses import ModelEntry, ModelVersion
from service.store import diagnoses, models, skins
from service.store.errors import Conflict
from service.store.tables import AnyRow
from service.usecases.adopted_models import of_row


def adopt(connection: Connection, skin_id: str, diagnosis_id: str, sender: str | None) -> AnyRow:
    """Make a diagnosis the model of a skin; raises Conflict, Missing, and InvalidInput where it cannot serve."""
    root = skins.require_root(connection, skin_id)
    diagnosis = diagnoses.find(connection, diagnosis_id)
    if diagnosis.state != "done":
        raise Conflict(f"Diagnosis {diagnosis.id!r} has no report: its state is {diagnosis.state}.")
    of_row(connection, diagnosis)  # which refuses what cannot serve
    return models.adopt(connection, root, diagnosis, sender)


def version(row: AnyRow) -> ModelVersion:
    """A model without its evidence."""
    return ModelVersion(
        id=row.model_id,
        version=row.model_version,
        skin_id=row.model_skin,
        adopted_at=row.adopted_at,
        adopted_from=row.adopted_from,
        diagnosis_id=row.id,
        campaign_id=row.campaign_id,
        withdrawn_at=row.model_withdrawn_at,
        withdrawn_from=row.model_withdrawn_from,
        withdraw_reason=row.model_withdraw_reason,
    )


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
