"""From uploaded files to campaigns, with what is wrong in each."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import orjson

from service.problems import Refusal
from service.uploads import Upload
from underskin import InvalidInput
from underskin.errors import FileError
from underskin.recordings.campaign import Campaign, RecordingProblem, from_dict
from underskin.recordings.reading import read_file
from underskin.recordings.rig_description import RigDescription

_BOM = b"\xef\xbb\xbf"
_LONGEST_ID = 200
_UNNAMED = "the upload"


@dataclass(frozen=True)
class Arrived:
    """What one campaign became: None where the whole was refused; `refused` has one entry a recording."""

    file: str | None
    campaign: Campaign | None = None
    errors: list[dict[str, Any]] = field(default_factory=list)
    refused: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    by_rig: bool = False  # whether a rig description was needed to read it


def read(upload: Upload, rig: RigDescription | None, most_json_bytes: int) -> list[Arrived]:
    """The campaigns of a file, by its content: JSON may hold one or a list of them."""
    if first_letter(upload) in (b"{", b"["):
        return _read_json(upload, most_json_bytes)
    try:
        found = read_file(upload.path, upload.label or _UNNAMED, rig)
        require_usable("skin.id", found.campaign.skin.id)
    except FileError as error:
        allowed = ": ".join(part for part in (error.place, error.reason) if part)
        return [Arrived(upload.label, errors=[_error("file", upload.label, allowed)])]
    except InvalidInput as error:
        return [Arrived(upload.label, errors=[_invalid(error)])]
    return [_arrived(upload.label, found.campaign, found.problems, found.warnings, by_rig=rig is not None)]


def first_letter(upload: Upload) -> bytes:
    """What a file begins with, byte order mark and blanks aside."""
    with upload.path.open("rb") as file:
        return file.read(64).removeprefix(_BOM).lstrip()[:1]


def require_usable(name: str, skin_id: str | None) -> None:
    """Refuses a skin's id that cannot be part of an address (InvalidInput)."""
    if skin_id is None:
        return
    plain = skin_id.isprintable() and "/" not in skin_id and skin_id not in (".", "..")
    if not plain or not skin_id.strip() or len(skin_id) > _LONGEST_ID:
        raise InvalidInput(name, skin_id, f"must be a printable text of 1 to {_LONGEST_ID} characters without /")


def _read_json(upload: Upload, most_bytes: int) -> list[Arrived]:
    if upload.path.stat().st_size > most_bytes:
        limit = f"{most_bytes / 1e6:g} MB (UNDERSKIN_MAX_BODY_MB)"
        raise Refusal(413, f"JSON may have up to {limit}; send more in several requests, or as HDF5.")
    try:
        document = orjson.loads(upload.path.read_bytes().removeprefix(_BOM))
    except orjson.JSONDecodeError as error:
        if upload.field is None:
            raise Refusal(
                400, f"The body is not JSON: line {error.lineno}, column {error.colno}: {error.msg}."
            ) from None
        allowed = f"must be JSON; line {error.lineno}, column {error.colno}: {error.msg}"
        return [Arrived(upload.label, errors=[_error("file", upload.label, allowed)])]
    documents = document if isinstance(document, list) else [document]
    return [_checked(upload.label, entry) for entry in documents]


def _checked(label: str | None, document: Any) -> Arrived:
    try:
        campaign, problems = from_dict(document)
        require_usable("skin.id", campaign.skin.id)
    except InvalidInput as error:
        return Arrived(label, errors=[_invalid(error)])
    return _arrived(label, campaign, problems, [], by_rig=False)


def _arrived(
    label: str | None,
    campaign: Campaign,
    problems: Iterable[RecordingProblem],
    notes: list[str],
    *,
    by_rig: bool,
) -> Arrived:
    """A campaign with its refused recordings; one of which nothing is left is refused as a whole."""
    refused: dict[str, list[Mapping[str, Any]]] = {}
    for problem in problems:
        refused.setdefault(problem.recording, []).append(_error(problem.field, problem.value, problem.allowed))
    entries = [{"id": name, "errors": errors} for name, errors in refused.items()]
    if campaign.recordings:
        return Arrived(label, campaign, refused=entries, notes=notes, by_rig=by_rig)
    nothing = _error("recordings", f"{len(entries)} refused", "must hold at least one recording without errors")
    return Arrived(label, errors=[nothing], refused=entries, notes=notes)


def _invalid(error: InvalidInput) -> dict[str, Any]:
    place = error.field if error.index is None else f"{error.field}[{error.index}]"
    return _error(place, error.value, error.allowed)


def _error(name: str, value: Any, allowed: str) -> dict[str, Any]:
    return {"field": name, "value": value, "allowed": allowed}
