"""Fleets: skins of one batch are chosen, named and diagnosed together; lists earlier diagnoses."""

from collections.abc import Mapping
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from service.dependencies import RunnerInUse, Store, Table, sender
from service.pages.shared import same_request, verdicts
from service.pages.shared.forms import NOT_ASKED, Form, in_form_words, see
from service.pages.shared.html import page
from service.problems import parsed
from service.schemas.diagnoses import FEWEST_SKINS, AskForFleet
from service.store import Conflict, diagnoses, skins
from service.usecases import diagnoses as usecase
from underskin.errors import UnderskinError, too_few

router = APIRouter(prefix="/fleets")

_ON_A_PAGE = 200  # skins, as many as a form may choose
_LATEST = 20  # diagnoses
_BOX = "skin-"  # names of the boxes begin so
_LABELS = {"skins": "Skins", "name": "Name"}


@router.get("")
def fleets(
    request: Request,
    store: Store,
    find: Annotated[str, Query(max_length=200)] = "",
    after: Annotated[str | None, Query(max_length=200)] = None,
    chosen: Annotated[tuple[str, ...], Query(max_length=_ON_A_PAGE)] = (),
    name: Annotated[str, Query(max_length=200)] = "",
    error: Annotated[UnderskinError | Conflict | None, NOT_ASKED] = None,
) -> Response:
    """The skins to choose from: those that are chosen and not in this part of the list, then the list, by id. Choices
    and texts are kept when the list is searched."""
    with store.reading() as connection:
        rows = skins.listed(connection, find or None, after, _ON_A_PAGE + 1)
        following = rows[_ON_A_PAGE - 1].id if len(rows) > _ON_A_PAGE else None
        rows = rows[:_ON_A_PAGE]
        chosen_before = skins.of_ids(connection, set(chosen) - {row.id for row in rows})
        before = diagnoses.listed(connection, diagnoses.DiagnosisFilters(kind="fleet"), None, _LATEST)
        verdict_of = verdicts.of_rows(connection, before)
    example = {"skins": [row.id for row in rows[:FEWEST_SKINS]], "name": "the fleet"}
    status = 200 if error is None else 409 if isinstance(error, Conflict) else 422
    return page(
        request,
        "fleets.html",
        status=status,
        rows=[*chosen_before, *rows],
        listed=len(rows),
        following=following,
        find=find,
        after=after or "",
        fewest=FEWEST_SKINS,
        box=_BOX,
        chosen=set(chosen),
        name=name,
        error=in_form_words(error, _LABELS) if isinstance(error, UnderskinError) else error and str(error),
        diagnoses=list(verdict_of.values()),
        same=same_request.post(
            request,
            "/v1/fleets/diagnosis",
            example,
            f"client.fleets.diagnose({example['skins']!r}, {example['name']!r})",
        ),
    )


@router.post("/diagnosis")
def ask(request: Request, sent: Form, runner: RunnerInUse, store: Store, table: Table) -> Response:
    """Queue the diagnosis of the chosen skins; an existing one is shown. Errors are shown in the form, with all
    choices."""
    try:
        row = store.write(usecase.ask_of_fleet, table, sender(request), _requested(sent))
    except (UnderskinError, Conflict) as error:
        find, after = sent.get("find", ""), sent.get("after") or None
        return fleets(request, store, find, after, _chosen(sent), sent.get("name", ""), error)
    runner.stir()
    return see(f"/diagnoses/{row.id}")


def _chosen(sent: Mapping[str, str]) -> tuple[str, ...]:
    return tuple(value for name, value in sent.items() if name.startswith(_BOX))


def _requested(sent: Mapping[str, str]) -> AskForFleet:
    """The request of the form; raises InvalidInput."""
    chosen = _chosen(sent)
    if len(chosen) < FEWEST_SKINS:
        raise too_few("skins", f"{len(chosen)} chosen", f"must be {FEWEST_SKINS} at least: tick those of one make")
    return parsed(AskForFleet, {"skins": list(chosen), "name": sent.get("name", "").strip()})
