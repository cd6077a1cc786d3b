"""The pages that a browser shows: no JavaScript build and nothing loaded from outside."""

from fastapi import FastAPI
from fastapi.routing import APIRoute

from service.pages.array import loads, pressure_map
from service.pages.campaign import changes as campaign_changes
from service.pages.campaign import page as campaign
from service.pages.changes import undo
from service.pages.compare import page as compare
from service.pages.design import page as design
from service.pages.design import search as design_search
from service.pages.diagnosis import page as diagnosis
from service.pages.diagnosis import plan
from service.pages.docs import page as docs
from service.pages.field import page as field
from service.pages.fleet import page as fleet
from service.pages.measured import page as measured
from service.pages.mechanisms import page as mechanisms
from service.pages.shared import assets, workbooks
from service.pages.skin import changes as skin_changes
from service.pages.skin import page as skin
from service.pages.start import example, login, sessions
from service.pages.start import page as start
from service.pages.tables import page as tables
from service.pages.upload import discarding as upload_discarding
from service.pages.upload import downloads as upload_downloads
from service.pages.upload import page as upload

_OF_SKINS = (
    start, example, skin, skin_changes, campaign, campaign_changes, undo, compare, fleet, diagnosis, plan, upload,
    upload_discarding, upload_downloads
)  # fmt: skip
_PAGES = (
    *_OF_SKINS, design, design_search, field, loads, pressure_map, measured,
    tables, mechanisms, docs, login, sessions, assets,
)  # fmt: skip

for _page in _PAGES:
    workbooks.add_to(_page.router)


def add_to(api: FastAPI) -> None:
    """Add the pages to the service; they are not in the OpenAPI document."""
    for page in _PAGES:
        api.include_router(page.router, include_in_schema=False)


def methods(path: str) -> list[str]:
    """All methods of a page's path, which the OpenAPI document does not list."""
    routes = [route for page in _PAGES for route in page.router.routes if isinstance(route, APIRoute)]
    return sorted({method for route in routes if route.path == path for method in route.methods or ()})
