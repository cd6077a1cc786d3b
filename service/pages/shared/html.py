"""Renders templates as answers: every page, also an error page, gets its content security policy here."""

import gzip
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

from fastapi import Request, Response
from fastapi.responses import HTMLResponse, RedirectResponse
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from service.auth import session
from service.auth.keys import Key
from service.pages.shared import formats
from service.pages.shared.assets import address, library_style_hash
from service.pages.shared.same_request import scheme
from service.problems import Refusal
from underskin import __version__

# Of the empty style element that plotly fills through the object model.
_EMPTY_STYLE = "'sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU='"


_DOCUMENTED = {
    "/skins": "recordings#the-history-of-a-skin", "/campaigns": "recordings#d33-of-an-array", "/upload": "formats",
    "/diagnoses": "diagnosis", "/fleets": "store#diagnosing-campaigns-together", "/design": "http-api#design-of-a-skin",
    "/loads": "http-api#several-loads-on-an-array", "/field": "http-api#the-stress-under-a-sphere",
    "/d33": "http-api#frf-d33-and-σ", "/mechanisms": "extending", "/tables": "how-it-works",
    "/compare": "store#reading",
}  # fmt: skip
_COMPRESSION = 5  # of 9: the rest takes longer than it saves


@cache
def _policy() -> str:
    """Nothing from outside, no inline script or style; plotly sets style attributes, which reach no network."""
    styles = f"'self' {_EMPTY_STYLE} {library_style_hash()}"
    return (
        f"default-src 'none'; script-src 'self'; style-src {styles}; style-src-elem {styles}; "
        "style-src-attr 'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self'; form-action 'self'; "
        "frame-ancestors 'none'; base-uri 'none'"
    )


def headers() -> dict[str, str]:
    """What every page is sent with."""
    return {
        "Content-Security-Policy": _policy(),
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "same-origin",  # without a referrer, a form would send no origin either
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cache-Control": "no-store",
    }


@cache
def _templates() -> Environment:
    """All templates; every value that they show is escaped."""
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parents[1] / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )
    templates.filters.update(formats.FILTERS)
    templates.globals.update(
        documented=_documented, static=address, version=__version__, segment=lambda text: quote(text, safe="")
    )
    return templates


def _documented(path: str) -> str:
    """The page of docs/ on a page of this server, and the part of it."""
    return next((part for start, part in _DOCUMENTED.items() if path.startswith(start)), "quickstart")


def render(template: str, **values: Any) -> str:
    """A template as text."""
    return _templates().get_template(template).render(**values)


def page(
    request: Request, template: str, *, status: int = 200, cookie: str | None = None, **values: Any
) -> HTMLResponse:
    """A template as the answer to a request; `cookie` replaces the session's."""
    cookie_sent = session.cookie_of(request)
    current = cookie or cookie_sent or session.anonymous()
    key: Key | None = request.scope["key"]
    viewer = {
        "key": key,
        "may_write": key is None or key.scope == "write",
        "form_token": session.form_token(current),
        "path": request.url.path,
    }
    answer = HTMLResponse(render(template, viewer=viewer, **values), status, headers())
    compress(request, answer)
    if current != cookie_sent:
        set_session(request, answer, current)
    return answer


def problem_page(refusal: Refusal, request_id: str) -> Response:
    """What happened and what to do; where the gate sends elsewhere, the way there."""
    location = refusal.headers.get("Location")
    if location is not None and not urlsplit(location).netloc:
        return RedirectResponse(location, refusal.status)
    text = render("problem.html", refusal=refusal, request_id=request_id, viewer=None)
    return HTMLResponse(text, refusal.status, {**headers(), **refusal.headers})


def json_answer(request: Request, content: bytes) -> Response:
    """JSON for a script of a page."""
    answer = Response(content, media_type="application/json", headers={"Cache-Control": "no-store"})
    compress(request, answer)
    return answer


def compress(request: Request, answer: Response) -> None:
    """Gzip an answer if the browser accepts that. Its only secret is the session's own token, and requests from
    other sites carry no session, so lengths reveal nothing."""
    if "gzip" in request.headers.get("accept-encoding", ""):
        answer.body = gzip.compress(bytes(answer.body), _COMPRESSION)
        answer.headers.update({"Content-Encoding": "gzip", "Content-Length": str(len(answer.body))})


def set_session(request: Request, answer: Any, cookie: str) -> None:
    """Put the session's cookie into an answer; behind TLS it goes back through TLS only."""
    secure = scheme(request) == "https"
    age = session.LASTS_S
    answer.set_cookie(session.COOKIE, cookie, max_age=age, httponly=True, samesite="strict", secure=secure, path="/")
