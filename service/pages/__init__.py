"""The pages that a browser shows: no JavaScript build and nothing loaded from outside."""

from fastapi import FastAPI
from fastapi.routing import APIRoute

from service.dependencies import MAY_CHANGE
from service.pages import (
    array,
    campaign,
    changes,
    compare,
    design,
    design_search,
    diagnosis,
    docs,
    field,
    fleet,
    login,
    measured,
    mechanisms,
    plan,
    skin,
    start,
    tables,
)
from service.pages.shared import assets
from service.pages.upload import page as upload

_PAGES = (
    start, skin, campaign, changes, compare, fleet, diagnosis, plan, upload,
    design, design_search, field, array, measured, tables, mechanisms, docs, login, assets,
)  # fmt: skip


_KEEP_NOTHING = (array, login)  # whose forms are for every key


def add_to(api: FastAPI) -> None:
    """Add the pages to the service; they are not in the OpenAPI document."""
    for page in _PAGES:
        guards = [] if page in _KEEP_NOTHING else [MAY_CHANGE]
        api.include_router(page.router, include_in_schema=False, dependencies=guards)


def methods(path: str) -> list[str]:
    """All methods of a page's path, which the OpenAPI document does not list."""
    routes = [route for page in _PAGES for route in page.router.routes if isinstance(route, APIRoute)]
    return sorted({method for route in routes if route.path == path for method in route.methods or ()})
