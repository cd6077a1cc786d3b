"""Whether the service runs, and whether it can do its work. Open without a key."""

import os
from typing import Literal

from fastapi import APIRouter, Request
from pydantic import BaseModel, Field
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from service.dependencies import Store, Table
from service.problems import Refusal

router = APIRouter(tags=["health"])


class Health(BaseModel):
    """The process answers."""

    status: Literal["ok"] = Field(description="Always `ok`; without an answer the process is not well.")


class Ready(BaseModel):
    """The service can do its work."""

    status: Literal["ready"] = Field(description="Always `ready`; otherwise the answer is a problem, 503.")
    table_sha256: str = Field(description="SHA-256 of the σ table.")


@router.get("/health", operation_id="health", summary="Is the process alive?")
async def health() -> Health:
    """For a container's health check."""
    return Health(status="ok")


@router.get("/ready", operation_id="ready", summary="Can it do its work?")
def ready(request: Request, table: Table, store: Store) -> Ready:
    """Table loaded, data folder writable, the store answering and its files those on the disk; 503 where not."""
    folder = request.app.state.settings.data
    if not os.access(folder, os.W_OK):
        raise Refusal(503, f"The data folder {folder} is not there, or not writable.")
    try:
        with store.reading() as connection:
            connection.execute(text("SELECT 1"))
        store.require_in_place()
    except DBAPIError:
        raise Refusal(503, "The store does not answer.") from None
    return Ready(status="ready", table_sha256=table.sha256)
