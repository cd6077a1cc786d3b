"""Uploads in the browser: understood, corrected, joined, and kept or not at all."""

import pytest

from tests.service.pages.conftest import Visit
from tests.service.pages.forms import HOSTILE
from tests.service.pages.lab_files import SHAKER_RIG, shaker_tdms
from tests.service.pages.uploads import as_json, campaigns_of, file, look_at
from tests.support.repository import ROOT
from tests.support.store_server import Server, campaign
from underskin.recordings import rig_description

GAIN = 7.4
TEMPLATE = ROOT / "examples" / "formats" / "template.csv"


def test_a_bad_recording_is_explained_field_by_field(visitor: Visit, server: Server) -> None:
    document = campaign("one bad", id="one-bad")
    document["recordings"][1] |= {"preload_n": -2.0, "sensor": "nowhere"}
    look_at(visitor, [file("one bad.json", as_json(document))])
    page = visitor.page
    assert "5 recordings understood, 1 refused" in page.get_by_role("status").inner_text()
    row = page.get_by_role("row", name="preload_n")
    assert "-2.0" in row.inner_text()
    assert "greater than 0" in row.inner_text()
    assert campaigns_of(server, "one-bad") == []
    page.get_by_role("button", name="Keep 5 recordings").click()
    page.wait_for_url("**/campaigns/*")
    assert len(campaigns_of(server, "one-bad")) == 1


@pytest.mark.soak
def test_a_rig_description_reads_a_recording_and_its_form_keeps_what_it_says(visitor: Visit, server: Server) -> None:
    page = visitor.page
    look_at(visitor, [file("press.tdms", shaker_tdms(GAIN))], rig=SHAKER_RIG, skin="shaker")
    page.get_by_text("1 recording understood").wait_for()
    visitor.drawn(2)
    shown = page.get_by_role("row", name="press").last.inner_text()
    assert float(shown.split()[-1]) == pytest.approx(GAIN, rel=0.02)
    page.get_by_text("What the channels are").click()
    assert page.get_by_label("Sign of Amplifier").input_value() == "-1"
    page.get_by_label("Sensitivity of Amplifier", exact=True).fill("5")  # as if the range had been another
    page.get_by_role("button", name="Read it with these settings").click()
    page.get_by_text("1 recording understood").wait_for()
    shown = page.get_by_role("row", name="press").last.inner_text()
    assert float(shown.split()[-1]) == pytest.approx(2 * GAIN, rel=0.02)
    page.get_by_text("What the channels are").click()
    with page.expect_download() as saving:
        page.get_by_role("link", name="Save this as a rig description").click()
    saved = rig_description.parse(saving.value.path().read_bytes(), "rig.json")
    assert saved.channels["charge_pc"].sensitivity == 5
    page.get_by_role("button", name="Keep 1 recording").click()
    page.wait_for_url("**/campaigns/*")
    kept = server.http.get("/v1/skins/shaker").json()["rig"]
    assert kept["channels"]["charge_pc"]["sensitivity"] == 5
    assert kept["recording"]["dwell_s"] == 30  # which the form does not show
    look_at(visitor, [file("next.tdms", shaker_tdms(GAIN))], skin="shaker")  # read as the last one was
    page.get_by_text("1 recording understood").wait_for()


def test_the_table_that_is_offered_can_be_sent(visitor: Visit) -> None:
    page = visitor.page
    visitor.go("/upload")
    with page.expect_download() as saving:
        page.get_by_role("link", name="this table").click()
    offered = saving.value.path().read_bytes()
    assert offered == TEMPLATE.read_bytes()
    look_at(visitor, [file("template.csv", offered)])
    assert "understood" in page.get_by_role("status").inner_text()
    assert page.get_by_role("button", name="Keep").count() == 1


@pytest.mark.soak
def test_files_that_are_dropped_are_looked_at(visitor: Visit) -> None:
    page = visitor.page
    visitor.go("/upload")
    page.evaluate(
        """text => {
            const carried = new DataTransfer();
            carried.items.add(new File([text], "dropped.json"));
            const how = { dataTransfer: carried, bubbles: true, cancelable: true };
            document.body.dispatchEvent(new DragEvent("drop", how));
        }""",
        as_json(campaign("dropped")),
    )
    page.wait_for_url("**/upload/*")
    assert "6 recordings understood" in page.get_by_role("status").inner_text()


