"""Models of skins: adopted from explained diagnoses, in force until another is, or until they are withdrawn."""

from typing import Annotated

from fastapi import APIRouter, Query, Security
from fastapi.responses import JSONResponse
from sqlalchemy import Connection

from service.dependencies import SkinId, Store, authorised
from service.middleware.unique_keys import JsonRoute
from service.problems import Refusal
from service.routes.idempotency import IdempotentOnce
from service.schemas import diagnoses as answers
from service.schemas.campaigns import Reason
from service.store import diagnoses, models, skins
from service.store.errors import Conflict
from service.store.tables import AnyRow
from service.usecases.adopted_models import of_row

router = APIRouter(prefix="/v1", tags=["skins"], route_class=JsonRoute)

WRITE = [Security(authorised, scopes=["write"])]


@router.post(
    "/skins/{skin_id}/model",
    operation_id="adopt_model",
    summary="Adopt a model",
    status_code=201,
    dependencies=WRITE,
    responses={201: {"model": answers.ModelEntry}},
)
def adopt(skin_id: SkinId, adoption: answers.Adoption, once: IdempotentOnce, store: Store) -> JSONResponse:
    """Makes an explained diagnosis the skin's model: `/v1/frf`, `/v1/d33`, the d33 of campaigns and the history serve
    it on request from now on. Adopted already, it is answered as it is."""

    def act(connection: Connection) -> dict[str, object]:
        return _entry(connection, adopted(connection, skin_id, adoption.diagnosis_id, once.sender)).model_dump()

    return JSONResponse(once.answer(store, adoption.diagnosis_id, act), status_code=201)


def adopted(connection: Connection, skin_id: str, diagnosis_id: str, sender: str | None) -> AnyRow:
    """The model that a diagnosis has become; raises Conflict, Missing, and InvalidInput where it cannot serve."""
    root = skins.require_root(connection, skin_id)
    diagnosis = diagnoses.find(connection, diagnosis_id)
    if diagnosis.state != "done":
        raise Conflict(f"Diagnosis {diagnosis.id!r} has no report: its state is {diagnosis.state}.")
    of_row(connection, diagnosis)  # which refuses what cannot serve
    return models.adopt(connection, root, diagnosis, sender)


@router.delete(
    "/skins/{skin_id}/model", operation_id="withdraw_model", summary="Withdraw the model in force", dependencies=WRITE
)
def withdraw(
    skin_id: SkinId,
    reason: Annotated[Reason, Query(description="Why; kept with it.")],
    once: IdempotentOnce,
    store: Store,
) -> answers.ModelVersion:
    """Has no model in force, as before the first adoption: the paper's model serves. Nothing is deleted: the version
    stays, and says when, by whom and why it was withdrawn; 404 where none was in force."""

    def act(connection: Connection) -> dict[str, object]:
        root = skins.require_root(connection, skin_id)
        return _version(models.withdraw(connection, root, reason, once.sender)).model_dump()

    return answers.ModelVersion(**once.answer(store, {"withdraw": reason}, act))


@router.get("/skins/{skin_id}/model", operation_id="skin_model", summary="The model in force")
def in_force(skin_id: SkinId, store: Store) -> answers.ModelEntry:
    """With the campaign and the evidence that it comes from; 404 where there is none."""
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        row = models.in_force(connection, root)
        if row is None:
            raise Refusal(404, f"Skin {skin_id!r} has no adopted model.")
        return _entry(connection, row)


@router.get("/skins/{skin_id}/model/versions", operation_id="skin_model_versions", summary="All models it ever had")
def versions(skin_id: SkinId, store: Store) -> answers.ModelVersions:
    """Nothing is deleted: of the skin and of those joined to it."""
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        found = [_entry(connection, row) for row in models.of_skin(connection, root)]
    return answers.ModelVersions(skin_id=root, models=found)


def _version(row: AnyRow) -> answers.ModelVersion:
    return answers.ModelVersion(
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


def _entry(connection: Connection, row: AnyRow) -> answers.ModelEntry:
    report = diagnoses.report_of(connection, row.number)
    assert report is not None
    model = of_row(connection, row)
    return answers.ModelEntry(
        **_version(row).model_dump(),
        outdated=diagnoses.outdated(row),
        **{name: report[name] for name in ("mechanisms", "probability", "statement", "fit", "provenance")},
        needs=list(model.needs),
        depends_on_frequency=bool(model.of_lines),
    )
