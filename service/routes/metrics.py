"""Counts and durations of requests, free disk and the rest of what the service measures, for Prometheus."""

import shutil
from pathlib import Path

from fastapi import APIRouter, Response
from prometheus_client import CONTENT_TYPE_LATEST, Gauge, generate_latest
from starlette.concurrency import run_in_threadpool

from service.middleware import request_log

router = APIRouter(tags=["metrics"])

_FREE = Gauge("underskin_disk_free_bytes", "Free on the disk of the data folder; NaN where the folder is gone.")


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
    operation_id="metrics",
    summary="Metrics for Prometheus",
    response_class=Response,
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
async def metrics() -> Response:
    """In Prometheus' text format."""
    request_log.flush()
    return Response(await run_in_threadpool(generate_latest), media_type=CONTENT_TYPE_LATEST)
