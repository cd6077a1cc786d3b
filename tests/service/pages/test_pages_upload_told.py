"""What an upload tells of a campaign before it is kept, and what stays told of a raw file afterwards."""

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.service.pages.conftest import Visit
from tests.service.pages.uploads import as_json, campaigns_of, file, look_at
from tests.support.store_server import Server, campaign

SAMPLES, RATE_HZ = 2048, 2000


def pressed() -> str:
    """A shaker on one sensor: a load cell of 2.25 V/N that turns the sign, an amplifier of 10 mV/pC."""
    random = np.random.default_rng(3)
    time = np.arange(SAMPLES) / RATE_HZ
    force = 1 + 0.09 * random.normal(size=SAMPLES)
    charge = 7 * (force - 1) + 0.001 * random.normal(size=SAMPLES)
    rows = zip(time, -2.25 * force, 0.01 * charge, strict=True)
    lines = [f"{at:.6f},{cell:.6f},{amplifier:.6f}" for at, cell, amplifier in rows]
    return "\n".join(["Time [s],Load cell [V],Amplifier [V]", *lines])


def fill_in(page: Page) -> None:
    """What the channels of `pressed` are, with a last sample beyond its end, as a person types them."""
    for channel, field, sign, sensitivity, unit in (
        ("Load cell [V]", "force", "−", "2.25", "V/N"),
        ("Amplifier [V]", "charge", "as it is", "10", "mV/pC"),
    ):
        page.get_by_label(f"What {channel} is", exact=True).select_option(label=field)
        page.get_by_label(f"Sign of {channel}", exact=True).select_option(label=sign)
        page.get_by_label(f"Sensitivity of {channel}", exact=True).fill(sensitivity)
        page.get_by_label(f"Unit of the sensitivity of {channel}", exact=True).fill(unit)
    for name, value in (("sensor", "s0"), ("indenter_radius_mm", "4"), ("preload_n", "1"), ("last_sample", "5000")):
        page.locator(f"#{name}").fill(value)


def read_it(page: Page) -> None:
    page.get_by_role("button", name="Read it with these settings").click()
    page.wait_for_load_state()


def test_campaign_declares_notes_shown(visitor: Visit) -> None:
    """What a campaign declares and notes is shown before and after it is kept."""
    page = visitor.page
    document = campaign("hand of May", sensors=6, id="noted")
    for number, recording in enumerate(document["recordings"]):
        recording["conditions"] = {"temperature_c": 23.5 + number} | ({"operator": "mb"} if number else {})
    look_at(visitor, [file("may.json", as_json(document))])
    facts = page.locator("dl.facts").inner_text().replace("\xa0", " ")
    for said in ("thickness\n2.5 mm", "Young's modulus, declared\n16 MPa", "sensor radius\n1.5 mm"):
        assert said in facts
    places = page.get_by_role("region", name="Where its sensors are")
    expect(places).to_be_hidden()
    page.get_by_text("Where its sensors are").click()
    assert places.get_by_role("row", name="s5").inner_text().split() == ["s5", "40", "0"]
    row = page.get_by_role("row", name="s1-2N")
    for said in ("2017", "26.5", "mb"):
        assert said in row.inner_text()
    visitor.require_accessible()
    page.get_by_role("button", name="Keep 12 recordings").click()
    page.wait_for_url("**/campaigns/*")
    assert page.locator("#recordings th[scope=col]").all_inner_texts()[-3:] == ["temperature_c", "operator", "State"]
    assert page.get_by_role("row", name="s0-1N").inner_text().split()[-4:] == ["23.5", "–", "in", "use"]
    visitor.require_accessible()


@pytest.mark.soak
def test_recording_array_tells_how_how_many(visitor: Visit, server: Server) -> None:
    """One recording of an array tells when how and of how many sensors."""
    page = visitor.page
    dated = campaign("hand of April", sensors=6, id="hand")
    server.http.post("/v1/campaigns", json=dated).raise_for_status()
    look_at(visitor, [file("press.csv", pressed())], skin="hand")
    expect(page.get_by_text("2000 Hz by the times of Time [s]")).to_be_visible()
    fill_in(page)
    read_it(page)
    expect(page.get_by_text(f"samples 1 to {SAMPLES} are used: the curve ends there")).to_be_visible()

    keep = page.get_by_role("button", name="Keep 1 recording")
    page.get_by_text("What the channels are").click()
    page.locator("#indenter_radius_mm").fill("5")
    expect(keep).to_be_disabled()
    expect(page.get_by_text("The form below was changed")).to_be_visible()
    page.locator("#first_sample").fill("6000")
    page.locator("#recorded_at").fill("May")
    read_it(page)
    alert = page.get_by_role("alert")
    assert "must be above first sample used, 6000" in alert.inner_text()
    assert "must be a date, or a date and time, such as" in alert.inner_text()
    expect(keep).to_be_disabled()
    assert "was read before that" in page.locator("#keep-why-not").inner_text()
    with page.expect_navigation():  # as a page would send it that was opened before
        page.evaluate("document.querySelector('form.keep').submit()")
    expect(keep).to_be_disabled()
    assert len(campaigns_of(server, "hand")) == 1
    visitor.require_accessible()

    for name, value in (("first_sample", ""), ("last_sample", ""), ("recorded_at", "3.5.2026 14:30")):
        page.locator(f"#{name}").fill(value)
    read_it(page)
    page.get_by_role("button", name="Discard").click()
    page.wait_for_url("**/upload")
    visitor.require_accessible()
    page.get_by_role("button", name="Undo: discarded press.csv").click()
    page.wait_for_url("**/upload/*")
    keep.click()
    page.wait_for_url("**/campaigns/*")
    assert "from 1 of 6 sensors" in page.locator(".result").inner_text()
    page.get_by_text("How its files were read").click()
    for said in (
        "force: 'Load cell [V]', in the unit of its label, through 2.25 V/N, turned round",
        "sensor that was pressed s0; sphere radius R 5 mm; preload F 1 N; date and time of recording 2026-05-03T14:30",
    ):
        expect(page.get_by_text(said)).to_be_visible()
    (kept, _) = [server.http.get(f"/v1/campaigns/{one}").json() for one in campaigns_of(server, "hand")]
    assert kept["recorded_at"].startswith("2026-05-03T14:30")

    for path in ("/skins/hand", "/"):
        visitor.go(path)
        assert "from 1 of 6 sensors" in page.locator("main").inner_text()
    visitor.go("/loads?skin=hand")
    expect(page.get_by_text("is that of the array in press, from 1 of 6 sensors")).to_be_visible()
