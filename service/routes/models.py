"""Models of skins: adopted from explained diagnoses, in force until another is, or until they are withdrawn."""

from typing import Annotated

from fastapi import APIRouter, Query
from fastapi.responses import JSONResponse
from sqlalchemy import Connection

from service.dependencies import SkinId, Store
from service.middleware.json_bodies import JsonRoute
from service.problems import Refusal
from service.routes.idempotency import Idempotent
from service.schemas import diagnoses as answers
from service.schemas.campaigns import ReasonText
from service.store import models, skins
from service.usecases import adopted_models as usecase

router = APIRouter(prefix="/v1", tags=["skins"], route_class=JsonRoute)


@router.post(
    "/skins/{skin_id}/model", summary="Adopt a model", status_code=201, responses={201: {"model": answers.ModelEntry}}
)
def adopt_model(skin_id: SkinId, adoption: answers.Adoption, idempotency: Idempotent) -> JSONResponse:
    """Makes an explained diagnosis the skin's model: `/v1/frf`, `/v1/d33`, the d33 of campaigns and the history serve
    it on request from now on. Adopted already, it is answered as it is."""

    def act(connection: Connection) -> dict[str, object]:
        adopted = usecase.adopt(connection, skin_id, adoption.diagnosis_id, idempotency.sender)
        return usecase.entry(connection, adopted).model_dump()

    # As it was kept: an earlier version may have answered with other fields.
    return JSONResponse(idempotency.answer(adoption.diagnosis_id, act), status_code=201)


@router.delete("/skins/{skin_id}/model", summary="Withdraw the model in force")
def withdraw_model(
    skin_id: SkinId, reason: Annotated[ReasonText, Query(description="Why; kept with it.")], idempotency: Idempotent
) -> answers.ModelVersion:
    """Has no model in force, as before the first adoption: the paper's model serves. Nothing is deleted: the version
    stays, and says when, by whom and why it was withdrawn; 404 where none was in force."""

    def act(connection: Connection) -> dict[str, object]:
        root = skins.require_root(connection, skin_id)
        return usecase.version(models.withdraw(connection, root, reason, idempotency.sender)).model_dump()

    return answers.ModelVersion(**idempotency.answer({"withdraw": reason}, act))


@router.get("/skins/{skin_id}/model", summary="The model in force")
def skin_model(skin_id: SkinId, store: Store) -> answers.ModelEntry:
    """With the campaign and the evidence that it comes from; 404 where there is none."""
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        row = models.in_force(connection, root)
        if row is None:
            raise Refusal(404, f"Skin {skin_id!r} has no adopted model.")
        return usecase.entry(connection, row)


@router.get("/skins/{skin_id}/model/versions", summary="All models it ever had")
def skin_model_versions(skin_id: SkinId, store: Store) -> answers.ModelVersions:
    """Nothing is deleted: of the skin and of those joined to it."""
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        entries = [usecase.entry(connection, row) for row in models.of_skin(connection, root)]
    return answers.ModelVersions(skin_id=root, models=entries)
