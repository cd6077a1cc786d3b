"""The pages: what a browser sees of the service, without JavaScript to build and with nothing from outside."""

from fastapi import APIRouter
from fastapi.routing import APIRoute

from service.pages import (
    assets,
    campaign,
    design,
    diagnosis,
    example,
    joining,
    loads,
    login,
    measured,
    plan,
    pressure_map,
    skin,
    start,
    tables,
    upload,
)

_PAGES = (
    start,
    skin,
    campaign,
    diagnosis,
    plan,
    upload,
    design,
    example,
    joining,
    loads,
    pressure_map,
    measured,
    tables,
    login,
    assets,
)

router = APIRouter(include_in_schema=False)
for page in _PAGES:
    router.include_router(page.router)


def methods(path: str) -> list[str]:
    """All that a page's path takes; pages are not in the OpenAPI document."""
    found = {
        method
        for page in _PAGES
        for route in page.router.routes
        if isinstance(route, APIRoute) and route.path == path
        for method in route.methods or ()
    }
    return sorted(found)
