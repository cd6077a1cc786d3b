"""Diagnoses: asked for, listed, read, cancelled. They run in service/jobs."""

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import APIRouter, Body, Depends, Query
from sqlalchemy import Connection

from service.dependencies import (
    CampaignId,
    Cursor,
    DiagnosisId,
    Limit,
    RunnerInUse,
    SkinId,
    Store,
    Table,
    number_of_cursor,
)
from service.middleware.json_bodies import JsonRoute
from service.routes.idempotency import Idempotent
from service.schemas import diagnoses as models
from service.store import AnyRow, diagnoses
from service.usecases import diagnoses as usecase

router = APIRouter(prefix="/v1", tags=["diagnoses"], route_class=JsonRoute)


class Queue:
    """Where a diagnosis is asked for: once where the request has an Idempotency-Key."""

    def __init__(self, idempotency: Idempotent, runner: RunnerInUse, table: Table) -> None:
        self.sender, self.table = idempotency.sender, table
        self._idempotency, self._runner = idempotency, runner

    def put(self, body: Any, act: Callable[[Connection], AnyRow]) -> models.Asked:
        """The diagnosis that `act` put into it, or returned if there is the same already; `body` is the request's."""

        def asked(connection: Connection) -> dict[str, Any]:
            return models.Asked.model_validate(act(connection), from_attributes=True).model_dump()

        answer = self._idempotency.answer(body, asked)
        self._runner.stir()
        return models.Asked(**answer)


InQueue = Annotated[Queue, Depends()]


@router.post("/campaigns/{campaign_id}/diagnosis", summary="Ask for its diagnosis", status_code=202)
def diagnose_campaign(
    campaign_id: CampaignId, queue: InQueue, asked: Annotated[models.AskFor, Body(default_factory=models.AskFor)]
) -> models.Asked:
    """Puts it into the queue; excluded recordings are left out. A campaign that was diagnosed as it is now, with this
    table, version and catalogue of mechanisms, is answered with that diagnosis.
    """

    def act(connection: Connection) -> AnyRow:
        return usecase.ask(connection, campaign_id, queue.table, queue.sender, asked.without)

    return queue.put(asked.without or None, act)


@router.post("/skins/{skin_id}/diagnosis", summary="Ask for a diagnosis of its campaigns together", status_code=202)
def diagnose_skin(
    skin_id: SkinId, queue: InQueue, asked: Annotated[models.AskForSkin, Body(default_factory=models.AskForSkin)]
) -> models.Asked:
    """Puts one diagnosis of all of them into the queue, or of those chosen: what acts in all, and since when. The same
    request on campaigns that have not changed is answered with that diagnosis. 409 where fewer than two campaigns in
    use have FRFs.
    """

    def act(connection: Connection) -> AnyRow:
        return usecase.ask_of_skin(connection, skin_id, queue.table, queue.sender, asked)

    return queue.put(asked.model_dump(), act)


@router.post("/fleets/diagnosis", summary="Ask for a diagnosis of several skins together", status_code=202)
def diagnose_fleet(queue: InQueue, asked: models.AskForFleet) -> models.Asked:
    """Puts one diagnosis of all campaigns of these skins into the queue: what they have in common, and which skin
    departs from the others. The same request on campaigns that have not changed is answered with that diagnosis.
    """

    def act(connection: Connection) -> AnyRow:
        return usecase.ask_of_fleet(connection, queue.table, queue.sender, asked)

    return queue.put(asked.model_dump(), act)


@router.get("/diagnoses", operation_id="diagnoses", summary="Diagnoses, the latest first")
def listed(
    store: Store,
    campaign: Annotated[str | None, Query(description="Of this campaign, alone or together with others.")] = None,
    skin: Annotated[str | None, Query(description="Of campaigns of this skin and of those joined with it.")] = None,
    kind: Annotated[models.DiagnosisKind | None, Query(description="Only those of this kind.")] = None,
    state: Annotated[models.State | None, Query(description="Only those in this state.")] = None,
    limit: Limit = 50,
    cursor: Cursor = None,
) -> models.DiagnosisList:
    """Without their reports; a page holds `limit` of them."""
    filters = diagnoses.DiagnosisFilters(campaign, skin, state, kind)
    with store.reading() as connection:
        rows = diagnoses.listed(connection, filters, number_of_cursor(cursor), limit + 1)
        page = [models.DiagnosisEntry(**fields) for fields in usecase.entries(connection, rows[:limit])]
    return models.DiagnosisList(diagnoses=page, next=str(rows[limit - 1].number) if len(rows) > limit else None)


@router.get("/diagnoses/{diagnosis_id}", summary="One diagnosis")
def diagnosis(diagnosis_id: DiagnosisId, store: Store) -> models.Diagnosis:
    """How far it is and, once it is done, its report."""
    with store.reading() as connection:
        row = diagnoses.find(connection, diagnosis_id)
        report = diagnoses.report_of(connection, row.number)
        return models.Diagnosis(**usecase.entry(connection, row), report=report)


@router.delete("/diagnoses/{diagnosis_id}", summary="Cancel a diagnosis")
def cancel_diagnosis(diagnosis_id: DiagnosisId, runner: RunnerInUse, store: Store) -> models.DiagnosisEntry:
    """Ends its process, or takes it out of the queue. One that is done or has failed stays: 409."""
    with store.writing() as connection:
        diagnoses.cancel(connection, diagnosis_id)
        entry = usecase.entry(connection, diagnoses.find(connection, diagnosis_id))
    runner.stir()
    return models.DiagnosisEntry(**entry)
