"""Forms: read, and refused unless they were made for this session."""

from typing import Annotated
from urllib.parse import parse_qs

from fastapi import Depends, Request
from fastapi.responses import RedirectResponse

from service.auth import session
from service.problems import Refusal
from underskin.errors import out_of_range

TOKEN = "form_token"  # noqa: S105 -- the name of the field
_LARGEST_BYTES = 100_000
_MOST_FIELDS = 500  # a file of many channels has a row of fields for each


async def _fields(request: Request) -> dict[str, str]:
    """The fields of a form, the first of each name; raises Refusal where another site may have made it."""
    body = b""
    async for chunk in request.stream():
        body += chunk
        if len(body) > _LARGEST_BYTES:
            raise Refusal(413, f"The form exceeds {_LARGEST_BYTES / 1e6:g} MB.", title="Body too large")
    try:
        values = parse_qs(body.decode("utf-8", "replace"), keep_blank_values=True, max_num_fields=_MOST_FIELDS)
    except ValueError:
        raise Refusal(400, "The form has too many fields.") from None
    fields = {name: entries[0] for name, entries in values.items()}
    require_own(request, fields.get(TOKEN, ""))
    return fields


def require_own(request: Request, token: str) -> None:
    """Refuses what was not sent from a page of this session."""
    if not session.is_form_token(session.cookie_in(dict(request.scope["headers"])), token):
        raise Refusal(403, "This form was not made for your session, or the session has ended: go back and reload it.")


Form = Annotated[dict[str, str], Depends(_fields)]
OWN_FORM = Depends(_fields)  # of a route that needs no field, only that the form is of this session


def reason(sent: dict[str, str]) -> str:
    """Why, as somebody wrote it; raises InvalidInput."""
    why = sent.get("reason", "").strip()
    if not 0 < len(why) <= 1000:
        raise out_of_range("reason", why[:80], "must say why in 1 to 1000 characters")
    return why


def see(path: str) -> RedirectResponse:
    """After a form, the page that shows what it did."""
    return RedirectResponse(path, 303)
