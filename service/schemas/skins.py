"""What the routes of skins answer and take."""

from typing import Any, Literal

from pydantic import BaseModel, Field

from service.schemas.base import StrictRequest
from service.schemas.campaigns import ReasonText


class JoinedSkin(BaseModel):
    """A skin that counts as another."""

    id: str = Field(description="Its own id; campaigns sent for it keep it.")
    joined_to: str = Field(description="The skin it was joined to.")
    joined_at: str = Field(description="When, UTC.")
    reason: str = Field(description="Why.")


class SkinEntry(BaseModel):
    """A skin."""

    id: str = Field(description="Its id.")
    created_at: str = Field(description="When its first campaign arrived, UTC.")
    campaigns: int = Field(description="How many campaigns it and the skins joined to it have, in any state.")
    title: str | None = Field(description="What the lab calls it besides its id.")
    tags: list[str] = Field(description="Words that the lab finds it by.")


class SkinList(BaseModel):
    """A page of skins, by id."""

    skins: list[SkinEntry] = Field(description="At most `limit` of them; those joined to another are under that one.")
    next: str | None = Field(description="Send it as `cursor` for the next page; null on the last.")


class SkinDetail(BaseModel):
    """A skin and what was joined to it."""

    id: str = Field(description="Its id.")
    created_at: str = Field(description="When its first campaign arrived, UTC.")
    title: str | None = Field(description="What the lab calls it besides its id.")
    remark: str | None = Field(description="What the lab noted of it.")
    tags: list[str] = Field(description="Words that the lab finds it by.")
    discarded_at: str | None = Field(description="When it was put away, UTC; lists leave it out.")
    joined: list[JoinedSkin] = Field(description="Skins that count as this one.")
    differences: list[str] = Field(
        description="What skins that count as one declare differently, in words; figures use each campaign's own.",
        examples=[["youngs_modulus_mpa is 16 of palm-3 and 9 of palm-3b"]],
    )
    rig: dict[str, Any] | None = Field(description="The rig description in use for its files (`rig/1`).")


class Join(StrictRequest):
    """Says that two ids mean one skin."""

    skin_id: str = Field(description="The skin that counts as this one from now on.", examples=["palm-3b"])
    reason: ReasonText = Field(description="Why.")


class Point(BaseModel):
    """One campaign's d33 of a sensor."""

    campaign_id: str = Field(description="The campaign.")
    time: str = Field(description="When it was recorded, or else received, UTC.")
    time_is: Literal["recorded", "received"] = Field(description="Which of the two.")
    model: Literal["paper", "adopted"] = Field(description="The model that d33 rests on.")
    model_id: str | None = Field(description="Which adopted model; null with `paper`.")
    d33_pc_per_n: float = Field(description="d33 [pC/N].")
    d33_uncertainty_pc_per_n: float = Field(description="Its standard uncertainty [pC/N].")


class TrendAnswer(BaseModel):
    """A straight line through the points: weighted least squares, its scatter counted where it exceeds the weights."""

    slope_pc_per_n_per_year: float = Field(description="Slope [pC/N a year].")
    slope_uncertainty_pc_per_n_per_year: float = Field(description="Its standard uncertainty.")
    p_value: float = Field(description="Of a slope this far from 0 where there is none (Student's t, two-sided).")
    p_value_adjusted: float = Field(description="The same, adjusted for the number of sensors looked at (Holm).")
    significant: bool = Field(description="Whether p_value_adjusted is below 0.05.")


class SensorDeparture(BaseModel):
    """The change of a sensor's d33 relative to the array's, from its first campaign to its last."""

    change_percent: float = Field(description="Relative change [%].")
    change_low_percent: float = Field(description="Lower end of its 95 % interval [%].")
    change_high_percent: float = Field(description="Upper end of its 95 % interval [%].")
    significant: bool = Field(description="Whether it is beyond chance, for the number of sensors (Holm, 5 %).")


