"""The open sessions of the reader's own key, each of which can be ended."""

import re

from fastapi import APIRouter, Request, Response

from service.auth import session
from service.auth.access_control import AccessControl
from service.auth.keys import Key
from service.pages.shared.forms import FORM_OF_SESSION, see
from service.pages.shared.html import page

router = APIRouter(prefix="/sessions")


# As browsers name themselves: each also as those that it wants to be taken for, which come later here.
_BROWSERS = {
    "Edg": "Edge",
    "OPR": "Opera",
    "Firefox": "Firefox",
    "HeadlessChrome": "Chrome",
    "Chrome": "Chrome",
    "Version": "Safari",
}
_SYSTEMS = {
    "Android": "Android",
    "iPhone": "iOS",
    "iPad": "iOS",
    "Windows": "Windows",
    "Mac OS": "macOS",
    "Linux": "Linux",
}


@router.get("")
def sessions(request: Request) -> Response:
    """Those that go on, the latest first."""
    key: Key | None = request.scope["key"]
    access: AccessControl = request.app.state.access
    this = session.id_of(session.cookie_in(dict(request.scope["headers"])))
    listed = [] if key is None else access.sessions.listed(key)
    return page(request, "sessions.html", sessions=listed, this=this, browser_name=browser_name)


@router.post("/{session_id}/end", dependencies=[FORM_OF_SESSION])
def end(session_id: str, request: Request) -> Response:
    """End one of them; raises Missing where it is none of this key's."""
    key: Key | None = request.scope["key"]
    if key is not None:
        access: AccessControl = request.app.state.access
        access.sessions.end(session_id, key)
    return see("/sessions")


def browser_name(user_agent: str) -> str:
    """Name and system of a browser by its header User-Agent ("Firefox 140 on Linux"); the header where it is of none
    that is known."""
    for token, name in _BROWSERS.items():
        version = re.search(rf"\b{token}/(\d+)", user_agent)
        if version:
            system = next((system for part, system in _SYSTEMS.items() if part in user_agent), None)
            return f"{name} {version[1]}" + (f" on {system}" if system else "")
    return user_agent
