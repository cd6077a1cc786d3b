"""What a report says of several kinds of recordings, campaigns or skins. Written by scripts/client_documents.py."""

from dataclasses import dataclass
from typing import Literal

from underskin.client.documents.document import Document


@dataclass(frozen=True, eq=False, kw_only=True)
class CampaignLevel(Document):
    """d33 of the array in one of several campaigns, over the sensors that these share."""

    campaign: str
    """Name of the campaign."""

    unit: str
    """Of the three numbers."""

    value: float | None
    """Its estimate."""

    low: float | None
    """Lower end of its 95 % interval between campaigns."""

    high: float | None
    """Upper end of its 95 % interval between campaigns."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Contradiction(Document):
    """Kinds of recordings that are not of one material."""

    parameter: str
    """What they disagree on."""

    kinds: tuple[Literal["frf", "indentation", "compression"], ...]
    """The kinds."""

    statement: str
    """The same in words."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Departure(Document):
    """A skin that departs from its fleet."""

    skin: str
    """Id of the skin."""

    value: float | None
    """Its own value."""

    probability: float
    """Probability that it departs in this, 0 to 1."""


@dataclass(frozen=True, eq=False, kw_only=True)
class KindParameter(Document):
    """A parameter as one kind of recording alone tells it."""

    kind: Literal["frf", "indentation", "compression"]
    """The kind."""

    parameter: str
    """Name of the parameter."""

    unit: str
    """Of the three numbers; - for none."""

    value: float | None
    """Its estimate."""

    low: float | None
    """Lower end of its 95 % interval."""

    high: float | None
    """Upper end of its 95 % interval."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SkinValue(Document):
    """A quantity of one skin of a fleet."""

    skin: str
    """Id of the skin."""

    value: float | None
    """Its estimate."""

    low: float | None
    """Lower end of its 95 % interval."""

    high: float | None
    """Upper end of its 95 % interval."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Population(Document):
    """One quantity over the skins of a fleet."""

    parameter: str
    """Name of the quantity."""

    unit: str
    """Of all numbers; - for none."""

    mean: float | None
    """Mean of the skins that do not depart."""

    sd: float | None
    """Their standard deviation."""

    departures: tuple[Departure, ...]
    """Skins that depart in this quantity."""

    skins: tuple[SkinValue, ...]
    """One entry a skin."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Scope(Document):
    """Where a mechanism acts, of several campaigns or skins."""

    campaigns: tuple[str, ...] | None
    """Names of the campaigns."""

    sensors: tuple[str, ...] | None
    """Ids of the sensors."""

    skins: tuple[str, ...] | None
    """Ids of the skins."""

    since: str | None
    """The date from which on it is there."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SensorLevel(Document):
    """d33 of one sensor in one of several campaigns."""

    campaign: str
    """Name of the campaign."""

    sensor: str
    """Id of the sensor."""

    unit: str
    """Of the three numbers."""

    value: float | None
    """Its estimate."""

    low: float | None
    """Lower end of its 95 % interval."""

    high: float | None
    """Upper end of its 95 % interval."""
