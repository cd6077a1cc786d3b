"""Why no d33 of several campaigns, or of skins of one make, is to be quoted, and what may be quoted in its place."""

from collections.abc import Mapping, Sequence

from underskin.diagnosis.data.names import in_words
from underskin.diagnosis.reporting.stated_d33 import StatedD33
from underskin.diagnosis.reporting.statements import listed

_MOST_NAMED = 3  # skins in a clause


def of_campaigns(last: str, own: StatedD33) -> str:
    """A clause on the d33 of a joint report: it is that of the `last` campaign by its recordings alone."""
    if own.document is None:
        return f"no d33 is to be quoted: in {last}, the last campaign, no answer explains the recordings"
    alone = f"d33 here is by the recordings of {last} alone, and not to be quoted for all campaigns"
    if own.document["quotable"]:
        return f"{alone}: {own.quoted()}"
    return f"{alone}, nor for {last} itself: {own.interval()}"


def of_skins(mean: float, unit: str, each: Mapping[str, StatedD33], lacking: Mapping[str, Sequence[str]]) -> str:
    """A clause on the d33 of a fleet, the mean of its skins.

    `each`: what the skins' recordings say alone; `lacking`: of some skins the mechanisms that the fleet finds in them
    and their own diagnosis does not.
    """
    may: list[str] = []
    by_reason: dict[str, list[str]] = {}
    for skin, own in each.items():
        sisters = [f"its own diagnosis lacks {in_words(lacking[skin])}"] if lacking.get(skin) else []
        reason = " and ".join(own.reasons or sisters)
        (by_reason.setdefault(reason, []) if reason else may).append(skin)
    others = [f"not of {_few(skins)} ({reason})" for reason, skins in by_reason.items()]
    told = ", ".join([f"of {_few(may) if may else 'none'}", *others])
    return (
        f"d33 is not to be quoted, because {mean:.3g} {unit} is the mean of the skins and no skin's own; "
        f"by its own recordings alone it may be quoted {told}"
    )


def not_identifiable(each: Mapping[str, StatedD33]) -> list[dict[str, str]]:
    """What would not show in a campaign, or in a skin's, and keeps its d33 from being quoted."""
    return [
        {**entry, "reason": f"{name} alone: {entry['reason']}"}
        for name, own in each.items()
        for entry in own.not_identifiable([])
        if entry["mechanism"] in {one.mechanism for one in own.deciding}
    ]


def _few(skins: Sequence[str]) -> str:
    further = len(skins) - _MOST_NAMED
    return listed([*skins[:_MOST_NAMED], *([f"{further} more"] if further > 0 else [])])
