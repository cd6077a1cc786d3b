"""What is wrong with an array at a glance: marked sensors, a fall of d33, refused recordings."""

from collections.abc import Mapping, Sequence
from typing import Any

_MOST_NAMED = 6  # sensors
_FALL_PERCENT = 5.0  # of d33, as of a sensor that is marked


def attention(
    answer: Mapping[str, Any] | None,
    campaign: Any | None,
    d33: Sequence[tuple[str, float]] = (),
    dead: Sequence[str] = (),
) -> list[str]:
    """Each problem in a few words, from an answer that is kept and its campaign, if any; `d33`: (time, median
    [pC/N]) of the last campaigns; `dead`: sensors that are named elsewhere."""
    sensors = [] if answer is None else [sensor for sensor in answer["sensors"] if sensor["sensor"] not in dead]
    marked = [f"{sensor['sensor'][:24]} {flag['reason']}" for sensor in sensors for flag in sensor["flags"]]
    problems = marked[:_MOST_NAMED]
    if len(marked) > _MOST_NAMED:
        problems.append(f"and {len(marked) - _MOST_NAMED} more of {len(sensors)} sensors")
    if len(d33) > 1 and (change := 100 * (d33[-1][1] / d33[0][1] - 1)) < -_FALL_PERCENT:
        problems.append(f"median d33 fell by {-change:.0f} % since {d33[0][0][:10]}")
    if campaign is not None and (refused := len(campaign.refused)):
        problems.append(f"{refused} recording{'s' if refused > 1 else ''} refused")
    return problems
