"""What a `report/1` says of several kinds of recordings, several campaigns of a skin, and a fleet of skins."""

from typing import Literal

from pydantic import BaseModel, Field

RecordingKind = Literal["frf", "indentation", "compression"]


class Scope(BaseModel):
    """Where a mechanism acts, of several campaigns or skins."""

    campaigns: list[str] | None = Field(default=None, description="Names of the campaigns.")
    sensors: list[str] | None = Field(default=None, description="Ids of the sensors.")
    skins: list[str] | None = Field(default=None, description="Ids of the skins.")
    since: str | None = Field(default=None, description="The date from which on it is there.")


class RelativeLevel(BaseModel):
    """The interval of a d33 to compare it with other sensors and campaigns, as wide as by the leading answer alone."""

    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")


class SensorLevel(BaseModel):
    """d33 of one sensor in one of several campaigns, over all answers by known mechanisms."""

    campaign: str = Field(description="Name of the campaign.")
    sensor: str = Field(description="Id of the sensor.")
    unit: str = Field(description="Of the three numbers.")
    value: float | None = Field(description="Its estimate.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")
    relative: RelativeLevel | None = Field(default=None, description="To compare sensors and campaigns.")


class CampaignLevel(BaseModel):
    """d33 of the array in one of several campaigns, over the sensors that these share and over all answers by known
    mechanisms."""

    campaign: str = Field(description="Name of the campaign.")
    unit: str = Field(description="Of the three numbers.")
    value: float | None = Field(description="Its estimate.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")
    relative: RelativeLevel | None = Field(default=None, description="To compare campaigns.")


class SkinValue(BaseModel):
    """A quantity of one skin of a fleet."""

    skin: str = Field(description="Id of the skin.")
    value: float | None = Field(description="Its estimate.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")


class KindParameter(BaseModel):
    """A parameter as one kind of recording alone tells it."""

    kind: RecordingKind = Field(description="The kind.")
    parameter: str = Field(description="Name of the parameter.", examples=["youngs_modulus"])
    unit: str = Field(description="Of the three numbers; - for none.")
    value: float | None = Field(description="Its estimate.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")


class Contradiction(BaseModel):
    """Kinds of recordings that are not of one material."""

    parameter: str = Field(description="What they disagree on.")
    kinds: list[RecordingKind] = Field(description="The kinds.")
    statement: str = Field(description="The same in words.")


class Departure(BaseModel):
    """A skin that departs from its fleet."""

    skin: str = Field(description="Id of the skin.")
    value: float | None = Field(description="Its own value.")
    probability: float = Field(description="Probability that it departs in this, 0 to 1.")


class Population(BaseModel):
    """One quantity over the skins of a fleet."""

    parameter: str = Field(description="Name of the quantity.", examples=["thickness"])
    unit: str = Field(description="Of all numbers; - for none.")
    mean: float | None = Field(description="Mean of the skins that do not depart.")
    sd: float | None = Field(description="Their standard deviation.")
    departures: list[Departure] = Field(description="Skins that depart in this quantity.")
    skins: list[SkinValue] = Field(description="One entry a skin.")
