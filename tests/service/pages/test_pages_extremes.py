"""Pages of campaigns with extreme numbers and dates: as they are sent, and as an earlier underskin kept them."""

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.store import campaigns
from tests.service.in_process import InProcess, in_process
from tests.service.pages.forms import BROWSING
from tests.support.store_server import campaign
from underskin.recordings.campaign import Campaign, FrfRecording, IndentationRecording, parse

FIRST, LAST = "0001-01-01T00:00:00Z", "9999-12-31T23:59:59.999999Z"
BEYOND = (1e300, -1e300, 1e-300)
DATES = (FIRST, LAST, "0001-01-01T00:00:00+14:00", "1000-01-01", "8999-12-31T23:59:59.999999-12:00")
ZONES = ("America/New_York", "Europe/Rome")
PAGES = (
    "/", "/skins/{skin}", "/skins/{skin}?sensor=s0", "/skins/{skin}/map.csv", "/skins/{skin}/history.csv",
    "/campaigns/{id}", "/campaigns/{id}?show=s0", "/campaigns/{id}/frf.csv", "/campaigns/{id}/preload.csv",
    "/campaigns/{id}/d33.csv", "/campaigns/{id}/curves.csv", "/v1/campaigns/{id}", "/v1/campaigns/{id}/d33",
    "/v1/campaigns/{id}/document", "/v1/skins/{skin}", "/v1/skins/{skin}/history",
)  # fmt: skip


def curve() -> dict[str, Any]:
    depth = np.linspace(0.0, 0.2, 40)
    entry = {"id": "curve", "kind": "indentation", "indenter_radius_mm": 4.0, "displacement_mm": depth.tolist()}
    return {**entry, "force_n": (5 * depth**1.5).tolist()}


def document(name: str = "extreme") -> dict[str, Any]:
    made = campaign(name, sensors=2, lines=6, d33_pc_per_n=14.0)
    made["recordings"].append(curve())
    return {**made, "units_checked": True}


def mutated() -> list[dict[str, Any]]:
    """Campaigns with one field beyond all bounds, with many at their bounds, and with extreme dates."""
    made: list[dict[str, Any]] = []

    def another(name: str) -> dict[str, Any]:
        made.append(document(name))
        return made[-1]

    for number in BEYOND:
        for field in ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "d33_pc_per_n"):
            another(f"{field} {number}")["skin"][field] = number
        for field in ("indenter_radius_mm", "preload_n", "dynamic_force_n", "dwell_s", "frf_re_pc_per_n"):
            entry = another(f"{field} {number}")["recordings"][0]
            entry[field] = [number] * 6 if field == "frf_re_pc_per_n" else number
    for size, skin in ((1e6, 1e6), (1e-9, 1e-9), (1e6, 2.0), (1e-9, 2.0)):
        edge = another(f"at the bounds {size} {skin}")
        edge["skin"] |= {"thickness_mm": skin, "sensor_radius_mm": skin}
        edge["skin"]["sensors"][1] = {"id": "s1", "x_mm": -size, "y_mm": size}
        for entry in edge["recordings"][:2]:
            entry |= {"indenter_radius_mm": size, "preload_n": 10 * size, "dynamic_force_n": 10 * size, "dwell_s": 1e12}
            entry |= {"frf_re_pc_per_n": [-1e9, 1e9, 1e-9, 0.0, 1e-300, 1.0], "position_mm": [size, -size]}
            entry["conditions"] = {"temperature": -1e20, "humidity": 1e-300}
        edge["recordings"][-1] |= {"displacement_mm": [size * place / 40 for place in range(40)]}
    for number, date in enumerate(DATES):
        dated = another(f"date {date}")
        for entry in dated["recordings"][: 3 if number else 5]:
            entry["recorded_at"] = date
    return made


async def failures(service: InProcess, kept: Sequence[tuple[str, str]]) -> list[str]:
    """The pages of campaigns (id, skin) that are not answered."""
    failed = []
    async with service.client() as client:
        for campaign_id, skin in kept:
            for path in dict.fromkeys(page.format(id=campaign_id, skin=skin) for page in PAGES):
                answer = await client.get(path, headers={} if path.startswith("/v1") else BROWSING)
                if answer.status_code >= 500:
                    failed.append(f"{path}: {answer.status_code}")
    return failed


@pytest.mark.parametrize("zone", ZONES)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_every_page_of_what_is_sent_is_answered(zone: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each number or date is refused by recording and field, or every page of it is answered."""
    monkeypatch.setenv("UNDERSKIN_TIME_ZONE", zone)
    documents = [one for one in mutated() if zone == ZONES[0] or one["name"].startswith("date")]

    async def sent(service: InProcess) -> list[tuple[str, str]]:
        kept = []
        async with service.client() as client:
            for number, one in enumerate(documents):
                answer = await client.post(f"/v1/campaigns?skin=skin{number}", json=one)
                assert answer.status_code in (201, 422), answer.text
                if answer.status_code == 201:
                    kept.append((answer.json()["id"], f"skin{number}"))
        return kept

    async def both(service: InProcess) -> tuple[int, list[str]]:
        kept = await sent(service)
        return len(kept), await failures(service, kept)

    with in_process(tmp_path) as service:
        count, failed = asyncio.run(both(service))
    assert count >= (5 if zone == ZONES[0] else len(DATES) - 1)  # the first date is of all recordings, and refuses them
    assert failed == []


def kept_before() -> list[Campaign]:
    """Campaigns as an earlier underskin kept them."""
    good = parse(document())
    made: list[Campaign] = []
    changes: tuple[tuple[int, dict[str, Any]], ...] = (
        (0, {"recorded_at": FIRST}),
        (0, {"recorded_at": LAST}),
        (0, {"recorded_at": "0001-01-01T00:00:00+14:00"}),
        (0, {"frf_re_pc_per_n": np.full(6, 1e300)}),
        (0, {"frf_im_pc_per_n": np.full(6, -1e300)}),
        (0, {"indenter_radius_mm": 1e-300}),
        (0, {"preload_n": 1e300}),
        (0, {"position_mm": (1e300, -1e300)}),
        (0, {"dwell_s": 1e300, "conditions": {"temperature": -1e300}}),
        (-1, {"force_n": np.linspace(0, 1e300, 40)}),
        (-1, {"displacement_mm": np.linspace(0, 1e300, 40)}),
        (-1, {"force_n": np.linspace(0, 1e-300, 40)}),
    )
    for place, change in changes:
        entries: list[Any] = list(good.recordings)
        assert isinstance(entries[place], FrfRecording | IndentationRecording)
        entries[place] = replace(entries[place], **change)
        made.append(replace(good, name=f"kept {len(made)}", recordings=tuple(entries)))
    for field in ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm"):
        for size in (1e300, 1e-300):
            skin: dict[str, Any] = {field: size}
            made.append(replace(good, name=field, skin=replace(good.skin, **skin)))
    return made


@pytest.mark.parametrize("zone", ZONES)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_every_page_of_what_was_kept_is_answered(zone: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages outlive what an earlier underskin took."""
    monkeypatch.setenv("UNDERSKIN_TIME_ZONE", zone)
    with in_process(tmp_path) as service:
        kept = []
        for number, one in enumerate(kept_before()[: None if zone == ZONES[0] else 3]):
            arrival = campaigns.NewCampaign(one, f"skin{number}")
            campaign_id, _ = service.store.write(campaigns.add, arrival)
            kept.append((campaign_id, f"skin{number}"))
        assert asyncio.run(failures(service, kept)) == []
