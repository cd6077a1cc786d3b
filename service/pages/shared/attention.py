"""What is wrong with an array at a glance: marked sensors, refused recordings."""

from collections.abc import Mapping, Sequence
from typing import Any

_MOST_NAMED = 6  # sensors


def attention(answer: Mapping[str, Any] | None, campaign: Any | None, dead: Sequence[str] = ()) -> list[str]:
    """Each problem in a few words, from an answer that is kept and its campaign, if any; `dead`: sensors that are named
    elsewhere."""
    sensors = [] if answer is None else [sensor for sensor in answer["sensors"] if sensor["sensor"] not in dead]
    marked = [f"{sensor['sensor'][:24]} {flag['reason']}" for sensor in sensors for flag in sensor["flags"]]
    problems = marked[:_MOST_NAMED]
    if len(marked) > _MOST_NAMED:
        problems.append(f"and {len(marked) - _MOST_NAMED} more of {len(sensors)} sensors")
    if campaign is not None and (refused := len(campaign.refused)):
        problems.append(f"{refused} recording{'s' if refused > 1 else ''} refused")
    return problems