class ArrayPoint(BaseModel):
    """One campaign's d33 of the array, over the sensors that the campaigns share."""

    campaign_id: str = Field(description="The campaign.")
    time: str = Field(description="When it was recorded, UTC.")
    d33_pc_per_n: float = Field(description="d33 [pC/N].")
    d33_uncertainty_pc_per_n: float = Field(description="Its standard uncertainty between campaigns [pC/N].")


class ArrayTrend(BaseModel):
    """What d33 of the array did: one change that all sensors share, with sensors that depart from it left out."""

    points: list[ArrayPoint] = Field(description="By time.")
    sensors: list[str] = Field(description="Those that it is pooled over.")
    days: int = Field(description="From the first point to the last.")
    change_percent: float = Field(description="Relative change between these [%].")
    change_low_percent: float = Field(
        description="Lower end of its 95 % interval [%]; of three dates or more it holds their common scatter."
    )
    change_high_percent: float = Field(description="Upper end of its 95 % interval [%].")
    significant: bool = Field(description="Whether that interval leaves out 0.")
    dead_since: dict[str, str] = Field(
        description="Sensors that show no charge beyond noise, with the time since when."
    )
    statement: str = Field(description="The same in words, with the sensors that depart.")


class SensorHistory(BaseModel):
    """d33 of one sensor over time."""

    sensor: str = Field(description="Its id.")
    points: list[Point] = Field(description="By time.")
    trend: TrendAnswer | None = Field(description="Null where `no_trend` says why.")
    no_trend: str | None = Field(
        description="Why there is none: fewer than three points, one timed by its arrival, or less than a day in all."
    )
    departure: SensorDeparture | None = Field(
        default=None,
        description="Null with fewer than two points, or fewer than three sensors to compare.",
    )


class LeftOutCampaign(BaseModel):
    """A campaign that figures do not use."""

    campaign_id: str = Field(description="The campaign.")
    reason: str = Field(description="Why.")
    repeats: str | None = Field(
        default=None, description="The campaign that counts in its place, where it has recordings of that one."
    )


class LeftOutPoint(BaseModel):
    """A campaign's d33 of a sensor that does not count, since recordings that it rests on count elsewhere."""

    campaign_id: str = Field(description="The campaign, of which other sensors count.")
    sensor: str = Field(description="The sensor.")
    repeats: str = Field(description="The campaign in which they count.")
    reason: str = Field(description="Why, in words.")


class LeftOutRecording(BaseModel):
    """A recording that figures do not use."""

    campaign_id: str = Field(description="Its campaign.")
    recording: str = Field(description="Its id there.")
    reason: str = Field(description="Why.")


class History(BaseModel):
    """d33 of each sensor over time, and what that leaves out."""

    skin_id: str = Field(description="The skin; the one it was joined to, where it was.")
    joined: list[JoinedSkin] = Field(description="Skins that are counted in.")
    differences: list[str] = Field(
        description="What skins that count as one declare differently, in words; figures use each campaign's own.",
        examples=[["youngs_modulus_mpa is 16 of palm-3 and 9 of palm-3b"]],
    )
    array: ArrayTrend | None = Field(
        default=None,
        description="d33 of the array; null where fewer than two campaigns with times, a day apart, share a sensor.",
    )
    sensors: list[SensorHistory] = Field(description="By id.")
    left_out_campaigns: list[LeftOutCampaign] = Field(
        description="Withdrawn, corrected, without d33, or only with recordings that count in another campaign."
    )
    left_out_points: list[LeftOutPoint] = Field(
        description="Those with recordings that count in another campaign, of campaigns that are used."
    )
    left_out_recordings: list[LeftOutRecording] = Field(description="Excluded from campaigns that are used.")


class Imported(BaseModel):
    """What an import brought."""

    skin_id: str = Field(description="The skin.")
    kept: int = Field(description="How many campaigns are new here.")
    present: int = Field(description="How many were here already, the same.")
