"""Sentences of findings on sensors: one that stands alone, exchanged labels and cables, two that fail together."""

import math
from collections.abc import Sequence

from underskin.findings.sentences import listed

_AS_A_SLIP = 0.05  # of the logarithm of a factor beside that of 2 or of a half


def sensor_alone(sensor: str, share: float, recordings: int) -> str:
    """A sensor at another level than all others, which are alike."""
    doubled = min(abs(math.log(share / 2)), abs(math.log(2 * share))) < _AS_A_SLIP
    causes = "its own d33, its cable, or peak-to-peak beside amplitudes" if doubled else "its own d33 or its cable"
    return (
        f"sensor {sensor!r} responds with {share:.2f} times the others' charge, and they are alike: {causes}; "
        f"taken to their level by this factor ({recordings} recordings)"
    )


def cables_exchanged(first: str, second: str, since: str, recordings: int) -> str:
    """Two sensors' cables exchanged from some recording on."""
    text = f"from recording {since!r} on, in the order of time, sensors {first!r} and {second!r} answer as each other"
    return f"{text}: their cables look exchanged; put right ({recordings} recordings)"


def labels_permuted(sensors: Sequence[str], places: Sequence[str], since: str | None, recordings: int) -> str:
    """More than two sensors, each of which answers where another one was pressed."""
    begins = f"from recording {since!r} on, in the order of time, " if since else ""
    moved = ", ".join(f"{sensor!r} where {place!r} was pressed" for sensor, place in zip(sensors, places, strict=True))
    return (
        f"{begins}{len(sensors)} sensors answer where another one of them was pressed ({moved}): their labels or "
        f"cables look rotated, as by a plug that is off by one; put right ({recordings} recordings)"
    )


def labels_contradict_places(sensors: Sequence[str], recordings: int) -> str:
    """Sensors that answer where others were pressed, and no exchange explains all of it."""
    answer = f"{listed(sensors, 'sensors')} answer{'s' if len(sensors) == 1 else ''} where others were pressed"
    return f"{answer}, and no exchange explains it: labels or places are wrong; left out ({recordings} recordings)"


def silent_together(first: str, second: str, since: str, recordings: int) -> str:
    """Two sensors that show no response from some recording on."""
    return (
        f"sensors {first!r} and {second!r} both show no response since recording {since!r}, in the order of time: "
        f"cables exchanged, or a connector or amplifier that they share; left out ({recordings} recordings)"
    )