def test_a_campaign_is_corrected_by_a_newer_file(visitor: Visit, server: Server) -> None:
    page = visitor.page
    wrong = server.http.post("/v1/campaigns", json=campaign("slip", id="corrected")).json()["id"]
    visitor.go(f"/campaigns/{wrong}")
    page.get_by_text("or correct or withdraw").click()
    page.get_by_role("link", name="Upload a corrected version").click()
    assert "takes the place of campaign slip, which stays readable" in page.get_by_role("status").first.inner_text()
    page.get_by_label("Files").set_input_files([file("right.json", as_json(campaign("right", id="corrected")))])
    page.get_by_role("button", name="Look at them").click()
    page.wait_for_url("**/upload/*")
    assert "It takes the place of campaign slip," in page.locator("form.keep").inner_text()
    assert str(page.get_by_role("link", name="slip").get_attribute("href")).endswith(wrong)
    assert ": s0, R 4 mm, 1 N" in page.locator("#figure-frf script").inner_text()
    visitor.require_accessible()
    page.get_by_label("Reason").fill("the modulus of another batch")
    page.get_by_label("Your name").fill("Anna")
    page.get_by_role("button", name="Keep 6 recordings").click()
    page.wait_for_url("**/campaigns/*")
    right = page.url.rpartition("/")[2]
    found = server.http.get(f"/v1/campaigns/{wrong}").json()
    assert (found["corrected_by"], found["state"]) == (right, "corrected")
    earlier = page.get_by_text("It takes the place of an earlier version, which stays readable: the modulus of")
    assert str(earlier.get_by_role("link").get_attribute("href")).endswith(wrong)
    page.get_by_text("What was changed here: 1").click()
    assert "by Anna" in page.get_by_role("listitem").filter(has_text="“the modulus of another batch”").inner_text()
    assert "from Anna" not in page.locator("dl.facts").inner_text()  # which names keys
    visitor.go(f"/upload?skin=corrected&corrects={wrong}")  # once more, though it is corrected already
    page.get_by_label("Files").set_input_files([file("again.json", as_json(campaign("again", id="corrected")))])
    page.get_by_role("button", name="Look at them").click()
    page.wait_for_url("**/upload/*")
    page.get_by_label("Reason").fill("another slip")
    page.get_by_label("Your name").fill("Bea")
    page.get_by_role("button", name="Keep 6 recordings").click()
    assert "corrected" in page.get_by_role("alert").inner_text()
    assert page.get_by_label("Reason").input_value() == "another slip"
    assert page.get_by_label("Your name").input_value() == "Bea"
    assert campaigns_of(server, "corrected") == [right]


def test_hostile_names_in_files_stay_text(visitor: Visit) -> None:
    page = visitor.page
    page.on("dialog", lambda dialog: visitor.wrong.append(dialog.message))
    name = HOSTILE.replace("/", "|")
    look_at(visitor, [file(f"{name}.tdms", shaker_tdms(GAIN, load_cell=name))], skin=HOSTILE)
    visitor.drawn(1)
    assert page.locator("img[src=x]").count() == 0
    assert "<script>" in page.get_by_role("heading", level=1).inner_text()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth + 1")


LONG = "Sensor;Sphere diameter [mm];Preload [N];Dynamic force [N];Frequency [Hz];|H| [pC/N];Phase [deg]\n" + "\n".join(
    f"{sensor};8,0;{preload};0,05;{hz},0;7,{hz};-1,0"
    for sensor in ("s01", "s02")
    for preload in ("0,5", "1,0")
    for hz in (10, 20, 40)
)


def test_a_table_with_a_row_a_line_is_mapped_by_its_headings(visitor: Visit) -> None:
    """Sensor, sphere, preload and force are taken from their columns; the skin is typed, and one click reads it."""
    look_at(visitor, [file("glove.csv", LONG)])
    page = visitor.page
    assert page.get_by_label("sensor that was pressed: where it is").input_value() == "column:Sensor"
    assert page.get_by_label("preload F: where it is").input_value() == "column:Preload [N]"
    for label, value in (("thickness h", "2.5"), ("Young's modulus E", "16"), ("sensor radius rT", "1.5")):
        page.get_by_label(label).first.fill(value)
    page.get_by_label("Layout").fill("s01, 0, 0\ns02, 8, 0")
    page.get_by_role("button", name="Read it with these settings").click()
    page.get_by_role("button", name="Keep").first.wait_for()
    assert "4 recordings" in page.locator("main").inner_text()
    page.get_by_text("What the channels are").click()
    assert page.get_by_label("preload F: where it is").input_value() == "column:Preload [N]"
    visitor.require_accessible()
