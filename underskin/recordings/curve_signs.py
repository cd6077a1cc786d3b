"""Curves whose force or displacement is counted negative as they are pressed: found, and turned where asked.

Compression and depth are positive here. A block is pressed up to its largest excursion of force: the sign of that
excursion tells how the force is counted, and the displacement there, beside that at the start, how the travel is. It
may be pulled, with both negative. A sphere moves into the sample first: where it goes tells how the travel is counted,
and the force where it is deepest how the force is. What it pulls on its way out, often more than it was pressed with,
tells nothing.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import Campaign, CurveRecording, FrfRecording, IndentationRecording, Recording
from underskin.units import Floats

_FORCE, _TRAVEL = "force_n", "displacement_mm"
_LEAST = 8  # samples: fewer tell nothing of how a curve goes
_MOVED = 0.05  # of the range of travel, from which on a sphere moves
_DEEPEST = 0.99  # of the way in: before what is held there relaxes
_LOWEST = 0.15  # of the range of force on the way in, above its least: a sphere that snapped in is pulled there as well


def counted_negative(recording: CurveRecording) -> tuple[str, ...]:
    """Those of `force_n` and `displacement_mm` that fall while the curve is pressed."""
    force, travel = np.asarray(recording.force_n), np.asarray(recording.displacement_mm)
    return falling(force, travel, sphere=isinstance(recording, IndentationRecording))


def falling(force: Floats, travel: Floats, *, sphere: bool) -> tuple[str, ...]:
    """The same of a sphere's or a block's force and travel, (samples,) in any unit."""
    if len(force) != len(travel) or len(force) < _LEAST:
        return ()
    if sphere:
        return _of_sphere(force, travel)
    top = int(np.argmax(np.abs(force - force[0])))
    return tuple(name for name, column in ((_FORCE, force), (_TRAVEL, travel)) if column[top] < column[0])


def _of_sphere(force: Floats, travel: Floats) -> tuple[str, ...]:
    """The same of a sphere; its force only where it is near its least when deepest."""
    moved = travel - travel[0]
    is_negative = bool(moved[np.argmax(np.abs(moved) > _MOVED * np.ptp(moved))] < 0)
    depth = -moved if is_negative else moved
    top = int(np.argmax(depth >= _DEEPEST * depth.max()))
    way_in = force[: top + 1]
    falls = force[top] < force[0] and force[top] - way_in.min() < _LOWEST * np.ptp(way_in)
    return (*([_FORCE] if falls else []), *([_TRAVEL] if is_negative else []))


def findings(campaign: Campaign) -> list[Finding]:
    """One for the first curve of each way of counting, with how many more there are."""
    by_fields: dict[tuple[str, ...], list[str]] = {}
    for recording in _curves(campaign).values():
        by_fields.setdefault(counted_negative(recording), []).append(recording.id)
    return [
        Finding(Reason.CURVE_COUNTED_NEGATIVE, ids[0], fields[0], {"fields": list(fields), "more": len(ids) - 1})
        for fields, ids in by_fields.items()
        if fields
    ]


def turned(campaign: Campaign) -> tuple[Campaign, int]:
    """The campaign with what its curves count negative turned, and how many curves that changed."""
    changed = 0
    recordings: list[Recording] = []
    for recording in campaign.recordings:
        fields = () if isinstance(recording, FrfRecording) else counted_negative(recording)
        changed += bool(fields)
        columns = {name: -np.asarray(getattr(recording, name)) for name in fields}
        recordings.append(replace(recording, **columns) if columns else recording)  # type: ignore[arg-type]
    return replace(campaign, recordings=tuple(recordings)), changed


def _curves(campaign: Campaign) -> Mapping[str, CurveRecording]:
    return {one.id: one for one in campaign.recordings if not isinstance(one, FrfRecording)}
