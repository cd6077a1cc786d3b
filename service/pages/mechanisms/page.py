"""The catalogue of mechanisms: the effect of each on an FRF as picture and formula, similar mechanisms, and
diagnoses that found it; also the lab's own mechanisms, stored from diagnoses, which can be discarded."""

import base64
import hashlib
from collections.abc import Mapping

from fastapi import APIRouter, Request, Response

from service.dependencies import WRITE, Store, Table
from service.pages.mechanisms.picture import STYLE, picture
from service.pages.shared import same_request
from service.pages.shared.figures import csv_answer
from service.pages.shared.forms import FORM_OF_SESSION, Form, see
from service.pages.shared.html import page
from service.problems import Refusal
from service.usecases import mechanisms as usecase
from service.usecases.mechanism_catalogue import catalogue, effect
from service.usecases.mechanism_findings import findings
from underskin.diagnosis.data.names import EXPLAINED
from underskin.figures.law_effect import RIG, LawEffect
from underskin.mechanisms import Unsupported
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/mechanisms")

_STYLE_HASH = base64.b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()
_SHOWN = 8  # diagnoses of each mechanism; the file of numbers has all


@router.get("")
def mechanisms(request: Request, store: Store, table: Table) -> Response:
    """The lab's own first."""
    listed = catalogue(store, table)
    return page(
        request,
        "mechanisms.html",
        own=[row for row in listed.entries if row.entry.own],
        others=[row for row in listed.entries if not row.entry.own],
        unusable=usecase.unusable(),
        diagnoses=listed.diagnoses,
        shown=_SHOWN,
        sure=EXPLAINED,
        rig=RIG,
        same=same_request.get(request, "/v1/mechanisms", "client.mechanisms.all()"),
    )


@router.get("/{name}/picture.svg")
def drawn(name: str, request: Request, table: Table) -> Response:
    """Its effect on the FRF of the reference rig, or on its force curve."""
    content = picture(name, _effect(name, table))
    tag = f'"{hashlib.sha256(content.encode()).hexdigest()[:16]}"'
    headers = {
        "ETag": tag,
        "Cache-Control": "no-cache",
        "X-Content-Type-Options": "nosniff",
        "Content-Security-Policy": f"default-src 'none'; style-src 'sha256-{_STYLE_HASH}'",
    }
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return Response(content, headers=headers, media_type="image/svg+xml")


@router.get("/{name}/effect.csv")
def numbers(name: str, table: Table) -> Response:
    """The numbers of the picture."""
    shown = _effect(name, table)
    columns: dict[str, list[float]] = {shown.axis: shown.x.tolist()}
    for panel in shown.panels:
        columns[f"{panel.title}, without it"] = panel.base.tolist()
        for words, curve in zip(shown.strengths, panel.curves, strict=True):
            columns[f"{panel.title}, {words}"] = curve.tolist()
    return csv_answer(name, columns)


@router.get("/{name}/found.csv")
def found_csv(name: str, store: Store) -> Response:
    """Every diagnosis that states it."""
    _require_listed(name)
    rows = findings(store).by_mechanism.get(name, ())
    columns: Mapping[str, list[object]] = {
        "diagnosis": [row.diagnosis_id for row in rows],
        "campaign": [row.campaign_id or "" for row in rows],
        "skin": [row.skin_id for row in rows],
        "name": [row.name for row in rows],
        "ended_at": [row.at for row in rows],
        "verdict": [row.verdict for row in rows],
        "probability": [row.probability for row in rows],
    }
    return csv_answer(f"{name}-found", columns)


@router.post("", dependencies=WRITE)
def keep_found(sent: Form, store: Store) -> Response:
    """Store the law that a diagnosis found as a mechanism."""
    description = sent.get("description", "").strip()[:500] or None
    store.read(usecase.keep_found, sent.get("diagnosis_id", ""), sent.get("name", "").strip(), description)
    return see("/mechanisms")


@router.post("/{name}/discard", dependencies=[*WRITE, FORM_OF_SESSION])
def discard(name: str, store: Store) -> Response:
    """Remove it from the catalogue."""
    store.read(usecase.discard, name)
    return see("/mechanisms")


def _effect(name: str, table: SigmaTable) -> LawEffect:
    """Raises Refusal 404, also if the reference rig lacks the quantity on which the mechanism depends."""
    _require_listed(name)
    try:
        return effect(name, table)
    except Unsupported as lacking:
        raise Refusal(404, f"There is no picture of {name!r}: {lacking.reason}.") from None


def _require_listed(name: str) -> None:
    """Raises Refusal 404."""
    if name not in usecase.catalogue():
        raise Refusal(404, f"There is no mechanism {name!r}.")
