"""`campaign/1` in the OpenAPI document is what the service reads: what the one refuses, the other does."""

import os
from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

import httpx
import orjson
import pytest

from tests.support.campaign_documents import COMPRESSION, FRF, INDENTATION, TIME_SERIES, document
from tests.support.document_schemas import campaign_validator
from tests.support.repository import ROOT
from underskin.errors import ErrorCode, InvalidInput
from underskin.recordings.campaign import from_dict

SHARED = os.environ.get("UNDERSKIN_CAMPAIGNS")
VALID = campaign_validator()
CONDITIONS = {"temperature_c": 23.5, "operator": "mb", "humidity": None}
RECORDINGS = {
    "frf": {**FRF, "kind": "frf", "conditions": CONDITIONS},
    "time series": {**TIME_SERIES, "estimator": "Hv", "conditions": CONDITIONS},
    "indentation": {**INDENTATION, "sensor": "s01", "stage_stiffness_n_per_mm": 12.0, "conditions": CONDITIONS},
    "compression": {**COMPRESSION, "time_s": [0.0, 1.0], "dwell_s": 3.0, "load_cycles": 2},
}
# What JSON Schema does not say: relations of fields, likely magnitudes, what a date is.
RELATIONS = {ErrorCode.UNLIKELY_MAGNITUDE, ErrorCode.UNEQUAL_LENGTHS, ErrorCode.NOT_INCREASING, ErrorCode.NOT_UNIQUE}
VALUES: tuple[Any, ...] = (None, "a word", " ", "", -1.0, 0.0, 0.3, 12, 1e7, True, [], ["x"], [1.0], [0.0, 2.0], {})


def refusals(campaign: Any) -> list[InvalidInput]:
    """What the reader refuses of it, or of its recordings."""
    try:
        _, problems = from_dict(campaign)
    except InvalidInput as refusal:
        return [refusal]
    return [problem.as_error(problem.field) for problem in problems]


def files() -> Iterator[Path]:
    for folder in (ROOT / "examples", ROOT / "service" / "pages" / "start" / "example", SHARED):
        if folder is not None:
            yield from Path(folder).rglob("*.json")


@pytest.mark.slow
def test_every_campaign_that_is_at_hand_is_valid() -> None:
    tried = 0
    for file in files():
        campaign = orjson.loads(file.read_bytes())
        if campaign.get("schema") == "campaign/1":
            tried += 1
            VALID.validate(campaign)
    assert tried >= 6


@pytest.mark.parametrize("kind", RECORDINGS)
def test_a_recording_with_every_field_is_valid(kind: str) -> None:
    campaign = document(RECORDINGS[kind], units_checked=False)
    assert refusals(campaign) == []
    VALID.validate(campaign)


@pytest.mark.parametrize("kind", RECORDINGS)
def test_reader_and_schema_agree_on_every_field_of_a_recording(kind: str) -> None:
    known = {
        *RECORDINGS[kind],
        "kind",
        "position_mm",
        "coherence",
        "time_s",
        "recorded_at",
        "charge_pc",
        "estimator",
        "nonsense",
    }
    agree(document(RECORDINGS[kind]), ("recordings", 0), known)


def test_reader_and_schema_agree_on_every_field_of_a_skin_and_its_sensors() -> None:
    campaign = document(RECORDINGS["compression"])
    agree(campaign, ("skin",), {*campaign["skin"], "nonsense"})
    agree(campaign, ("skin", "sensors", 0), {"id", "x_mm", "y_mm", "nonsense"})
    agree(campaign, (), {*campaign, "nonsense"} - {"recordings"})


def agree(campaign: dict[str, Any], place: tuple[Any, ...], names: set[str]) -> None:
    """Leave each field out, and put each of VALUES into it: what one refuses the other does."""
    accepted = refused = 0
    for name in sorted(names):
        for value in (..., *VALUES):
            changed = deepcopy(campaign)
            entry: Any = changed
            for step in place:
                entry = entry[step]
            if value is ...:
                entry.pop(name, None)
            else:
                entry[name] = value
            found, valid = refusals(changed), VALID.is_valid(changed)
            by_reader = [error for error in found if error.code not in RELATIONS]
            said = f"{name} = {value!r}: the schema says {valid}, the reader {found}"
            if not valid:
                assert found or name == "kind", said  # any kind that is false in Python stands for frf
            if by_reader and not beyond(name, by_reader[0]):
                assert not valid, said
            accepted += valid
            refused += not valid
    assert accepted >= 2
    assert refused > len(names)


def beyond(name: str, error: InvalidInput) -> bool:
    """Whether only the reader can know: which sensors there are, what is a date, what an `frf` needs of the skin."""
    return name in ("sensor", "recorded_at", "sensors") or error.place.startswith("skin.")


def test_the_document_gives_back_what_the_schema_describes(http: httpx.Client) -> None:
    campaign = document(*RECORDINGS.values(), name="every kind")
    sent = http.post("/v1/campaigns", json=campaign).json()
    assert {entry["status"] for entry in sent["recordings"]} == {"ok"}
    VALID.validate(http.get(f"/v1/campaigns/{sent['id']}/document").json())
