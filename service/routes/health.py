"""Whether the service runs, and whether it can do its work, open without a key; what it measures, for Prometheus."""

import os
import shutil
from pathlib import Path
from typing import Literal

from fastapi import APIRouter, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, Gauge, generate_latest
from pydantic import BaseModel, Field
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError
from starlette.concurrency import run_in_threadpool

from service.dependencies import Store, Table
from service.middleware import request_log
from service.problems import Refusal

router = APIRouter()
_FREE = Gauge("underskin_disk_free_bytes", "Free on the disk of the data folder; NaN where the folder is gone.")


class Health(BaseModel):
    """The process answers."""

    status: Literal["ok"] = Field(description="Always `ok`; without an answer the process is not well.")


class Ready(BaseModel):
    """The service can do its work."""

    status: Literal["ready"] = Field(description="Always `ready`; otherwise the answer is a problem, 503.")
    table_sha256: str = Field(description="SHA-256 of the σ table.")


@router.get("/health", tags=["health"], summary="Is the process alive?")
async def health() -> Health:
    """For a container's health check."""
    return Health(status="ok")


@router.get("/ready", tags=["health"], summary="Can it do its work?")
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


def watch_disk(folder: Path) -> None:
    """Have the metrics tell how much is free where `folder` is."""

    def free() -> float:
        try:
            return shutil.disk_usage(folder).free
        except OSError:
            return float("nan")

    _FREE.set_function(free)


@router.get(
    "/metrics",
    tags=["metrics"],
    summary="Metrics for Prometheus",
    response_class=Response,
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
async def metrics() -> Response:
    """In Prometheus' text format."""
    request_log.flush()
    return Response(await run_in_threadpool(generate_latest), media_type=CONTENT_TYPE_LATEST)
