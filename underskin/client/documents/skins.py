"""Skins, what was joined to them, and d33 over time. Written by scripts/client_documents.py."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from underskin.client.documents.document import Document


@dataclass(frozen=True, eq=False, kw_only=True)
class ArrayPoint(Document):
    """One campaign's d33 of the array, over the sensors that the campaigns share."""

    campaign_id: str
    """The campaign."""

    time: str
    """When it was recorded, UTC."""

    d33_pc_per_n: float
    """d33 [pC/N]."""

    d33_uncertainty_pc_per_n: float
    """Its standard uncertainty between campaigns [pC/N]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ArrayTrend(Document):
    """What d33 of the array did: one change that all sensors share, with sensors that depart from it left out."""

    points: tuple[ArrayPoint, ...]
    """By time."""

    sensors: tuple[str, ...]
    """Those that it is pooled over."""

    days: int
    """From the first point to the last."""

    change_percent: float
    """Relative change between these [%]."""

    change_low_percent: float
    """Lower end of its 95 % interval [%]; of three dates or more it holds their common scatter."""

    change_high_percent: float
    """Upper end of its 95 % interval [%]."""

    significant: bool
    """Whether that interval leaves out 0."""

    dead_since: Mapping[str, str]
    """Sensors that show no charge beyond noise, with the time since when."""

    statement: str
    """The same in words, with the sensors that depart."""


@dataclass(frozen=True, eq=False, kw_only=True)
class JoinedSkin(Document):
    """A skin that counts as another."""

    id: str
    """Its own id; campaigns sent for it keep it."""

    joined_to: str
    """The skin it was joined to."""

    joined_at: str
    """When, UTC."""

    reason: str
    """Why."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Point(Document):
    """One campaign's d33 of a sensor."""

    campaign_id: str
    """The campaign."""

    time: str
    """When it was recorded, or else received, UTC."""

    time_is: Literal["recorded", "received"]
    """Which of the two."""

    model: Literal["paper", "adopted"]
    """The model that d33 rests on."""

    model_id: str | None
    """Which adopted model; null with `paper`."""

    d33_pc_per_n: float
    """d33 [pC/N]."""

    d33_uncertainty_pc_per_n: float
    """Its standard uncertainty [pC/N]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TrendAnswer(Document):
    """A straight line through the points: weighted least squares, its scatter counted where it exceeds the weights."""

    slope_pc_per_n_per_year: float
    """Slope [pC/N a year]."""

    slope_uncertainty_pc_per_n_per_year: float
    """Its standard uncertainty."""

    p_value: float
    """Of a slope this far from 0 where there is none (Student's t, two-sided)."""

    p_value_adjusted: float
    """The same, adjusted for the number of sensors looked at (Holm)."""

    significant: bool
    """Whether p_value_adjusted is below 0.05."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SensorDeparture(Document):
    """The change of a sensor's d33 beside the array's, from its first campaign to its last."""

    change_percent: float
    """Relative change [%]."""

    change_low_percent: float
    """Lower end of its 95 % interval [%]."""

    change_high_percent: float
    """Upper end of its 95 % interval [%]."""

    significant: bool
    """Whether it is beyond chance, for the number of sensors (Holm, 5 %)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SensorHistory(Document):
    """d33 of one sensor over time."""

    sensor: str
    """Its id."""

    points: tuple[Point, ...]
    """By time."""

    trend: TrendAnswer | None
    """Null where `no_trend` says why."""

    no_trend: str | None
    """Why there is none: fewer than three points, one timed by its arrival, or less than a day in all."""

    departure: SensorDeparture | None
    """Null with fewer than two points, or fewer than three sensors to tell it from the others."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LeftOutCampaign(Document):
    """A campaign that figures do not use."""

    campaign_id: str
    """The campaign."""

    reason: str
    """Why."""

    repeats: str | None
    """The campaign that counts in its place, where it has recordings of that one."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LeftOutPoint(Document):
    """A campaign's d33 of a sensor that does not count, since recordings that it rests on count elsewhere."""

    campaign_id: str
    """The campaign, of which other sensors count."""

    sensor: str
    """The sensor."""

    repeats: str
    """The campaign in which they count."""

    reason: str
    """Why, in words."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LeftOutRecording(Document):
    """A recording that figures do not use."""

    campaign_id: str
    """Its campaign."""

    recording: str
    """Its id there."""

    reason: str
    """Why."""


@dataclass(frozen=True, eq=False, kw_only=True)
class History(Document):
    """d33 of each sensor over time, and what that leaves out."""

    skin_id: str
    """The skin; the one it was joined to, where it was."""

    joined: tuple[JoinedSkin, ...]
    """Skins that are counted in."""

    differences: tuple[str, ...]
    """What skins that count as one declare differently, in words; figures use each campaign's own."""

    array: ArrayTrend | None
    """d33 of the array; null where fewer than two campaigns with times, a day apart, share a sensor."""

    sensors: tuple[SensorHistory, ...]
    """By id."""

    left_out_campaigns: tuple[LeftOutCampaign, ...]
    """Withdrawn, corrected, without d33, or only with recordings that count in another campaign."""

    left_out_points: tuple[LeftOutPoint, ...]
    """Those with recordings that count in another campaign, of campaigns that are used."""

    left_out_recordings: tuple[LeftOutRecording, ...]
    """Excluded from campaigns that are used."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SkinDetail(Document):
    """A skin and what was joined to it."""

    id: str
    """Its id."""

    created_at: str
    """When its first campaign arrived, UTC."""

    title: str | None
    """What the lab calls it beside its id."""

    remark: str | None
    """What the lab noted of it."""

    tags: tuple[str, ...]
    """Words that the lab finds it by."""

    discarded_at: str | None
    """When it was put away, UTC; lists leave it out."""

    joined: tuple[JoinedSkin, ...]
    """Skins that count as this one."""

    differences: tuple[str, ...]
    """What skins that count as one declare differently, in words; figures use each campaign's own."""

    rig: Mapping[str, Any] | None
    """The rig description in use for its files (`rig/1`)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SkinEntry(Document):
    """A skin."""

    id: str
    """Its id."""

    created_at: str
    """When its first campaign arrived, UTC."""

    campaigns: int
    """How many campaigns it and the skins joined to it have, in any state."""

    title: str | None
    """What the lab calls it beside its id."""

    tags: tuple[str, ...]
    """Words that the lab finds it by."""
