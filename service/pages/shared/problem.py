"""An error as a page."""

from urllib.parse import urlsplit

from fastapi.responses import HTMLResponse, RedirectResponse, Response

from service.pages.shared import html
from service.problems import Refusal


def problem_page(refusal: Refusal, request_id: str) -> Response:
    """What happened and what to do; where the gate sends elsewhere, the way there."""
    place = refusal.headers.get("Location")
    if place is not None and not urlsplit(place).netloc:
        return RedirectResponse(place, refusal.status)
    text = html.render("problem.html", refusal=refusal, request_id=request_id, viewer=None)
    return HTMLResponse(text, refusal.status, {**html.headers(), **refusal.headers})
