"""The start: skins at a glance."""

from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from starlette.background import BackgroundTask

from service.dependencies import Store, Table, number_of_cursor
from service.pages.shared import same_request, verdicts
from service.pages.shared.attention import attention
from service.pages.shared.figures import prepare
from service.pages.shared.html import page
from service.pages.start.sparkline import sparkline
from service.problems import Refusal
from service.store import Database, overview
from service.usecases import mechanism_catalogue
from service.usecases.scheduled_backups import ScheduledBackups
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter()

_ON_A_PAGE = 25


@router.get("/")
def start(
    request: Request,
    store: Store,
    table: Table,
    find: Annotated[str, Query(max_length=200)] = "",
    before: str | None = None,
) -> Response:
    """The skins, most recently recorded first."""
    with store.reading() as connection:
        glances = overview.glances(connection, find or None, number_of_cursor(before), _ON_A_PAGE + 1, table.sha256)
        shown = glances[:_ON_A_PAGE]
        diagnosed = [glance.diagnosis for glance in shown if glance.diagnosis is not None]
        models = [glance.model for glance in shown if glance.model is not None]
        verdict = verdicts.of_rows(connection, diagnosed, [row.id for row in models])
        adoptions = {adopted.diagnosis_id: adopted for adopted in verdicts.adopted_versions(connection, models)}
    answer = page(
        request,
        "start.html",
        glances=[
            (
                glance,
                sparkline(glance.d33),
                None if glance.diagnosis is None else verdict[glance.diagnosis.id],
                None if glance.model is None else adoptions[glance.model.id],
                attention(glance.by_paper, glance.last),
                verdicts.change_percent(_d33(glance.paper_array), _d33(glance.adopted_array)),
            )
            for glance in shown
        ],
        find=find,
        following=shown[-1].cursor if len(glances) > _ON_A_PAGE else None,
        first=before is None,
        backups=_backups(request),
        same=same_request.get(request, "/v1/skins", "list(client.skins.all())"),
    )
    answer.background = BackgroundTask(_ahead, store, table)
    return answer


def _d33(array: Mapping[str, Any] | None) -> float | None:
    return None if array is None else array["d33_pc_per_n"]


@cache
def _ahead(store: Database, table: SigmaTable) -> None:
    """Load what is slow at first use on the pages linked from here; once."""
    prepare()
    with suppress(Refusal):  # which the page of mechanisms says
        mechanism_catalogue.read_ahead(store, table)


def _backups(request: Request) -> dict[str, Any] | None:
    """The newest scheduled backup, where the server makes any."""
    backups: ScheduledBackups | None = request.app.state.backups
    if backups is None:
        return None
    made_at = None if backups.last is None else backups.last.made_at.isoformat()
    return {"last": made_at, "overdue": backups.overdue}
