"""Reading of files of any supported format as campaigns, and joining of campaigns of one rig, such as a file a press.

Recordings are identical, whatever their ids, where their conditions and numbers are (`digest`).
"""

import hashlib
import io
import itertools
import math
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from itertools import chain
from pathlib import Path, PurePath
from typing import Any, BinaryIO

import numpy as np
import orjson

from underskin.errors import FileError, InvalidInput, conflicting, too_few
from underskin.findings.formatting import few
from underskin.recordings import curve_preparation, joined_files, rig_description, rig_guess, rig_mapping, validation
from underskin.recordings.campaign import (
    COLUMNS,
    Campaign,
    CompressionRecording,
    Recording,
    RecordingProblem,
    SkinDescription,
    from_dict,
)
from underskin.recordings.channels import Contents, Document
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.readers import formats
from underskin.recordings.readers.sandbox import call_apart, parse_apart
from underskin.recordings.rig_description import RigDescription
from underskin.recordings.validation import LONGEST_NAME
from underskin.units import Floats

_DESCRIBED = (
    "kind",
    "sensor",
    "indenter_radius_mm",
    "preload_n",
    "dynamic_force_n",
    "position_mm",
    "sample_height_mm",
    "sample_diameter_mm",
)
_GIVEN = ("frequency_hz", "time_s")  # columns that are chosen, not measured
_FEWEST_VALUES = 16  # different ones: noise makes no two measurements agree in so many


def digest(recording: Recording) -> str | None:
    """A hash that is equal for identical recordings; None where identity cannot be established.

    Identical recordings have the same kind, sensor, indenter, preload, dynamic force, position and sample, and the same
    numbers, digit for digit, in every column; ids, times and other conditions may differ. Measurements of fewer than 16
    different values, as in a table typed by hand, can agree by chance: then `recorded_at` must agree too, and without
    one no recording is identical to another.
    """
    columns = {name: values for name in COLUMNS if (values := getattr(recording, name, None)) is not None}
    measured = [values for name, values in columns.items() if name not in _GIVEN]
    described = {name: getattr(recording, name, None) for name in _DESCRIBED}
    if _agree_by_chance(measured):
        if recording.recorded_at is None:
            return None
        described["recorded_at"] = recording.recorded_at
    hasher = hashlib.blake2b(orjson.dumps(described), digest_size=16)
    for name, values in columns.items():
        hasher.update(f"{name} {len(values)} ".encode())
        hasher.update(np.asarray(values, "<f8").tobytes())
    return hasher.hexdigest()


def _agree_by_chance(measured: Iterable[Floats]) -> bool:
    """Whether other measurements could take the same values."""
    values = set()
    for value in chain.from_iterable(measured):
        values.add(value)
        if len(values) == _FEWEST_VALUES:
            return False
    return True


_SHEET_TEXT = "underskin.recordings.readers.xlsx_file:sheet_text"
LARGEST_TEXT = 8_000_000  # larger tables are parsed under the limits of binary files
_DRAFT = "`underskin read FILE --draft rig.yaml` writes one to complete"
_TEMPLATE = "; below lines about the skin, the first of them schema,campaign/1, it would be the CSV template"


@dataclass(frozen=True)
class Reading:
    """A file's campaign with its valid recordings, the problems of the others, warnings, and by field the channel that
    a rig description uses, in words (under the empty key how a text was read)."""

    campaign: Campaign
    problems: list[RecordingProblem]
    warnings: list[str]
    taken: Mapping[str, str] = field(default_factory=dict)

    def with_estimator(self, estimator: Estimator | None) -> "Reading":
        """The reading with this estimator for all time series; None changes nothing.

        A warning counts the recordings that it does not apply to.
        """
        if estimator is None:
            return self
        recordings = [recording.with_estimator(estimator) for recording in self.campaign.recordings]
        others = sum(new is old for new, old in zip(recordings, self.campaign.recordings, strict=True))
        messages = [f"{estimator} is for time series, which {others} of {len(recordings)} recordings are not"]
        campaign = replace(self.campaign, recordings=tuple(recordings))
        return replace(self, campaign=campaign, warnings=[*self.warnings, *(messages if others else [])])

    def with_curves_turned(self) -> "Reading":
        """The reading with negative force and displacement of curves reversed in sign, and a warning."""
        campaign, changed = curve_preparation.turned(self.campaign)
        if not changed:
            return self
        message = f"force or displacement of {changed} recordings, counted negative as they were pressed, were turned"
        return replace(self, campaign=campaign, warnings=[*self.warnings, message])


