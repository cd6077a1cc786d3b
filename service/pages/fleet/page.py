"""Fleets: skins of one make are chosen, named and diagnosed together; what was diagnosed before."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from service.dependencies import WRITE, RunnerInUse, Store, Table, sender
from service.pages.shared import same_request, verdicts
from service.pages.shared.forms import Form, see
from service.pages.shared.html import page
from service.problems import validated
from service.schemas.diagnoses import FEWEST_SKINS, AskForFleet
from service.store import diagnoses, skins
from service.usecases import diagnoses as usecase

router = APIRouter(prefix="/fleets")

_ON_A_PAGE = 200  # skins, as many as a form may choose
_LATEST = 20  # diagnoses
_CHOSEN = "skin-"  # names of the boxes begin so


@router.get("")
def fleets(
    request: Request,
    store: Store,
    find: Annotated[str, Query(max_length=200)] = "",
    after: Annotated[str | None, Query(max_length=200)] = None,
) -> Response:
    """The skins to choose from, by id."""
    with store.reading() as connection:
        rows = skins.listed(connection, find or None, after, _ON_A_PAGE + 1)
        before = diagnoses.listed(connection, diagnoses.DiagnosisFilters(kind="fleet"), None, _LATEST)
        verdict_of = verdicts.of_rows(connection, before)
    example = {"skins": [row.id for row in rows[:FEWEST_SKINS]], "name": "the fleet"}
    return page(
        request,
        "fleets.html",
        rows=rows[:_ON_A_PAGE],
        following=rows[_ON_A_PAGE - 1].id if len(rows) > _ON_A_PAGE else None,
        find=find,
        fewest=FEWEST_SKINS,
        chosen=_CHOSEN,
        diagnoses=list(verdict_of.values()),
        same=same_request.post(
            request,
            "/v1/fleets/diagnosis",
            example,
            f"client.fleets.diagnose({example['skins']!r}, {example['name']!r})",
        ),
    )


@router.post("/diagnosis", dependencies=WRITE)
def ask(request: Request, sent: Form, runner: RunnerInUse, store: Store, table: Table) -> Response:
    """Puts the diagnosis of the chosen skins into the queue; one that there is already is shown."""
    chosen = [value for name, value in sent.items() if name.startswith(_CHOSEN)]
    asked = validated(AskForFleet, {"skins": chosen, "name": sent.get("name", "").strip()})
    row = store.write(usecase.ask_of_fleet, table, sender(request), asked)
    runner.stir()
    return see(f"/diagnoses/{row.id}")
