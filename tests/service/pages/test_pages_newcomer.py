"""The whole way of somebody who is here for the first time, with a real browser."""

import pytest

from tests.service.pages.conftest import Visit
from tests.service.pages.lab_files import frf_tdms
from tests.support.diagnosed import resonant
from tests.support.store_server import Server

SKIN = "my-first"


@pytest.mark.soak
def test_from_the_start_to_a_history_by_the_adopted_model(patient: Visit, diagnosing: Server) -> None:
    page = patient.page
    patient.go("/")
    page.get_by_role("button", name="Load the example skin").click()
    page.wait_for_url("**/skins/example")

    page.get_by_role("link", name="Upload").first.click()
    patient.require_accessible()
    page.get_by_label("Files").set_input_files(
        {"name": "broken.tdms", "mimeType": "", "buffer": frf_tdms(resonant("x"))[:400]}
    )
    page.get_by_role("button", name="Look at them").click()
    page.get_by_text("No recording understood yet").wait_for()
    assert "cannot be read" in page.get_by_role("main").inner_text()
    patient.require_accessible()
    page.get_by_role("button", name="Discard").click()

    document = resonant("array", lines=30)
    page.get_by_label("Files").set_input_files({"name": "monday.tdms", "mimeType": "", "buffer": frf_tdms(document)})
    page.get_by_label("Skin").fill(SKIN)
    page.get_by_role("button", name="Look at them").click()
    page.get_by_text("does not say what they are").wait_for()
    patient.drawn(1)  # as it came
    patient.require_accessible()
    assert page.get_by_label("What Frequency is").input_value() == "frequency_hz"  # by its unit
    page.get_by_label("What FRF imaginary is").select_option("frf_im_pc_per_n")
    page.get_by_label("thickness h").fill("2,5")
    page.get_by_label("Young's modulus").fill("2")
    page.get_by_label("sensor radius").fill("1.5")
    page.get_by_label("Layout").fill("s1, 0, 0\ns2; 8; 0")
    page.get_by_label("dynamic force", exact=False).first.fill("0.05")
    page.get_by_role("button", name="Read it with these settings").click()
    page.get_by_text("12 recordings understood").wait_for()
    patient.drawn(2)  # and its FRFs
    patient.require_accessible()
    assert diagnosing.http.get(f"/v1/skins/{SKIN}").status_code == 404  # nothing is kept yet
    page.get_by_role("button", name="Keep 12 recordings").click()

    page.wait_for_url("**/campaigns/*")
    patient.drawn(4)
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_role("button", name="Adopt contact resonance of the rig").wait_for()
    patient.drawn(4)
    patient.require_accessible()
    page.get_by_role("button", name="Adopt contact resonance of the rig").click()

    page.wait_for_url(f"**/skins/{SKIN}?model=adopted")
    patient.drawn(2)
    patient.require_accessible()
    with page.expect_download() as saving:
        page.locator("#figure-history").get_by_role("link", name="CSV").click()
    rows = saving.value.path().read_text().splitlines()
    assert rows[0].endswith("model,model_id")
    assert all(",adopted,m-" in row for row in rows[1:])
    assert len(rows) == 1 + 2
