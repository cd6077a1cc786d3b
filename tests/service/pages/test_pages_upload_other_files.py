"""Files of a skin that are not as its last ones were: read afresh; and what somebody is told before they are kept."""

import io
from typing import Any

import numpy as np
import pytest
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
from playwright.sync_api import expect

from tests.service.pages.conftest import Visit
from tests.service.pages.test_pages_upload_before import looked_at
from tests.service.pages.test_pages_workbench import fill_in, read_it
from tests.service.pages.uploads import as_json, file, look_at
from tests.support.raw_curves import text_of_raw_curve
from tests.support.store_server import Server, campaign

PHONE = 390
RAW = "force is 0 over the first"


def shaker() -> bytes:
    """Two seconds of a shaker about a static preload of 3 N, in newtons and picocoulombs."""
    force = 3 + 0.2 * np.random.default_rng(3).normal(size=2048)
    timing = {"wf_increment": 1 / 1024, "wf_start_offset": 0.0}
    buffer = io.BytesIO()
    with TdmsWriter(buffer) as writer:
        channels = [
            ChannelObject("press 1", name, values, {**timing, "unit_string": unit})
            for name, values, unit in (("Force", force, "N"), ("Charge", 7 * (force - 3), "pC"))
        ]
        writer.write_segment([RootObject({}), GroupObject("press 1", {}), *channels])
    return buffer.getvalue()


def keep_curve(visitor: Visit, skin: str) -> None:
    """A curve of a force microscope, kept with its zero and trim."""
    look_at(visitor, [file("afm.txt", text_of_raw_curve(above=f"# {skin}"))], skin=skin)
    fill_in(visitor.page)
    visitor.page.locator("#instrument").fill("force microscope 7")
    read_it(visitor.page)
    visitor.page.get_by_role("button", name="Keep 1 recording").click()
    visitor.page.wait_for_url("**/campaigns/*")


@pytest.mark.soak
def test_shaker_s_file_not_read_settings_force(visitor: Visit) -> None:
    """A shaker s file is not read with the settings of a force microscope."""
    page = visitor.page
    keep_curve(visitor, "pdms-7")
    look_at(visitor, [file("shaker.tdms", shaker())], skin="pdms-7")
    expect(page.get_by_text("no part holds all")).to_have_count(0)
    expect(page.get_by_text("lacks the channels of what was read for skin pdms-7 before (afm.txt)")).to_be_visible()
    expect(page.get_by_label("Kind of recording")).to_have_value("frf")
    expect(page.get_by_label("What Force is", exact=True)).to_have_value("force_n")
    expect(page.get_by_label("What Charge is", exact=True)).to_have_value("charge_pc")
    expect(page.get_by_label(RAW)).to_have_value("")
    for label, value in (("thickness h", "2.5"), ("Young's modulus", "16"), ("sensor radius", "1.5")):
        page.get_by_label(label).fill(value)
    page.locator("#sensor").fill("s1")
    page.locator("#indenter_radius_mm").fill("4")
    page.locator("#preload_n").fill("3")
    read_it(page)
    expect(page.get_by_text("must be the name of a sensor in the layout: fill in the layout below")).to_be_visible()
    page.get_by_label("Layout").fill("s1, 0, 0")
    read_it(page)
    expect(page.get_by_role("status").first).to_contain_text("1 recording understood")
    expect(page.get_by_text("less 3")).to_have_count(0)


def test_second_file_instrument_says_read_start(visitor: Visit) -> None:
    """A second file of the instrument says what it is read by and can start without."""
    page = visitor.page
    keep_curve(visitor, "pdms-8")
    look_at(visitor, [file("next.txt", text_of_raw_curve(above="# next"))], skin="pdms-8")
    told = page.get_by_role("form", name="Read as before")
    expect(told).to_contain_text("afm.txt of force microscope 7 of skin pdms-8 was, kept")
    expect(told).to_contain_text("the force is 0 over the first 10 %")
    visitor.require_accessible()
    told.get_by_role("button", name="Start without it").click()
    page.wait_for_load_state()
    expect(page.get_by_role("form", name="Read as before")).to_have_count(0)
    expect(page.get_by_label(RAW)).to_have_value("")
    expect(page.get_by_label("Formula of derived channel 1", exact=True)).to_have_value("")


def one_refused() -> dict[str, Any]:
    document = campaign("partly", sensors=2, id="partly")
    document["recordings"][0]["preload_n"] = -2.0
    return document


def test_why_recordings_refused_stands(visitor: Visit) -> None:
    """Why recordings are refused stands above what is kept and on its page."""
    page = visitor.page
    page.set_viewport_size({"width": PHONE, "height": 844})
    good = file("good.json", as_json(campaign("whole", id="partly")))
    look_at(visitor, [good, file("bad.json", as_json(one_refused()))])
    section = page.get_by_role("region", name="What will not be kept")
    expect(section).to_contain_text("bad.json: s0-1N: preload_n -2: must be")
    keep = page.get_by_role("button", name="Keep")
    box, button = section.bounding_box(), keep.bounding_box()
    assert box is not None
    assert button is not None
    assert box["y"] < button["y"]
    row = page.get_by_role("region", name="Files").get_by_role("row", name="bad.json")
    assert "preload_n: must be" in row.inner_text()
    visitor.require_accessible()
    look_at(visitor, [file("bad.json", as_json(one_refused()))])
    wrong = page.get_by_role("region", name="What is wrong").first
    assert wrong.evaluate("box => box.scrollWidth <= box.clientWidth")
    cell = wrong.get_by_role("cell").last.bounding_box()
    assert cell is not None
    assert cell["x"] + cell["width"] <= PHONE
    page.get_by_role("button", name="Keep").click()
    page.wait_for_url("**/campaigns/*")
    expect(page.get_by_text("s0-1N: preload_n -2 must be")).to_be_visible()


@pytest.mark.parametrize(("first", "said"), [(60.0, "these will give no d33"), (None, "no d33 will come of this")])
def test_preload_beyond_table_gives_no_d33_said(server: Server, first: float | None, said: str) -> None:
    """That a preload beyond the table gives no d33 is said before."""
    document = campaign("heavy", sensors=2, id="heavy")
    for number, recording in enumerate(document["recordings"]):
        recording["preload_n"] = 60.0 if first is None or number == 0 else recording["preload_n"]
    page = looked_at(server, "heavy.json", as_json(document))
    assert said in page
    assert "L = F/(R²E) measures the strain under the sphere" in page
    assert page.index(said) < page.index("<button>Keep")
