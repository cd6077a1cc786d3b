"""Dependencies of routes and pages, as annotated types."""

from collections.abc import Awaitable, Callable
from typing import Annotated, Any

from fastapi import Depends, Path, Query, Request

from service.auth.access_control import SAFE, AccessControl
from service.auth.keys import Key
from service.jobs.planner import Planner
from service.jobs.runner import Runner
from service.problems import Refusal
from service.store import Database
from underskin.errors import wrong_type
from underskin.surrogate.sigma_table import SigmaTable


def _of_app(name: str) -> Callable[[Request], Awaitable[Any]]:
    """What the application holds under a name."""

    async def held(request: Request) -> Any:
        return getattr(request.app.state, name)

    return held


Table = Annotated[SigmaTable, Depends(_of_app("table"))]
RunnerInUse = Annotated[Runner, Depends(_of_app("runner"))]
PlannerInUse = Annotated[Planner, Depends(_of_app("planner"))]
Access = Annotated[AccessControl, Depends(_of_app("access"))]
# For routes that keep nothing, whatever their method.
StoreToRead = Annotated[Database, Depends(_of_app("store"))]


def _store(request: Request, store: StoreToRead) -> Database:
    """The store; raises StoreMoved for a request that may change it while its files are not in place."""
    if request.method not in SAFE:
        store.require_in_place()
    return store


Store = Annotated[Database, Depends(_store)]

CampaignId = Annotated[str, Path(description="Id of a campaign, as it was answered when it was sent.")]
DiagnosisId = Annotated[str, Path(description="Id of a diagnosis, as it was answered when it was asked for.")]
SkinId = Annotated[str, Path(description="Id of a skin.")]
Limit = Annotated[int, Query(ge=1, le=200, description="How many on a page.")]
Cursor = Annotated[str | None, Query(description="`next` of the page before.")]


def _may_change(request: Request) -> None:
    """Rejects a request to change what is kept if its key has scope read; whether a key is required was checked
    before."""
    key: Key | None = request.scope["key"]
    if request.method not in SAFE and key is not None and key.scope != "write":
        raise Refusal(
            403,
            f"Key {key.name!r} has scope read; this needs one of scope write: underskin key create NAME --scope write",
        )


MAY_CHANGE = Depends(_may_change)  # of every route but those whose POST only computes


def sender(request: Request) -> str | None:
    """Name of the API key that a request came with."""
    key: Key | None = request.scope["key"]
    return None if key is None else key.name


def number_of_cursor(cursor: str | None) -> int | None:
    """The number that a page of a list ended with; raises InvalidInput."""
    if cursor is None:
        return None
    if not cursor.isascii() or not cursor.isdigit() or len(cursor) > 18:
        raise wrong_type("cursor", cursor, "must be the `next` of the page before")
    return int(cursor)
