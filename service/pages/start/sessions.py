"""The sessions of one's own key: where somebody is logged in with it, and the way to end each."""

from fastapi import APIRouter, Request, Response

from service.auth import session
from service.auth.access_control import AccessControl
from service.auth.keys import Key
from service.pages.shared.forms import OWN_FORM, see
from service.pages.shared.html import page

router = APIRouter(prefix="/sessions")


@router.get("")
def sessions(request: Request) -> Response:
    """Those that go on, the latest first."""
    key: Key | None = request.scope["key"]
    access: AccessControl = request.app.state.access
    this = session.id_of(session.cookie_in(dict(request.scope["headers"])))
    return page(request, "sessions.html", sessions=[] if key is None else access.sessions.listed(key), this=this)


@router.post("/{session_id}/end", dependencies=[OWN_FORM])
def end(session_id: str, request: Request) -> Response:
    """End one of them; raises Missing where it is none of this key's."""
    key: Key | None = request.scope["key"]
    if key is not None:
        access: AccessControl = request.app.state.access
        access.sessions.end(session_id, key)
    return see("/sessions")
