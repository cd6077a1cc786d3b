"""Logging in with a key, where keys are needed, and the open sessions of the reader's own key."""

import math
import re
from typing import Annotated
from urllib.parse import quote

from fastapi import APIRouter, Query, Request, Response

from service.auth import session
from service.auth.keys import Key
from service.auth.login_throttle import LoginThrottle, client_address, network_of
from service.dependencies import Access
from service.pages.shared.forms import FORM_OF_SESSION, Form, see
from service.pages.shared.html import page, set_session
from service.problems import Refusal

router = APIRouter()

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


@router.get("/login")
def form(
    request: Request, access: Access, back: Annotated[str, Query(alias="next")] = "/", unsent: bool = False
) -> Response:
    """Asks for a key, where one is needed; `unsent`: a form came without a session, and was not taken."""
    if not access.keys_needed():
        return see("/")
    return page(request, "login.html", back=back, unsent=unsent, refused=False, missing=access.keys_missing())


@router.post("/login")
def login(request: Request, access: Access, sent: Form) -> Response:
    """Starts a session."""
    throttle: LoginThrottle = request.app.state.login_throttle
    address = client_address(request, request.app.state.proxies)
    wait_s = throttle.begin(network_of(address))
    if wait_s:
        seconds = math.ceil(wait_s)
        again = f"Too many keys from this address were wrong: try again in {seconds} s."
        raise Refusal(429, again, title="Too many tries", headers={"Retry-After": str(seconds)})
    key = access.key_of_login(sent.get("key", ""))
    back = sent.get("next", "/")
    if key is None:
        request.scope["why"] = "the key that was typed is not known"
        missing = access.keys_missing()
        return page(request, "login.html", status=401, back=back, unsent=False, refused=True, missing=missing)
    throttle.succeeded(network_of(address))
    answer = see(_local_path(back))
    set_session(request, answer, access.sessions.begin(key, address, request.headers.get("user-agent", "")))
    return answer


@router.post("/logout", dependencies=[FORM_OF_SESSION])
def logout(request: Request, access: Access) -> Response:
    """Ends it, for whoever has a copy of its cookie too."""
    key: Key | None = request.scope["key"]
    if key is not None:
        access.sessions.log_out(session.cookie_of(request), key)
    answer = see("/login")
    set_session(request, answer, session.anonymous())
    return answer


def _local_path(path: str) -> str:
    """An address of this server, already quoted, whatever the form contains."""
    plain = path.startswith("/") and not path.startswith("//") and "\\" not in path and path.isprintable()
    return quote(path, safe="/?=&%+,;:@!$'()*") if plain else "/"


@router.get("/sessions")
def sessions(request: Request, access: Access) -> Response:
    """Those that go on, the latest first."""
    key: Key | None = request.scope["key"]
    this = session.id_of(session.cookie_of(request))
    listed = [] if key is None else access.sessions.listed(key)
    return page(request, "sessions.html", sessions=listed, this=this, browser_name=browser_name)


@router.post("/sessions/{session_id}/end", dependencies=[FORM_OF_SESSION])
def end(session_id: str, request: Request, access: Access) -> Response:
    """End one of them; raises Missing where it is none of this key's."""
    key: Key | None = request.scope["key"]
    if key is not None:
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
