"""Undo of changes as long as nothing builds on them: no later diagnosis or adopted model of the campaign or its
skin, and no later change of the same thing."""

from collections.abc import Sequence

from sqlalchemy import Connection, select, update

from service.store import campaigns as kept_campaigns
from service.store import changes as kept
from service.store import skins
from service.store.diagnosed_together import has_one_of
from service.store.engine import holds
from service.store.errors import Conflict
from service.store.overview import numbers_of
from service.store.tables import AnyRow, campaigns, diagnoses, models, recordings
from service.store.tables import skins as skin_rows
from service.store.times import now

_FIGURES = ("withdraw", "exclude", "correct", "join")  # changes that affect figures; discarding a campaign does too


def undo(connection: Connection, change_id: str, made_from: str | None) -> AnyRow:
    """Undo a change and record that; returns the change. Raises Missing, Conflict."""
    if holds(connection, models, id=change_id):
        raise Conflict("This cannot be undone: a model that was withdrawn is adopted again from its diagnosis.")
    change = kept.find(connection, change_id)
    if change.campaign_id is not None:  # before the skin, as all that change a campaign
        row = kept_campaigns.find(connection, change.campaign_id, lock=True)
        if change.action == "correct":
            kept_campaigns.find(connection, row.corrects, lock=True)
    members = [skins.members(root) for root in _roots(connection, change)]
    skins.lock(connection, [skin_id for ids in members for skin_id in connection.execute(ids).scalars()])
    why_not = standing(connection, change, of_same(connection, change))
    if why_not is not None:
        raise Conflict(f"This cannot be undone: {why_not}.")
    if change.action == "correct":
        _uncorrect(connection, change, made_from)
    else:
        _TAKE_BACK[change.action](connection, change)
    kept.record(
        connection,
        "undo",
        change.skin_id,
        made_from,
        campaign_id=change.campaign_id,
        recording=change.recording,
        undoes=change.id,
    )
    return change


def standing(connection: Connection, change: AnyRow, of_same: Sequence[AnyRow]) -> str | None:
    """Why a change cannot be undone: it was undone already, or something builds on it; None if it can.

    `of_same`: all changes of its campaign; for a change of a skin itself, those of the skin that it counts as and of
    all joined to that.
    """
    if change.action == "undo":
        return "it took another change back"
    later = [other for other in of_same if other.number > change.number]
    undone = {other.undoes for other in later}
    if change.id in undone:
        return "it was undone already"
    if any(other.id not in undone and _stacks(change, other) for other in later):
        return "a later change builds on it"
    if change.action == "join" and not _joined_still(connection, change):
        return "the skins were joined otherwise since"
    if not _of_figures(change):
        return None
    return _corrected_since(connection, change) or _built_since(connection, change)


def of_same(connection: Connection, change: AnyRow) -> Sequence[AnyRow]:
    """All changes of its campaign, or of its skin itself, the latest first."""
    if change.campaign_id is not None:
        return kept.of_campaign(connection, change.campaign_id)
    return kept.of_skin(connection, skins.require_root(connection, change.skin_id))


def _stacks(change: AnyRow, other: AnyRow) -> bool:
    """Whether a later change of the same thing builds on the earlier one."""
    if other.action == "undo" or _of_figures(change) != _of_figures(other):
        return False
    return _of_figures(change) or other.skin_id == change.skin_id


def _of_figures(change: AnyRow) -> bool:
    return change.action in _FIGURES or (change.action == "discard" and change.campaign_id is not None)


def _joined_still(connection: Connection, change: AnyRow) -> bool:
    """Whether the skin is still a root, and the joined one still counts as it."""
    skin_id, other = change.skin_id, skins.find(connection, change.before["skin_id"])
    return (
        skins.require_root(connection, skin_id) == skin_id
        and other is not None
        and other.joined_to == other.root_id == skin_id
    )


def _corrected_since(connection: Connection, change: AnyRow) -> str | None:
    """Whether the campaign was corrected since; the correction itself is a change of the campaign that replaced it."""
    newer = select(campaigns.c.corrected_by).where(campaigns.c.id == change.campaign_id)
    corrected_by = connection.execute(newer).scalar()
    return None if corrected_by is None else f"its campaign was corrected since, by {corrected_by!r}"


