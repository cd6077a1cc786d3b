"""Campaigns: what became of them, and what they hold. Written by scripts/client_documents.py."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from underskin.client.documents.document import Document


@dataclass(frozen=True, eq=False, kw_only=True)
class Sensor(Document):
    """A sensor of the array."""

    id: str
    """Its name, one of its own."""

    x_mm: float
    """Its centre along the skin's length [mm]."""

    y_mm: float
    """Its centre along the skin's width [mm]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Skin(Document):
    """The skin as the lab declares it."""

    poisson_ratio: float
    """Poisson's ratio ν of the elastomer, 0 to 0.5 [-]."""

    id: str | None
    """Its name, one of its own."""

    thickness_mm: float | None
    """Thickness h of the layer over the sensors [mm]; required by recordings of kind `frf`. Unless `units_checked`,
    0.01 to 100."""

    youngs_modulus_mpa: float | None
    """Young's modulus E of the layer [MPa]; required by recordings of kind `frf`. Unless `units_checked`, 0.001 to
    10000."""

    sensor_radius_mm: float | None
    """Radius rT of a sensor [mm]; required by recordings of kind `frf`. Unless `units_checked`, 0.01 to 100."""

    d33_pc_per_n: float | None
    """Piezoelectric coefficient d33 as declared [pC/N]; null where it is not known. Unless `units_checked`, 0.01 to
    10000 in magnitude."""

    width_mm: float | None
    """Extent of the skin along y [mm]. Unless `units_checked`, 0.1 to 10000."""

    length_mm: float | None
    """Extent of the skin along x [mm]. Unless `units_checked`, 0.1 to 10000."""

    tolerances: str | None
    """What the declared thickness, sensor radius and modulus may be off by; part of absolute intervals."""

    sensors: tuple[Sensor, ...] | None
    """The sensors of the array."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RecordingEntry(Document):
    """A recording without its arrays."""

    id: str
    """Its id in the campaign."""

    kind: str
    """`frf`, `indentation` or `compression`."""

    sensor: str | None
    """The sensor, where it has one."""

    recorded_at: str | None
    """When it was made, UTC."""

    excluded_at: str | None
    """When it was excluded, UTC; null where figures use it."""

    exclude_reason: str | None
    """Why it was excluded."""

    excluded_from: str | None
    """Name of the API key that excluded it, or, without one, the name that was typed on a page, if any."""

    scalars: Mapping[str, Any]
    """Its fields that are single values, as in campaign/1."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Refused(Document):
    """What is wrong with one value."""

    code: str | None
    """The kind of error; docs/findings.md explains each."""

    field: str
    """The field, with its row where it is a column."""

    value: Any
    """What was sent; null where nothing was."""

    allowed: str
    """What would be accepted."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RecordingResult(Document):
    """What became of one recording."""

    id: str
    """Its id in the campaign, or its place where it has none."""

    status: Literal["ok", "refused"]
    """`ok`: kept."""

    errors: tuple[Refused, ...]
    """Why it was refused; empty where it was kept, and where a note counts what is not told."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CampaignDetail(Document):
    """A campaign and its recordings, without their arrays."""

    id: str
    """Its name in this interface."""

    skin_id: str
    """The skin that it was sent for; that may have been joined to another since."""

    name: str
    """What the lab calls it."""

    state: Literal["current", "corrected", "withdrawn"]
    """Figures use `current` ones only."""

    received_at: str
    """When it arrived, UTC."""

    received_from: str | None
    """Name of the API key that it came with."""

    recorded_at: str | None
    """When its earliest recording was made, UTC, where recordings say so."""

    file: str | None
    """The name of the file that it came in, where it had one."""

    recordings: int
    """How many recordings it has."""

    excluded: int
    """How many of them figures leave out."""

    corrects: str | None
    """The campaign that it replaces."""

    correct_reason: str | None
    """Why it was corrected."""

    corrected_by: str | None
    """The campaign that replaces it."""

    withdrawn_at: str | None
    """When it was withdrawn, UTC."""

    withdraw_reason: str | None
    """Why."""

    withdrawn_from: str | None
    """Name of the API key that withdrew it, or, without one, the name that was typed on a page, if any."""

    discarded_at: str | None
    """When it was put away as a mere trial, UTC; lists leave it out."""

    remark: str | None
    """What the lab noted of it."""

    tags: tuple[str, ...]
    """Words that the lab finds it by."""

    skin: Skin
    """The skin as the campaign declares it."""

    entries: tuple[RecordingEntry, ...]
    """Its recordings."""

    refused: tuple[RecordingResult, ...]
    """Recordings that were sent with it and not kept."""

    notes: tuple[str, ...]
    """What its reader remarked."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CampaignEntry(Document):
    """A campaign without its recordings."""

    id: str
    """Its name in this interface."""

    skin_id: str
    """The skin that it was sent for; that may have been joined to another since."""

    name: str
    """What the lab calls it."""

    state: Literal["current", "corrected", "withdrawn"]
    """Figures use `current` ones only."""

    received_at: str
    """When it arrived, UTC."""

    received_from: str | None
    """Name of the API key that it came with."""

    recorded_at: str | None
    """When its earliest recording was made, UTC, where recordings say so."""

    file: str | None
    """The name of the file that it came in, where it had one."""

    recordings: int
    """How many recordings it has."""

    excluded: int
    """How many of them figures leave out."""

    corrects: str | None
    """The campaign that it replaces."""

    correct_reason: str | None
    """Why it was corrected."""

    corrected_by: str | None
    """The campaign that replaces it."""

    withdrawn_at: str | None
    """When it was withdrawn, UTC."""

    withdraw_reason: str | None
    """Why."""

    withdrawn_from: str | None
    """Name of the API key that withdrew it, or, without one, the name that was typed on a page, if any."""

    discarded_at: str | None
    """When it was put away as a mere trial, UTC; lists leave it out."""

    remark: str | None
    """What the lab noted of it."""

    tags: tuple[str, ...]
    """Words that the lab finds it by."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CampaignResult(Document):
    """What became of one campaign."""

    file: str | None
    """The name of the file that it came in, where it had one of its own."""

    status: Literal["ok", "refused"]
    """`ok`: kept, with the recordings that are `ok`."""

    id: str | None
    """Names the campaign from now on; null where it was refused."""

    skin_id: str | None
    """The skin that it is of; null where it was refused."""

    recordings: tuple[RecordingResult, ...]
    """One entry a recording: those kept, then those refused."""

    errors: tuple[Refused, ...]
    """Why the campaign as a whole was refused; empty where it was kept."""

    notes: tuple[str, ...]
    """What its reader remarked, such as a file that ends too early."""

    findings: tuple[str, ...]
    """What looks wrong in its times and its sensors' places, and is used all the same."""
