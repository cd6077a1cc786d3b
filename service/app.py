"""The application: routes by noun on FastAPI."""

from fastapi import APIRouter, FastAPI

from service import d33, frf, health, sigma, tables
from service.handlers import install_handlers
from service.settings import Settings
from underskin import __version__
from underskin.surrogate import SigmaTable


def create_api(settings: Settings, table: SigmaTable) -> FastAPI:
    """All routes, with the table they answer from."""
    api = FastAPI(title="underskin", version=__version__, docs_url=None, redoc_url=None)
    api.state.settings = settings
    api.state.table = table
    install_handlers(api)
    v1 = APIRouter(prefix="/v1")
    for noun in (sigma, frf, d33, tables):
        v1.include_router(noun.router)
    api.include_router(v1)
    api.include_router(health.router)
    return api
