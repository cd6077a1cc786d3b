"""A preload that is typed once for several files, or was for earlier ones, beside what each file's own force says."""

import html
import io
import re

import httpx
import numpy as np
import pytest
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
from playwright.sync_api import expect

from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING, token_of
from tests.service.pages.test_pages_workbench import read_it
from tests.service.pages.uploads import file, look_at
from tests.support.store_server import Server

RATE_HZ, SAMPLES = 1024, 2048
TIME = np.arange(SAMPLES) / RATE_HZ


def shaken(static: np.ndarray | float) -> bytes:
    """A shaker about a static force [N], in newtons and picocoulombs."""
    shaking = 0.1 * np.random.default_rng(3).normal(size=SAMPLES)
    timing = {"wf_increment": 1 / RATE_HZ, "wf_start_offset": 0.0}
    buffer = io.BytesIO()
    with TdmsWriter(buffer) as writer:
        channels = [
            ChannelObject("press 1", name, values, {**timing, "unit_string": unit})
            for name, values, unit in (("Force", static + shaking, "N"), ("Charge", 7 * shaking, "pC"))
        ]
        writer.write_segment([RootObject({}), GroupObject("press 1", {}), *channels])
    return buffer.getvalue()


RIG = """\
schema: rig/1
kind: frf
skin: {thickness_mm: 2.5, youngs_modulus_mpa: 16, poisson_ratio: 0.5, sensor_radius_mm: 1.5,
       sensors: [{id: s1, x_mm: 0, y_mm: 0}]}
recording: {sensor: s1, indenter_radius_mm: 4, preload_n: 1}
channels: {force_n: {channel: Force}, charge_pc: {channel: Charge}}
"""


def test_stated_preload_held_against_force_file(server: Server) -> None:
    """A stated preload is held against the force of each file."""
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as client:
        form = {"form_token": token_of(client.get("/upload").text)}
        files = [("file", (f"{force}.tdms", shaken(force))) for force in (1.0, 2.0)]
        answer = client.post("/upload", data=form, files=[*files, ("rig", ("rig.yaml", RIG))], follow_redirects=True)
    assert "<b>2</b> recordings understood" in answer.text
    assert answer.text.count("as stated, but its force is") == 1
    assert "2.0.tdms: pressed by 1 N as stated, but its force is 2.00 N on average" in html.unescape(answer.text)


@pytest.mark.soak
def test_typed_preload_held_against_force_file(visitor: Visit) -> None:
    """A typed preload is held against the force of each file."""
    page = visitor.page
    # A piezo sensor goes to 0 from the preload that it was pressed by; a creeping one never holds still.
    piezo, creeping = file("piezo.tdms", shaken(2 * np.exp(-8 * TIME))), file("creeping.tdms", shaken(3 - 0.5 * TIME))
    files = [file("one.tdms", shaken(1.0)), file("two.tdms", shaken(2.0)), piezo, creeping]
    look_at(visitor, files, skin="pressed")
    for label, value in (
        ("thickness h", "2.5"), ("Young's modulus", "16"), ("sensor radius", "1.5"), ("Layout", "s1, 0, 0"),
        ("sensor that was pressed, of all these files", "s1"), ("sphere radius R", "4"),
        ("preload F, of all these files", "1"),
    ):  # fmt: skip
        page.get_by_label(label).first.fill(value)
    read_it(page)
    expect(page.get_by_role("status").first).to_contain_text("4 recordings understood")
    told = page.get_by_text("as stated, but its force is")
    expect(told).to_have_count(1)
    expect(told).to_contain_text("two.tdms: pressed by 1 N as stated, but its force is 2.00 N on average")
    page.get_by_role("link", name="two.tdms").click()
    expect(page.get_by_role("region", name="Recordings")).to_contain_text("1 N (its force: 2.00 N), sphere radius 4 mm")
    visitor.require_accessible()

    page.get_by_text("What the channels are").click()
    page.get_by_text("What differs from file to file").click()
    region = page.get_by_role("region", name="What differs from file to file")
    region.get_by_label("preload F of two.tdms").fill("2,0")
    region.get_by_label("date and time of recording of one.tdms").fill("some day")
    radius = region.get_by_label("sphere radius R of one.tdms")
    radius.fill("-4")
    read_it(page)
    expect(page.get_by_role("alert")).to_contain_text("one.tdms: date and time of recording")
    expect(radius).to_have_accessible_description(re.compile("^one.tdms: sphere radius R -4"))
    radius.fill("")
    assert region.get_by_label("preload F of two.tdms").input_value() == "2,0"
    region.get_by_label("date and time of recording of one.tdms").fill("2026-05-03")
    read_it(page)
    expect(page.get_by_role("status").first).to_contain_text("4 recordings understood")
    expect(told).to_have_count(0)
    visitor.require_accessible()
    page.get_by_label("one campaign, called").check()
    page.get_by_role("button", name="Keep 4 recordings").click()
    page.wait_for_url("**/campaigns/*")
    page.get_by_text("How its files were read").click()
    expect(page.get_by_text("two.tdms: said of this file alone: preload F 2 N")).to_be_visible()
    kept = visitor.page.request.get(f"{visitor.address}/v1{page.url.removeprefix(visitor.address)}/document").json()
    assert [one["preload_n"] for one in kept["recordings"]] == [1, 2, 1, 1]
    assert [str(one.get("recorded_at"))[:10] for one in kept["recordings"]].count("2026-05-03") == 1

    page.set_viewport_size({"width": 390, "height": 844})
    look_at(visitor, [file("later.tdms", shaken(2.0))], skin="pressed")
    banner = page.get_by_role("form", name="Read as before")
    expect(banner).to_contain_text("What was typed then counts for this file too: ")
    expect(banner).to_contain_text("sensor that was pressed s1; sphere radius R 4 mm; preload F 1 N")
    expect(told).to_contain_text("pressed by 1 N as stated, but its force is 2.00 N on average")
    visitor.require_accessible()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.get_by_text("What the channels are").click()
    page.get_by_label("preload F").first.fill("2.3")  # nearer than a fifth
    read_it(page)
    expect(page.get_by_role("status").first).to_contain_text("1 recording understood")
    expect(told).to_have_count(0)
