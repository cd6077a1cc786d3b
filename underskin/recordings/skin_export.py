"""All stored data of a skin in one HDF5 file, `skin-export/1`.

/                     attributes schema, skin
/skins, /rigs         JSON text: the stored skins and their rigs, a list of objects
/diagnoses, /models   JSON text: diagnoses with their reports, and adopted models; absent in older files
/changes              JSON text: the log of changes, with author and reason; absent in older files
/campaigns/<id>       JSON text `about` (an object) and `recordings` (a list of objects, without arrays); for each
                      array the concatenated values of all recordings in `arrays/<name>`, and the number of values of
                      each recording in `lengths/<name>`, 0 for a recording without it
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
import orjson

from underskin.errors import FileError
from underskin.recordings.readers import hdf5_guard
from underskin.recordings.readers.hdf5_file import MAGIC
from underskin.recordings.readers.parsing_limits import ParsingLimits
from underskin.recordings.readers.sandbox import call_apart
from underskin.units import Floats

SCHEMA = "skin-export/1"
_ANY_SCHEMA = "skin-export/"
_NOTHING = np.empty(0)
_EXPANSION = 1000.0  # a column of a simulated campaign may hold one value, and its gzip next to nothing


@dataclass(frozen=True, eq=False)
class ExportedCampaign:
    """The stored data of a campaign, of its recordings, and their arrays."""

    about: dict[str, Any]
    recordings: list[dict[str, Any]]
    arrays: list[dict[str, Floats]]

    def same_as(self, other: "ExportedCampaign") -> bool:
        """Whether both are identical, to the last digit."""
        return (self.about, self.recordings) == (other.about, other.recordings) and all(
            own_arrays.keys() == other_arrays.keys()
            and all(np.array_equal(own_arrays[name], other_arrays[name]) for name in own_arrays)
            for own_arrays, other_arrays in zip(self.arrays, other.arrays, strict=True)
        )


@dataclass(frozen=True)
class Overview:
    """The skin, the stored data of it and of those joined to it, and the ids of their campaigns."""

    skin: str
    skins: list[dict[str, Any]]
    rigs: list[dict[str, Any]]
    campaigns: list[str]
    diagnoses: list[dict[str, Any]] = field(default_factory=list)
    models: list[dict[str, Any]] = field(default_factory=list)
    changes: list[dict[str, Any]] = field(default_factory=list)


@contextmanager
def writing(file: Path, overview: Overview) -> Iterator[Any]:
    """A new file; the block adds the campaigns by `write_campaign`, one in memory at a time."""
    with h5py.File(file, "w", libver="latest") as target:
        target.attrs["schema"], target.attrs["skin"] = SCHEMA, overview.skin
        for name in ("skins", "rigs", "diagnoses", "models", "changes"):
            _write_text(target, name, getattr(overview, name))
        target.create_group("campaigns", track_order=True)
        yield target


def write_campaign(target: Any, name: str, campaign: ExportedCampaign) -> None:
    """Add a campaign to an open file."""
    group = target["campaigns"].create_group(name)
    _write_text(group, "about", campaign.about)
    _write_text(group, "recordings", campaign.recordings)
    for column in dict.fromkeys(column for arrays in campaign.arrays for column in arrays):
        parts = [arrays.get(column, _NOTHING) for arrays in campaign.arrays]
        group[f"lengths/{column}"] = np.array([len(part) for part in parts], dtype=np.int64)
        group.create_dataset(f"arrays/{column}", data=np.concatenate(parts), compression="gzip", shuffle=True)


def _limits() -> ParsingLimits:
    return replace(ParsingLimits.from_environment(), expansion=_EXPANSION)


def is_export(stream: BinaryIO, file: str) -> bool:
    """Whether a file is an export of any version, by its content; False for an unreadable file."""
    stream.seek(0)
    if stream.read(len(MAGIC)) != MAGIC:
        return False
    try:
        return bool(call_apart(f"{__name__}:_is_export", stream, file, what="HDF5", limits=_limits())["is_export"])
    except FileError:
        return False


def read_overview(stream: BinaryIO, file: str) -> Overview:
    """The overview of an export, read in a child process; raises FileError where it is none, or damaged."""
    return Overview(**call_apart(f"{__name__}:_overview", stream, file, what=SCHEMA, limits=_limits()))


def read_campaigns(stream: BinaryIO, file: str, names: Sequence[str]) -> list[ExportedCampaign]:
    """Some campaigns of an export, read in a child process; raises FileError."""
    content = call_apart(
        f"{__name__}:_campaigns", stream, file, orjson.dumps(names).decode(), what=SCHEMA, limits=_limits()
    )
    return [ExportedCampaign(**campaign) for campaign in content["campaigns"]]


def _is_export(stream: BinaryIO) -> dict[str, Any]:
    try:
        with h5py.File(stream, "r") as source:
            return {"is_export": str(source.attrs.get("schema")).startswith(_ANY_SCHEMA)}
    except OSError as error:
        raise FileError("", "", hdf5_guard.damage(error)) from None


def _overview(stream: BinaryIO) -> dict[str, Any]:
    with _opened(stream) as source:
        rows = {name: _text(source, name) for name in ("skins", "rigs")}
        rows |= {name: _text(source, name) for name in ("diagnoses", "models", "changes") if name in source}
        return {"skin": str(source.attrs["skin"]), **rows, "campaigns": list(source["campaigns"])}


def _campaigns(stream: BinaryIO, names: str) -> dict[str, Any]:
    with _opened(stream) as source:
        return {"campaigns": [_campaign(source["campaigns"][name]) for name in orjson.loads(names)]}


@contextmanager
def _opened(stream: BinaryIO) -> Iterator[Any]:
    with hdf5_guard.opened(stream, "", "the export") as source:
        schema = str(source.attrs.get("schema"))
        if schema.startswith(_ANY_SCHEMA) and schema != SCHEMA:
            raise FileError("", "/", f"is an export of another underskin: {schema}; this one reads {SCHEMA}")
        if schema != SCHEMA:
            raise FileError("", "/", f"is no export of a skin: it needs the attribute schema = {SCHEMA}")
        yield source


def _campaign(group: Any) -> dict[str, Any]:
    recordings = _text(group, "recordings")
    arrays: list[dict[str, Floats]] = [{} for _ in recordings]
    for column in group.get("arrays", ()):
        ends = np.cumsum(group["lengths"][column][()])
        parts = np.split(group["arrays"][column][()].astype(np.float64), ends[:-1])
        for recording_arrays, part in zip(arrays, parts, strict=True):
            if len(part):
                recording_arrays[column] = part
    return {"about": _text(group, "about"), "recordings": recordings, "arrays": arrays}


def _text(group: Any, name: str) -> Any:
    return orjson.loads(group[name][()].tobytes())


def _write_text(group: Any, name: str, document: Any) -> None:
    group[name] = np.frombuffer(orjson.dumps(document), np.uint8)
