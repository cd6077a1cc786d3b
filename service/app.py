"""The application: routes by noun on FastAPI, behind the ASGI middleware."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from anyio import to_thread
from fastapi import Depends, FastAPI
from starlette.concurrency import run_in_threadpool
from starlette.types import ASGIApp

from service import pages
from service.auth.access_control import AccessControl
from service.auth.login_throttle import LoginThrottle
from service.dependencies import MAY_CHANGE
from service.ingest.uploads import UploadFolder
from service.jobs.planner import Planner
from service.jobs.process import WorkerProcesses
from service.jobs.runner import Runner
from service.middleware import request_log
from service.middleware.asgi_middleware import AsgiMiddleware
from service.middleware.error_handlers import install_handlers
from service.pages.shared.html import problem_page
from service.pages.upload.pending_uploads import PendingUploads
from service.routes import (
    campaigns,
    changes,
    computed,
    diagnoses,
    exports,
    health,
    mechanisms,
    models,
    openapi,
    skins,
    umbridge,
)
from service.routes.query_guard import known_query
from service.settings import Settings
from service.store import Database
from service.store.write_turns import THREADS
from service.usecases.scheduled_backups import ScheduledBackups
from underskin import __version__
from underskin.surrogate.sigma_table import SIGMA_TABLE, SigmaTable


@asynccontextmanager
async def _lifespan(api: FastAPI) -> AsyncIterator[None]:
    state = api.state
    state.uploads = UploadFolder(state.settings.data)
    state.pending_uploads = PendingUploads(state.uploads.path, state.settings.max_upload_bytes)
    to_thread.current_default_thread_limiter().total_tokens = THREADS
    state.access.requirement.start()
    state.access.sessions.start()
    state.runner.start()
    if state.backups is not None:
        state.backups.start()
    yield
    await run_in_threadpool(state.access.requirement.stop)
    await run_in_threadpool(state.access.sessions.stop)
    await run_in_threadpool(state.runner.stop)
    await run_in_threadpool(state.planner.stop)
    if state.backups is not None:
        await run_in_threadpool(state.backups.stop)
    state.uploads.close()
    state.store.close()
    request_log.flush()


def create_api(settings: Settings, table: SigmaTable, access: AccessControl, store: Database) -> FastAPI:
    """All routes, with the table they answer from and the store."""
    api = FastAPI(
        title="underskin",
        version=__version__,
        description=openapi.DESCRIPTION,
        docs_url=None,
        redoc_url=None,
        openapi_url=None,
        lifespan=_lifespan,
        generate_unique_id_function=lambda route: route.name,  # the functions are called as their operations
    )
    api.state.settings = settings
    api.state.document = openapi.document
    api.state.table = table
    api.state.access = access
    api.state.login_throttle = LoginThrottle()
    api.state.proxies = settings.proxy_networks
    api.state.store = store
    memory_bytes = int(settings.diagnosis_memory_mb * 1e6)
    processes = WorkerProcesses(
        settings.tables / SIGMA_TABLE,
        table.sha256,
        memory_bytes,
        settings.diagnosis_seconds,
        keeps_ready=settings.diagnosis_ready,
    )
    health.watch_disk(settings.data)
    api.state.runner = Runner(store, processes, settings.diagnosis_workers)
    api.state.backups = (
        None
        if settings.backup_to is None
        else ScheduledBackups(store, settings.backup_to, settings.backup_every, settings.backup_keep, settings.data)
    )
    api.state.planner = Planner(store, processes, settings.diagnosis_workers)
    install_handlers(api, problem_page, _methods)
    # Each on its own: FastAPI prepares the routes of a router within a router once more.
    guards = [MAY_CHANGE, Depends(known_query)]
    api.include_router(computed.router, dependencies=[Depends(known_query)])
    of_skins = (campaigns, diagnoses, exports, skins, changes, models)
    for noun in (*of_skins, mechanisms):
        api.include_router(noun.router, dependencies=guards)
    for router in (umbridge.router, health.router, openapi.router):
        api.include_router(router)
    pages.add_to(api)
    return api


def _methods(api: FastAPI, path: str) -> list[str]:
    return openapi.methods(api, path) or pages.methods(path)


def create_app(settings: Settings, table: SigmaTable, access: AccessControl, store: Database) -> ASGIApp:
    """What the server runs."""
    hot = {("GET", "/v1/sigma"): computed.hot_route(table), ("POST", "/umbridge/Evaluate"): umbridge.hot_route(table)}
    return AsgiMiddleware(create_api(settings, table, access, store), access, hot, problem_page)