def _roots(connection: Connection, change: AnyRow) -> set[str]:
    """The skin that the change is of; of a correction, also the skin of the campaign whose place it took."""
    of = {change.skin_id}
    if change.action == "correct":
        older = select(campaigns.c.skin_id).where(campaigns.c.corrected_by == change.campaign_id)
        of.update(connection.execute(older).scalars())
    return {skins.require_root(connection, skin_id) for skin_id in of}


def _built_since(connection: Connection, change: AnyRow) -> str | None:
    built = (_built_on(connection, change, root) for root in sorted(_roots(connection, change)))
    return next((why for why in built if why is not None), None)


def _built_on(connection: Connection, change: AnyRow, root: str) -> str | None:
    """What was built since on a skin and all that count as it, or on the changed campaign; times are in order of
    creation (times.py)."""
    numbers = numbers_of(root)
    of_skin = diagnoses.c.campaign.in_(numbers) | has_one_of(numbers)
    if change.campaign_id is not None:
        campaign_number = select(campaigns.c.number).where(campaigns.c.id == change.campaign_id)
        of_skin = diagnoses.c.campaign.in_(campaign_number) | has_one_of(numbers)
    later_diagnosis = select(diagnoses.c.id).where(of_skin, diagnoses.c.asked_at > change.at).limit(1)
    if connection.execute(later_diagnosis).first() is not None:
        return "it was diagnosed since"
    adopted = select(models.c.id).where(models.c.skin_id.in_(skins.members(root)), models.c.adopted_at > change.at)
    if connection.execute(adopted.limit(1)).first() is not None:
        return "a model was adopted since"
    return None


def _use_again(connection: Connection, change: AnyRow) -> None:
    values = {"withdrawn_at": None, "withdrawn_from": None, "withdraw_reason": None}
    _campaign(connection, change, **values, revision=campaigns.c.revision + 1)
    skins.bring_back(connection, skins.require_root(connection, change.skin_id))


def _include(connection: Connection, change: AnyRow) -> None:
    campaign_number = select(campaigns.c.number).where(campaigns.c.id == change.campaign_id).scalar_subquery()
    this = (recordings.c.campaign == campaign_number) & (recordings.c.id == change.recording)
    values = {"excluded_at": None, "excluded_from": None, "exclude_reason": None}
    connection.execute(update(recordings).where(this).values(**values))
    _campaign(connection, change, excluded=campaigns.c.excluded - 1, revision=campaigns.c.revision + 1)


def _uncorrect(connection: Connection, change: AnyRow, made_from: str | None) -> None:
    """Use the campaign again that was corrected, and withdraw the one that took its place."""
    newer = kept_campaigns.find(connection, change.campaign_id)
    older = kept_campaigns.find(connection, newer.corrects)
    raised = campaigns.c.revision + 1
    withdrawn = {"withdrawn_at": now(), "withdrawn_from": made_from, "withdraw_reason": "the correction was undone"}
    _campaign(connection, change, **withdrawn, revision=raised)
    again = update(campaigns).where(campaigns.c.number == older.number)
    connection.execute(again.values(corrected_by=None, revision=raised))
    skins.bring_back(connection, skins.require_root(connection, older.skin_id))


def _separate(connection: Connection, change: AnyRow) -> None:
    """Separate the joined skin, and those that counted as it."""
    other, members = change.before["skin_id"], change.before["members"]
    counted = skin_rows.c.id.in_(members) & (skin_rows.c.root_id == change.skin_id)
    connection.execute(update(skin_rows).where(counted).values(root_id=other))
    not_joined = {"joined_to": None, "joined_at": None, "joined_from": None, "join_reason": None}
    connection.execute(update(skin_rows).where(skin_rows.c.id == other).values(**not_joined))


def _as_before(connection: Connection, change: AnyRow) -> None:
    if change.action == "discard" and change.campaign_id is not None:
        _campaign(connection, change, **change.before, revision=campaigns.c.revision + 1)
        skins.bring_back(connection, skins.require_root(connection, change.skin_id))
    elif change.campaign_id is not None:
        _campaign(connection, change, **change.before)
    else:
        connection.execute(update(skin_rows).where(skin_rows.c.id == change.skin_id).values(**change.before))


def _campaign(connection: Connection, change: AnyRow, **values: object) -> None:
    connection.execute(update(campaigns).where(campaigns.c.id == change.campaign_id).values(**values))


_TAKE_BACK = {
    "withdraw": _use_again,
    "exclude": _include,
    "join": _separate,
    "annotate": _as_before,
    "discard": _as_before,
}
