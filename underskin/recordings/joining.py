"""Files of one rig, such as a file a press, as one campaign."""

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import PurePath
from typing import Any

from underskin.errors import conflicting, too_few
from underskin.recordings import validation as field
from underskin.recordings.campaign import Campaign, Recording
from underskin.recordings.conditions import SkinDescription
from underskin.recordings.reading import Reading
from underskin.recordings.repeats import digest
from underskin.recordings.shown_values import LONGEST_NAME

_ROUNDING = 1e-6  # relative, and of positions [mm]: single precision, and conversions of units
_MOST_LISTED = 5  # repeats in a warning
_PLACE = "recordings["  # how a refused recording without an id is named

Files = Sequence[tuple[str, Reading]]  # what each file is called, and what was read from it


def join(name: str, files: Files, skin_id: str | None = None) -> Reading:
    """One campaign called `name` of the recordings of all files, in order.

    The files must be of one skin: what one says of it, each other says too or leaves out, and the sensors of all are
    its sensors. `skin_id` is the skin's id whatever the files say. A recording's id that two files have is led by the
    file's name. Of identical recordings (repeats.digest) only the first is there, and a warning names the others.
    Raises InvalidInput that names the field and the two files where they differ.
    """
    name = field.name("name", name, False)
    if not files:
        raise too_few("files", "none", "must be at least one")
    skin = _skin(files, skin_id)
    names = _names(files)
    recordings, repeats = _once(
        [
            replace(recording, id=new[recording.id])
            for new, (_, reading) in zip(names, files, strict=True)
            for recording in reading.campaign.recordings
        ]
    )
    problems = [
        replace(problem, recording=new[problem.recording])
        for new, (_, reading) in zip(names, files, strict=True)
        for problem in reading.problems
    ]
    units_checked = any(reading.campaign.units_checked for _, reading in files)
    warnings = [*_warnings(files), *_renamed(files, names), *_repeated(repeats)]
    return Reading(Campaign(name, skin, tuple(recordings), units_checked), problems, warnings)


def _skin(files: Files, skin_id: str | None) -> SkinDescription:
    """What the files say of their skin, together."""
    said: dict[str, tuple[Any, str]] = {}  # of each field its value and the file that said it first
    sensors = {}
    for file, reading in files:
        skin = reading.campaign.skin if skin_id is None else replace(reading.campaign.skin, id=skin_id)
        for name, value in _facts(skin):
            first, other = said.setdefault(name, (value, file))
            if not _same(value, first):
                allowed = f"in {file}; must be {first!r}, as in {other}: files are joined where they are of one skin"
                raise conflicting(f"skin.{name}", value, allowed)
        sensors.update({sensor.id: sensor for sensor in skin.sensors if sensor.id not in sensors})
    known = {entry.name: said[entry.name][0] for entry in fields(SkinDescription) if entry.name in said}
    return SkinDescription(**known, sensors=tuple(sensors.values()))


def _facts(skin: SkinDescription) -> Iterator[tuple[str, Any]]:
    """Each field that is known, and each sensor's place, under the name that an error may give it."""
    for entry in fields(skin):
        value = getattr(skin, entry.name)
        if entry.name != "sensors" and value is not None:
            yield entry.name, value
    for sensor in skin.sensors:
        yield f"sensors[{sensor.id}].x_mm", sensor.x_mm
        yield f"sensors[{sensor.id}].y_mm", sensor.y_mm


def _same(value: Any, other: Any) -> bool:
    if not isinstance(value, float):
        return bool(value == other)
    return math.isclose(value, other, rel_tol=_ROUNDING, abs_tol=_ROUNDING)


def _names(files: Files) -> list[dict[str, str]]:
    """Of each file, what its recordings are called in the campaign, by their ids in the file."""
    ids = [_ids(reading) for _, reading in files]
    uses = Counter(name for each in ids for name in each)
    unique = {name for name in uses if uses[name] == 1 and not name.startswith(_PLACE)}
    taken = set(unique)
    alike: Counter[str] = Counter()
    names = []
    for (file, _), each in zip(files, ids, strict=True):
        stem = "".join(letter for letter in PurePath(file).stem if letter.isprintable())
        alike[stem] += 1
        label = stem if alike[stem] == 1 else f"{stem} ({alike[stem]})"
        new = {name: name for name in each if name in unique}
        for name in each:
            if name not in unique:
                new[name] = _free(label, "" if name == stem else name, taken)
                taken.add(new[name])
        names.append(new)
    return names


def _ids(reading: Reading) -> list[str]:
    """Of good and of refused recordings, each once."""
    good = [recording.id for recording in reading.campaign.recordings]
    return list(dict.fromkeys([*good, *(problem.recording for problem in reading.problems)]))


def _free(label: str, name: str, taken: set[str]) -> str:
    """An id that no recording has: the file's label and the id, and where that is not enough a number."""
    named = f" {name}" if name else ""
    ends = (named if number == 1 else f"{named} ({number})" for number in itertools.count(1))
    all_free = ((label[: max(0, LONGEST_NAME - len(end))] + end)[-LONGEST_NAME:].strip() for end in ends)
    return next(free for free in all_free if free not in taken)


def _warnings(files: Files) -> Iterator[str]:
    """Each warning once, with the files that it is about."""
    about: dict[str, list[str]] = {}
    for file, reading in files:
        for warning in reading.warnings:
            about.setdefault(warning, []).append(file)
    for warning, (first, *others) in about.items():
        yield f"{first}{f' and {len(others)} more' if others else ''}: {warning}"


def _renamed(files: Files, names: Sequence[dict[str, str]]) -> Iterator[str]:
    changed = [
        (file, old, new)
        for (file, _), each in zip(files, names, strict=True)
        for old, new in each.items()
        if old != new and not old.startswith(_PLACE)
    ]
    if changed:
        file, old, new = changed[0]
        example = f"{old!r} of {file} is {new!r}"
        yield f"{len(changed)} recordings have ids that several files use, and are called after their file: {example}"


def _once(recordings: Sequence[Recording]) -> tuple[list[Recording], dict[str, str]]:
    """Without those that are identical to an earlier one; of these each one's id, and the earlier one's."""
    first: dict[str, Recording] = {}
    once = []
    repeats = {}
    for recording in recordings:
        known = digest(recording)
        earlier = recording if known is None else first.setdefault(known, recording)
        if earlier is recording:
            once.append(recording)
        else:
            repeats[recording.id] = earlier.id
    return once, repeats


def _repeated(repeats: Mapping[str, str]) -> Iterator[str]:
    if repeats:
        listed = [f"{name!r} is {earlier!r}" for name, earlier in repeats.items()][:_MOST_LISTED]
        more = f", and {len(repeats) - len(listed)} more" if len(repeats) > len(listed) else ""
        yield f"recordings with the very numbers of others count once: {', '.join(listed)}{more}"
