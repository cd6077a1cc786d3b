"""The pages: what a browser sees of the service, without JavaScript to build and with nothing from outside."""

from fastapi import APIRouter

from service.pages import assets, campaign, design, diagnosis, example, joining, loads, login, skin, start, upload

router = APIRouter(include_in_schema=False)
for page in (start, skin, campaign, diagnosis, upload, design, example, joining, loads, login, assets):
    router.include_router(page.router)
