"""The application: routes by noun on FastAPI, behind the front."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import APIRouter, FastAPI, Security
from starlette.types import ASGIApp

from service import d33, frf, health, metrics, openapi, record, sigma, tables, umbridge
from service.dependencies import authorised
from service.front import Front
from service.gate import Gate
from service.handlers import install_handlers
from service.settings import Settings
from underskin import __version__
from underskin.surrogate import SigmaTable


@asynccontextmanager
async def _lifespan(_: FastAPI) -> AsyncIterator[None]:
    yield
    record.flush()


def create_api(settings: Settings, table: SigmaTable, gate: Gate) -> FastAPI:
    """All routes, with the table they answer from."""
    api = FastAPI(
        title="underskin",
        version=__version__,
        description=openapi.DESCRIPTION,
        docs_url=None,
        redoc_url=None,
        openapi_url=None,
        lifespan=_lifespan,
    )
    api.state.settings = settings
    api.state.table = table
    api.state.gate = gate
    install_handlers(api)
    v1 = APIRouter(dependencies=[Security(authorised, scopes=["read"])])
    for noun in (sigma, frf, d33, tables):
        v1.include_router(noun.router)
    for router in (v1, umbridge.router, health.router, metrics.router, openapi.router):
        api.include_router(router)
    return api


def create_app(settings: Settings, table: SigmaTable, gate: Gate) -> ASGIApp:
    """What the server runs."""
    hot = {
        ("GET", "/v1/sigma"): sigma.hot_route(table),
        ("POST", "/umbridge/Evaluate"): umbridge.hot_route(table),
    }
    return Front(create_api(settings, table, gate), gate, hot)
