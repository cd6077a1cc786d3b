"""Files that are sent to the upload page."""

import httpx
from playwright.sync_api import FilePayload

from tests.service.pages.conftest import Visit
from tests.support.store_server import Server


def file(name: str, content: bytes | str) -> FilePayload:
    return {"name": name, "mimeType": "", "buffer": content.encode() if isinstance(content, str) else content}


def look_at(visitor: Visit, files: list[FilePayload], *, rig: str = "", skin: str = "", estimator: str = "") -> None:
    page = visitor.page
    visitor.go("/upload")
    page.get_by_label("Files").set_input_files(files)
    page.get_by_label("Skin").fill(skin)
    page.get_by_label("Estimator").select_option(estimator)
    if rig:
        page.get_by_label("Rig description").set_input_files(file("rig.yaml", rig))
    page.get_by_role("button", name="Look at them").click()
    page.wait_for_url("**/upload/*")


def as_json(document: dict[str, object]) -> str:
    return httpx.Request("POST", "http://x", json=document).content.decode()


def campaigns_of(server: Server, skin: str) -> list[str]:
    answer = server.http.get("/v1/campaigns", params={"skin": skin}).json()
    return [entry["id"] for entry in answer["campaigns"]]