def read_file(source: Path | str | bytes, name: str, rig: RigDescription | None = None) -> Reading:
    """The campaign in a file; `source` is its path or its bytes, `name` its name in messages.

    The format follows from the content, for formats of other packages from the name. Files of channels need a rig
    description, unless their headings and header say all of it. Raises FileError that names the file and the place,
    InvalidInput where the campaign itself or its skin is invalid. Other files of a recording, which the rig description
    names (`join`), are read from the same folder.
    """
    return understood(read_contents(source, name, rig), name, rig)


def understood(contents: Contents | Document, name: str, rig: RigDescription | None = None) -> Reading:
    """The campaign of contents read by `read_contents`; raises as `read_file`."""
    if isinstance(contents, Document):
        return Reading(*from_dict(contents.campaign), list(contents.warnings))
    if rig is None:
        return _by_guess(contents, name)
    mapped = rig_mapping.apply(rig, contents, name)
    return Reading(*from_dict(mapped.document), mapped.warnings, mapped.taken)


def _by_guess(contents: Contents, name: str) -> Reading:
    """The campaign of channels that a file describes well enough itself, with a warning that says how it was read.

    Raises FileError that names what the file does not say.
    """
    document = rig_guess.of_contents(contents)
    lacking, unclear = rig_guess.missing(document), rig_guess.unclear(contents)
    doubt = f"more than one column or property may be {', '.join(unclear)}" if unclear else ""
    if lacking:
        doubt = f"the file does not say {', '.join(lacking)}"
    if not doubt:
        try:
            mapped = rig_mapping.apply(rig_description.from_dict(document), contents, name)
            return Reading(*from_dict(mapped.document), [rig_guess.said(document), *mapped.warnings], mapped.taken)
        except FileError as error:
            doubt = ": ".join(filter(None, (error.place, str(error.reason))))
        except InvalidInput as error:
            doubt = str(error)
    layout = f" ({contents.layout})" if contents.layout else ""
    reason = f"a rig description must say what its channels are ({_DRAFT}); it has {contents.described()}{layout}"
    raise FileError(name, "", f"{reason}; {doubt}{_TEMPLATE if rig_guess.holds_frfs(document) else ''}")


def read_contents(
    source: Path | str | bytes,
    name: str,
    rig: RigDescription | None = None,
    beside: Mapping[str, Path] | None = None,
) -> Contents | Document:
    """A file's channels, or its campaign document, before a rig description is applied, with the channels of the files
    that it names (`join`), in the same folder or `beside` it by their names; raises FileError."""
    contents = _parsed(source, name)
    if rig is None or rig.join is None or isinstance(contents, Document):
        return contents
    if isinstance(source, bytes) and beside is None:
        raise FileError(name, "", "is no file with others in its folder, which the rig description names (join)")
    others: dict[str, Contents] = {}
    first = Path(name) if beside is not None or isinstance(source, bytes) else Path(source)
    for file in joined_files.files_to_join(first, rig.join):
        if beside is not None and file.name not in beside:
            raise FileError(name, "", f"{file.name} belongs to it (join), and was not sent with it")
        other = _parsed(file if beside is None else beside[file.name], file.name)
        if isinstance(other, Document):
            raise FileError(file.name, "", f"is a campaign document, and no file of channels to join to {name} (join)")
        others[file.name] = other
    return joined_files.joined(contents, others, name)


def _parsed(source: Path | str | bytes, name: str) -> Contents | Document:
    with _opened(source, name) as stream:
        file_format = formats.detect(stream, name)
        size = stream.seek(0, io.SEEK_END)
        if formats.is_parsed_apart(file_format) or (file_format != "JSON" and size > LARGEST_TEXT):
            return parse_apart(file_format, stream, name)
        return formats.parse(file_format, stream, name)


def sheet_text(content: bytes, name: str, sheet: str | None = None) -> str:
    """A sheet of a workbook as text with cells separated by tabs: the named or the only one; raises FileError."""
    with _opened(content, name) as stream:
        return str(call_apart(_SHEET_TEXT, stream, name, *([] if sheet is None else [sheet]), what="XLSX")["text"])


