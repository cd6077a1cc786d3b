"""From uploaded files to campaigns, with what is wrong in each."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import orjson

from service.problems import Refusal
from service.uploads import Upload
from underskin import InvalidInput
from underskin.recordings.campaign import Campaign, RecordingProblem, from_dict

_BOM = b"\xef\xbb\xbf"
_LONGEST_ID = 200


@dataclass(frozen=True)
class Arrived:
    """What one campaign became: None where the whole was refused; `refused` has one entry a recording."""

    file: str | None
    campaign: Campaign | None = None
    errors: list[dict[str, Any]] = field(default_factory=list)
    refused: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def read(upload: Upload, most_json_bytes: int) -> list[Arrived]:
    """The campaigns of a file, by its content: JSON may hold one or a list of them."""
    if first_letter(upload) in (b"{", b"["):
        return _read_json(upload, most_json_bytes)
    return []


def first_letter(upload: Upload) -> bytes:
    """What a file begins with, byte order mark and blanks aside."""
    with upload.path.open("rb") as file:
        return file.read(64).removeprefix(_BOM).lstrip()[:1]


def _read_json(upload: Upload, most_bytes: int) -> list[Arrived]:
    if upload.path.stat().st_size > most_bytes:
        limit = f"{most_bytes / 1e6:g} MB (UNDERSKIN_MAX_BODY_MB)"
        raise Refusal(413, f"JSON may have up to {limit}; send more in several requests, or as HDF5.")
    try:
        document = orjson.loads(upload.path.read_bytes().removeprefix(_BOM))
    except orjson.JSONDecodeError as error:
        allowed = f"must be JSON; line {error.lineno}, column {error.colno}: {error.msg}"
        return [Arrived(upload.label, errors=[_error("file", upload.label, allowed)])]
    documents = document if isinstance(document, list) else [document]
    return [_checked(upload.label, entry) for entry in documents]


def _checked(label: str | None, document: Any) -> Arrived:
    try:
        campaign, problems = from_dict(document)
        require_usable("skin.id", campaign.skin.id)
    except InvalidInput as error:
        place = error.field if error.index is None else f"{error.field}[{error.index}]"
        return Arrived(label, errors=[_error(place, error.value, error.allowed)])
    return with_problems(label, campaign, problems)


def with_problems(
    label: str | None, campaign: Campaign, problems: Iterable[RecordingProblem], notes: Iterable[str] = ()
) -> Arrived:
    """A campaign with its refused recordings; one of which nothing is left is refused as a whole."""
    refused: dict[str, list[Mapping[str, Any]]] = {}
    for problem in problems:
        refused.setdefault(problem.recording, []).append(_error(problem.field, problem.value, problem.allowed))
    entries = [{"id": name, "errors": errors} for name, errors in refused.items()]
    if campaign.recordings:
        return Arrived(label, campaign, refused=entries, notes=list(notes))
    nothing = _error("recordings", f"{len(entries)} refused", "must hold at least one recording without errors")
    return Arrived(label, errors=[nothing], refused=entries, notes=list(notes))


def require_usable(name: str, skin_id: str | None) -> None:
    """Refuses a skin's id that cannot be part of an address (InvalidInput)."""
    if skin_id is None:
        return
    plain = skin_id.isprintable() and "/" not in skin_id and skin_id not in (".", "..")
    if not plain or not skin_id.strip() or len(skin_id) > _LONGEST_ID:
        raise InvalidInput(name, skin_id, f"must be a printable text of 1 to {_LONGEST_ID} characters without /")


def _error(name: str, value: Any, allowed: str) -> dict[str, Any]:
    return {"field": name, "value": value, "allowed": allowed}
