"""The start: skins at a glance, and an example skin kept by one click."""

import hashlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy import Connection
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool

from service.dependencies import Store, Table, number_of_cursor, sender
from service.ingest.accept import IngestOptions, accept
from service.ingest.uploads import Upload
from service.pages.shared import same_request, verdicts
from service.pages.shared.figures import prepare
from service.pages.shared.forms import FORM_OF_SESSION, see
from service.pages.shared.html import page
from service.pages.shared.verdicts import attention
from service.problems import Refusal
from service.store import Database, campaigns, overview, skins
from service.usecases import d33_cache, mechanism_catalogue
from service.usecases.scheduled_backups import ScheduledBackups
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter()


_WIDTH, _HEIGHT, _EDGE = 120, 28, 3
_LEAST_SPAN = 0.2  # of the values, over the height
SKIN = "example"
_FOLDER = Path(__file__).parent / "example"
_ON_A_PAGE = 25


@dataclass(frozen=True)
class Sparkline:
    """Points of an SVG polyline, its last point, and what it shows in words."""

    width: int
    height: int
    points: str
    end: tuple[float, float]
    words: str


def sparkline(values: Sequence[tuple[str, float]]) -> Sparkline | None:
    """d33 [pC/N] over time (ISO 8601), by time; None where there are fewer than two."""
    if len(values) < 2:
        return None
    moments = [datetime.fromisoformat(time).timestamp() for time, _ in values]
    numbers = [value for _, value in values]
    x = _scaled(moments, _WIDTH)
    # No less than a fifth of the value, so that a scatter of a few per cent looks like one.
    middle = (min(numbers) + max(numbers)) / 2
    half = max(max(numbers) - middle, _LEAST_SPAN / 2 * abs(middle))
    low, high = middle - half, middle + half
    y = [_HEIGHT - _EDGE - (value - low) / ((high - low) or 1.0) * (_HEIGHT - 2 * _EDGE) for value in numbers]
    pairs = list(zip(x, y, strict=True))
    change = f"d33 {numbers[0]:.3g} to {numbers[-1]:.3g} pC/N, {values[0][0][:10]} to {values[-1][0][:10]}"
    return Sparkline(_WIDTH, _HEIGHT, " ".join(f"{px:.1f},{py:.1f}" for px, py in pairs), pairs[-1], change)


def _scaled(values: Sequence[float], length: int) -> list[float]:
    span = (values[-1] - values[0]) or 1.0
    return [_EDGE + (value - values[0]) / span * (length - 2 * _EDGE) for value in values]


@router.post("/example", dependencies=[FORM_OF_SESSION])
async def load(request: Request, store: Store, table: Table) -> Response:
    """Store the example's campaigns once; again if all were withdrawn."""
    withdrawn = await run_in_threadpool(store.read, _withdrawn)
    if withdrawn is None:
        return see(f"/skins/{SKIN}")
    uploads = [_upload(file) for file in sorted(_FOLDER.glob("*.json"))]
    request_text = f"the example skin, {withdrawn} withdrawn" if withdrawn else "the example skin"
    options = IngestOptions(request.app.state.settings, sender(request), skin=SKIN, idempotency_key=request_text)
    answer, _ = await run_in_threadpool(accept, store, uploads, options)
    await run_in_threadpool(d33_cache.derive, store, table, [campaign["id"] for campaign in answer["campaigns"]])
    return see(f"/skins/{SKIN}")


def _withdrawn(connection: Connection) -> int | None:
    """How many campaigns the skin had, all of which were withdrawn; None where one is in use."""
    skin = skins.find(connection, SKIN)
    rows = [] if skin is None else campaigns.of_skin(connection, skin.root_id)
    return None if any(campaigns.state(row) == "current" for row in rows) else len(rows)


def _upload(file: Path) -> Upload:
    return Upload(file, file.name, "file", hashlib.sha256(file.read_bytes()).hexdigest(), in_form=True)


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
