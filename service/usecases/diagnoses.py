"""Diagnoses of one campaign or of several together: requested and described."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy import Connection

from service.jobs.runner import basis
from service.schemas.diagnoses import MOST_TOGETHER, AskForFleet, AskForSkin, DiagnosisEntry
from service.store import AnyRow, Conflict, campaigns, diagnosed_together, diagnoses, skins
from service.store.diagnosed_together import Member, Together
from service.usecases.mechanisms import full_catalogue
from underskin.errors import ErrorCode, InvalidInput, not_one_of
from underskin.recordings.validation import name as checked_name
from underskin.surrogate.sigma_table import SigmaTable

_FEWEST = 2  # campaigns of one skin


def ask(
    connection: Connection, campaign_id: str, table: SigmaTable, sender: str | None, without: Sequence[str] = ()
) -> AnyRow:
    """Queue the diagnosis of a campaign with this table, version and catalogue, or return the existing one. Raises
    InvalidInput if `without` names an unknown mechanism."""
    _require_listed(without)
    return diagnoses.ask(connection, campaign_id, basis(table.sha256), sender, without)


def ask_of_skin(
    connection: Connection, skin_id: str, table: SigmaTable, sender: str | None, request: AskForSkin
) -> AnyRow:
    """As `ask`, for campaigns of a skin together.

    Raises Missing for an unknown skin, InvalidInput naming a campaign of another skin, and Conflict if one is not in
    use, if there are fewer than two, or if none has FRFs.
    """
    root = skins.require_root(connection, skin_id)
    _require_listed(request.without)
    members = diagnosed_together.usable(connection, root)
    if request.campaigns is not None:
        members = _chosen(connection, root, request.campaigns, members)
    elif len(members) < _FEWEST:
        count = "no campaign" if not members else "one campaign"
        raise Conflict(f"Skin {root!r} has {count} in use with recordings; {_FEWEST} or more are diagnosed together.")
    if not diagnosed_together.have_frfs(connection, members):
        raise Conflict(
            f"Of these campaigns of skin {root!r} none has FRFs in use, by which campaigns are compared: diagnose "
            "curves each campaign by itself, or send their files together, as a correction of one."
        )
    name = root if request.name is None else checked_name("name", request.name, False)
    together = Together("skin", name, members, [root] if request.campaigns is None else [])
    return _together(connection, together, table, sender, request.without)


def ask_of_fleet(connection: Connection, table: SigmaTable, sender: str | None, request: AskForFleet) -> AnyRow:
    """As `ask`, for all campaigns of several skins together.

    Raises InvalidInput naming a skin that is unknown or repeated, and Conflict for one without a campaign in use.
    """
    roots: list[str] = []
    for index, skin_id in enumerate(request.skins):
        row = skins.find(connection, skin_id)
        if row is None:
            raise InvalidInput("skins", skin_id, "must be the id of a skin", index, code=ErrorCode.NOT_ONE_OF)
        if row.root_id in roots:
            allowed = f"must be another skin than skins[{roots.index(row.root_id)}], which is the same one"
            raise InvalidInput("skins", skin_id, allowed, index, code=ErrorCode.NOT_UNIQUE)
        roots.append(str(row.root_id))
    name = checked_name("name", request.name, False)
    _require_listed(request.without)
    members: list[Member] = []
    for root in sorted(roots):  # so that all requests lock campaigns in the same order
        members_of_skin = diagnosed_together.usable(connection, root)
        if not members_of_skin:
            raise Conflict(f"Skin {root!r} has no campaign in use with recordings: leave it out of the fleet.")
        members += members_of_skin
    return _together(connection, Together("fleet", name, members, sorted(roots)), table, sender, request.without)


def ask_again(
    connection: Connection, diagnosis_id: str, table: SigmaTable, sender: str | None, without: Sequence[str]
) -> AnyRow:
    """Request the same for the campaigns' present state; a diagnosis of all campaigns then includes new ones."""
    row = diagnoses.find(connection, diagnosis_id)
    if row.kind == "campaign":
        return ask(connection, row.campaign_id, table, sender, without)
    all_of = diagnosed_together.all_of(connection, row.number)
    without = list(without)
    if row.kind == "fleet":
        return ask_of_fleet(connection, table, sender, AskForFleet(skins=all_of, name=row.name, without=without))
    members = diagnoses.members(connection, row)
    chosen = None if all_of else [member.campaign_id for member in members]
    request = AskForSkin(campaigns=chosen, name=row.name, without=without)
    return ask_of_skin(connection, members[0].skin_id, table, sender, request)


def _together(
    connection: Connection, together: Together, table: SigmaTable, sender: str | None, without: Sequence[str]
) -> AnyRow:
    if len(together.members) > MOST_TOGETHER:
        raise Conflict(f"{len(together.members)} campaigns are too many: up to {MOST_TOGETHER} are diagnosed together.")
    return diagnoses.ask_together(connection, together, basis(table.sha256), sender, without)


def _chosen(connection: Connection, root: str, campaign_ids: Sequence[str], usable: Sequence[Member]) -> list[Member]:
    """The requested ones of the usable campaigns, by arrival."""
    by_id = {member.campaign_id: member for member in usable}
    for index, campaign_id in enumerate(campaign_ids):
        if campaign_id in campaign_ids[:index]:
            raise InvalidInput("campaigns", campaign_id, "must be given once", index, code=ErrorCode.NOT_UNIQUE)
        if campaign_id not in by_id:
            raise _not_usable(connection, root, campaign_id, index)
    return [member for member in usable if member.campaign_id in campaign_ids]


def _not_usable(connection: Connection, root: str, campaign_id: str, index: int) -> Exception:
    """Why a campaign cannot be diagnosed with others of a skin."""
    rows_of_skin = {row.id: row for row in campaigns.of_skin(connection, root)}
    if campaign_id not in rows_of_skin:
        allowed = f"must be a campaign of skin {root!r} or of one joined to it"
        return InvalidInput("campaigns", campaign_id, allowed, index, code=ErrorCode.NOT_ONE_OF)
    why = campaigns.unused(rows_of_skin[campaign_id])
    return Conflict(
        f"campaigns[{index}] = {campaign_id!r} is not diagnosed: "
        + ("all of its recordings are excluded." if why is None else f"it was {why}.")
    )


def _require_listed(without: Sequence[str]) -> None:
    by_name = full_catalogue()
    for name in without:
        if name not in by_name:
            raise not_one_of("without", name, by_name)


def entries(connection: Connection, rows: Sequence[AnyRow]) -> list[dict[str, Any]]:
    """The fields of DiagnosisEntry from rows of the store."""
    members = diagnosed_together.members_of(connection, [row.number for row in rows if row.kind != "campaign"])
    derived = ("outdated", "without", "campaign_ids")
    names = [name for name in DiagnosisEntry.model_fields if name not in derived]
    return [
        {name: getattr(row, name) for name in names}
        | {
            "outdated": diagnoses.outdated(row),
            "without": diagnoses.without(row),
            "campaign_ids": [member.campaign_id for member in members.get(row.number, ())] or [row.campaign_id],
        }
        for row in rows
    ]


def entry(connection: Connection, row: AnyRow) -> dict[str, Any]:
    """The same of one row."""
    return entries(connection, [row])[0]
