"""The mechanisms that diagnoses know: the lab's own, which are kept from a diagnosis and can be discarded, and all
others.
"""

from fastapi import APIRouter, Request, Response

from service.dependencies import WRITE, Store
from service.pages.shared import same_request
from service.pages.shared.forms import OWN_FORM, Form, see
from service.pages.shared.html import page
from service.usecases import mechanisms as usecase

router = APIRouter(prefix="/mechanisms")


@router.get("")
def mechanisms(request: Request) -> Response:
    """The lab's own first."""
    entries = usecase.entries()
    return page(
        request,
        "mechanisms.html",
        own=[entry for entry in entries if entry.own],
        others=[entry for entry in entries if not entry.own],
        same=same_request.get(request, "/v1/mechanisms", "client.mechanisms.all()"),
    )


@router.post("", dependencies=WRITE)
def keep_found(sent: Form, store: Store) -> Response:
    """Keep the law that a diagnosis found."""
    description = sent.get("description", "").strip()[:500] or None
    store.read(usecase.keep_found, sent.get("diagnosis_id", ""), sent.get("name", "").strip(), description)
    return see("/mechanisms")


@router.post("/{name}/discard", dependencies=[*WRITE, OWN_FORM])
def discard(name: str, store: Store) -> Response:
    """Take it out of the catalogue."""
    store.read(usecase.discard, name)
    return see("/mechanisms")