@contextmanager
def _opened(source: Path | str | bytes, name: str) -> Iterator[BinaryIO]:
    """An open file; bytes go into one without a name."""
    if isinstance(source, bytes):
        with tempfile.TemporaryFile() as stream:
            stream.write(source)
            stream.flush()
            yield stream
        return
    try:
        opened = Path(source).open("rb")  # noqa: SIM115 (closed below)
    except OSError as error:
        raise FileError(name, "", f"cannot be opened: {error.strerror}") from None
    with opened:
        yield opened


_ROUNDING = 1e-6  # relative, and of positions [mm]: single precision, and conversions of units
_MOST_LISTED = 5  # repeats in a warning
_APART_MM = 100.0  # beyond what any layer of a skin transmits
_INDEX_LABEL = "recordings["  # how a refused recording without an id is named

Files = Sequence[tuple[str, Reading]]  # name and content of each file


def join(name: str, files: Files, skin_id: str | None = None) -> Reading:
    """One campaign called `name` of the recordings of all files, in order.

    The files must be of one skin: stated facts must agree, and the sensors are those of all files; where each has one,
    at the origin, they are put apart, and a warning says so. `skin_id` replaces the ids in the files. An id used by
    several files is preceded by the file's name. Of identical recordings (`digest`) only the first is kept, and a
    warning names the others. Raises InvalidInput that names the field and the two files where they differ.
    """
    name = validation.name("name", name, False)
    if not files:
        raise too_few("files", "none", "must be at least one")
    files, of_places = _put_apart(files)
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
    warnings = [*_warnings(files), *of_places, *_renamed(files, names), *_repeated(repeats)]
    return Reading(Campaign(name, skin, tuple(recordings), units_checked), problems, warnings)


def _put_apart(files: Files) -> tuple[Files, list[str]]:
    """The files; where several have a single sensor each, at the origin, their places among each other are not known,
    and they are put apart, with a warning."""
    skins = [reading.campaign.skin.sensors for _, reading in files]
    in_arrays = {sensor.id for sensors in skins for sensor in sensors if len(sensors) > 1}
    single = [sensors[0] for sensors in skins if len(sensors) == 1]
    at_origin = [sensor.id for sensor in single if not (sensor.x_mm or sensor.y_mm or sensor.id in in_arrays)]
    places = {name: number * _APART_MM for number, name in enumerate(dict.fromkeys(at_origin))}
    if len(places) < 2:
        return files, []
    listed = few(list(places), _MOST_LISTED)
    warning = f"each of {listed} lies at x 0 mm, y 0 mm in its file: they are taken to be far from each other"
    return [(file, _moved(reading, places)) for file, reading in files], [warning]


def _moved(reading: Reading, places: Mapping[str, float]) -> Reading:
    """The reading with its single sensor, and what is pressed beside it, moved along x to its place [mm]."""
    campaign = reading.campaign
    if len(campaign.skin.sensors) != 1 or campaign.skin.sensors[0].id not in places:
        return reading
    x = places[campaign.skin.sensors[0].id]
    recordings = [
        replace(recording, position_mm=(recording.position_mm[0] + x, recording.position_mm[1]))
        if not isinstance(recording, CompressionRecording) and recording.position_mm is not None
        else recording
        for recording in campaign.recordings
    ]
    skin = replace(campaign.skin, sensors=(replace(campaign.skin.sensors[0], x_mm=x),))
    return replace(reading, campaign=replace(campaign, skin=skin, recordings=tuple(recordings)))


def _skin(files: Files, skin_id: str | None) -> SkinDescription:
    """The common skin of the files."""
    facts: dict[str, tuple[Any, str]] = {}  # by field: its value, and the first file that states it
    sensors = {}
    for file, reading in files:
        skin = reading.campaign.skin if skin_id is None else replace(reading.campaign.skin, id=skin_id)
        for name, value in _facts(skin):
            first, other = facts.setdefault(name, (value, file))
            if not _same(value, first):
                allowed = f"in {file}; must be {first!r}, as in {other}: files are joined where they are of one skin"
                raise conflicting(f"skin.{name}", value, allowed)
        sensors.update({sensor.id: sensor for sensor in skin.sensors if sensor.id not in sensors})
    declared = {
        model_field.name: facts[model_field.name][0]
        for model_field in fields(SkinDescription)
        if model_field.name in facts
    }
    return SkinDescription(**declared, sensors=tuple(sensors.values()))


