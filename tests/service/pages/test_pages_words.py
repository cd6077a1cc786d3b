"""What pages say of numbers: one value, one interval, digits that agree, in words for who is no statistician."""

import re

import pytest

from service.pages.shared.formats import end_of, given, interval, number
from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING
from tests.support.store_server import Server, campaign


@pytest.mark.parametrize(
    ("numbers", "shown"),
    [
        ((13.2468, 13.1119, 13.3912), "13.25 (95 %: 13.11 to 13.39)"),
        ((1234.6, 1030.2, 1439.0), "1235 (95 %: 1030 to 1439)"),
        ((-0.00123, -0.0019, -0.0004), "−0.00123 (95 %: −0.00190 to −0.00040)"),
        ((-6.7e-05, -0.077, 0.077), "0.000 (95 %: −0.077 to 0.077)"),
        ((7.0, 7.0, 7.0), "7.000 (95 %: 7.000 to 7.000)"),
    ],
)
def test_digits_value_interval_agree(numbers: tuple[float, float, float], shown: str) -> None:
    """Digits of a value and its interval agree."""
    assert re.sub("<[^>]*>", "", interval(*numbers)) == shown
    places = {len(part.partition(".")[2]) for part in re.findall(r"[\d.]+", shown.replace("95 %", ""))}
    ends = [re.sub("<[^>]*>", "", end_of(one, *numbers[1:])) for one in numbers]
    assert {len(end.partition(".")[2]) for end in ends} == places
    assert len(places) == 1


def test_campaign_says_sensors_differ_averaged(server: Server, visitor: Visit) -> None:
    """A campaign says what its sensors differ by and what was averaged."""
    page = visitor.page
    sent = server.http.post("/v1/campaigns?skin=words", json=campaign("alike", sensors=6, lines=60)).raise_for_status()
    place = f"/campaigns/{sent.json()['id']}"
    answer = server.http.get(f"/v1{place}/d33").json()
    visitor.go(place)
    text = page.get_by_role("main").inner_text().replace("\xa0", " ")
    spread = answer["sensor_spread_percent"]
    assert ("differ by less than can be measured" in text) == (spread["low"] < 0.05 * spread["high"])
    value, low, high = map(float, re.search(r"([\d.]+) pC/N \(95 %: ([\d.]+) to ([\d.]+)\)", text).groups())  # type: ignore[union-attr]
    array = answer["array"]
    for shown, exact in ((value, "d33_pc_per_n"), (low, "d33_low_pc_per_n"), (high, "d33_high_pc_per_n")):
        assert shown == pytest.approx(array[exact], abs=(high - low) / 20)
    assert "where the response is flat within 2 %" in text
    page.get_by_text("Why this band").click()
    assert page.get_by_text("no resonance in any recording").is_visible()
    visitor.require_accessible()


def test_date_without_time_day_whatever_zone(server: Server, visitor: Visit) -> None:
    """A date without a time is that day whatever the zone."""
    document = campaign("of a day", sensors=1)
    for recording in document["recordings"]:
        recording["recorded_at"] = "2026-05-03T00:00:00+00:00"
    kept = server.http.post("/v1/campaigns?skin=day", json=document).raise_for_status().json()["id"]
    page = visitor.page
    visitor.go(f"/campaigns/{kept}")
    assert page.locator("dt:text-is('recorded') + dd").inner_text() == "3 May 2026"
    assert ":" in page.locator("dt:text-is('received') + dd").inner_text()


def test_length_no_sign_refused_without_words(server: Server) -> None:
    """A length that has no sign is refused without words on magnitude."""
    asked = {"thickness_mm": "2.5", "youngs_modulus_mpa": "16", "poisson_ratio": "0.5", "sensor_radius_mm": "1.5"}
    asked |= {"indenter_radius_mm": "0.001", "preload_n": "1"}
    told = server.http.get("/field", params=asked, headers=BROWSING).text
    assert "must be 0.05 to 1000 mm" in told
    assert "in magnitude" not in told


def test_what_was_not_given_has_no_unit() -> None:
    assert [re.sub("<[^>]*>", "", given(value, "mm")) for value in (2.5, None)] == ["2.5&nbsp;mm", "–"]
    signed = [re.sub("<[^>]*>", "", shown) for shown in (given(-30.2), given(-0.0), number(-1.5), number(-0.0))]
    assert signed == ["−30.2", "0", "−1.50", "0"]


@pytest.mark.parametrize("second", [1.0, 0.7])
def test_array_s_interval_not_symmetric(server: Server, second: float) -> None:
    """An array s interval that is not symmetric is explained where it stands.

    Of a skin declared exactly: usual tolerances hide how the interval lies.
    """
    skin, document = f"second sensor {second}", campaign("two sensors", sensors=2)
    exact = dict.fromkeys(("thickness_percent", "sensor_radius_percent", "youngs_modulus_percent"), 0)
    document["skin"] = {**document["skin"], "tolerances": exact}
    for recording in document["recordings"][2:]:
        recording["frf_re_pc_per_n"] = [second * value for value in recording["frf_re_pc_per_n"]]
    kept = server.http.post("/v1/campaigns", json=document, params={"skin": skin}).raise_for_status().json()["id"]
    array = server.http.get(f"/v1/campaigns/{kept}/d33").json()["array"]
    value, low, high = (array[f"d33{part}_pc_per_n"] for part in ("", "_low", "_high"))
    lopsided = second == 1
    assert ((high - value) / (value - low) > 1.14) == lopsided
    assert ((high - value) / (value - low) < 1.05) != lopsided
    for path in (f"/campaigns/{kept}", f"/skins/{skin}"):
        page = server.http.get(path, headers=BROWSING).text
        assert page.count("The interval reaches further up than down: a sphere that misses the middle") == lopsided


def test_load_looks_wrong_named_line(visitor: Visit) -> None:
    """A load that looks wrong is named by its line."""
    visitor.go("/loads?loads=10+8+4+1%0A14+16+10+60")
    assert "Check load in line 2:" in visitor.page.locator(".note[role=status]").first.inner_text()
    visitor.require_accessible()