def _facts(skin: SkinDescription) -> Iterator[tuple[str, Any]]:
    """Each stated field, and each sensor's position, by its name in errors."""
    for model_field in fields(skin):
        value = getattr(skin, model_field.name)
        if model_field.name != "sensors" and value is not None:
            yield model_field.name, value
    for sensor in skin.sensors:
        yield f"sensors[{sensor.id}].x_mm", sensor.x_mm
        yield f"sensors[{sensor.id}].y_mm", sensor.y_mm


def _same(value: Any, other: Any) -> bool:
    if not isinstance(value, float):
        return bool(value == other)
    return math.isclose(value, other, rel_tol=_ROUNDING, abs_tol=_ROUNDING)


def _names(files: Files) -> list[dict[str, str]]:
    """For each file, the ids of its recordings in the campaign by their ids in the file."""
    ids = [_ids(reading) for _, reading in files]
    uses = Counter(name for file_ids in ids for name in file_ids)
    unique = {name for name in uses if uses[name] == 1 and not name.startswith(_INDEX_LABEL)}
    taken = set(unique)
    alike: Counter[str] = Counter()
    names = []
    for (file, _), file_ids in zip(files, ids, strict=True):
        stem = "".join(letter for letter in PurePath(file).stem if letter.isprintable())
        alike[stem] += 1
        label = stem if alike[stem] == 1 else f"{stem} ({alike[stem]})"
        new = {name: name for name in file_ids if name in unique}
        for name in file_ids:
            if name not in unique:
                new[name] = _free(label, "" if name == stem else name, taken)
                taken.add(new[name])
        names.append(new)
    return names


def _ids(reading: Reading) -> list[str]:
    """The distinct ids of valid and rejected recordings."""
    good = [recording.id for recording in reading.campaign.recordings]
    return list(dict.fromkeys([*good, *(problem.recording for problem in reading.problems)]))


def _free(label: str, name: str, taken: set[str]) -> str:
    """An unused id: the file's label and the id, with a number if needed."""
    named = f" {name}" if name else ""
    ends = (named if number == 1 else f"{named} ({number})" for number in itertools.count(1))
    all_free = ((label[: max(0, LONGEST_NAME - len(end))] + end)[-LONGEST_NAME:].strip() for end in ends)
    return next(free for free in all_free if free not in taken)


def _warnings(files: Files) -> Iterator[str]:
    """Each distinct warning, with the files that it is about."""
    about: dict[str, list[str]] = {}
    for file, reading in files:
        for warning in reading.warnings:
            about.setdefault(warning, []).append(file)
    for warning, (first, *others) in about.items():
        yield f"{first}{f' and {len(others)} more' if others else ''}: {warning}"


def _renamed(files: Files, names: Sequence[dict[str, str]]) -> Iterator[str]:
    changed = [
        (file, old, new)
        for (file, _), new_ids in zip(files, names, strict=True)
        for old, new in new_ids.items()
        if old != new and not old.startswith(_INDEX_LABEL)
    ]
    if changed:
        file, old, new = changed[0]
        example = f"{old!r} of {file} is {new!r}"
        yield f"{len(changed)} recordings have ids that several files use, and are called after their file: {example}"


def _once(recordings: Sequence[Recording]) -> tuple[list[Recording], dict[str, str]]:
    """The distinct recordings, and for each repeat its id with the id of the earlier recording."""
    first: dict[str, Recording] = {}
    distinct = []
    repeats = {}
    for recording in recordings:
        key = digest(recording)
        earlier = recording if key is None else first.setdefault(key, recording)
        if earlier is recording:
            distinct.append(recording)
        else:
            repeats[recording.id] = earlier.id
    return distinct, repeats


def _repeated(repeats: Mapping[str, str]) -> Iterator[str]:
    if repeats:
        listed = [f"{name!r} is {earlier!r}" for name, earlier in repeats.items()][:_MOST_LISTED]
        more = f", and {len(repeats) - len(listed)} more" if len(repeats) > len(listed) else ""
        yield f"recordings with the very numbers of others count once: {', '.join(listed)}{more}"
