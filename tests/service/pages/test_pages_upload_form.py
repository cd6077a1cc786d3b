"""The upload's pages where there is much, little room, or two of a kind."""

import re

import numpy as np
from playwright.sync_api import expect

from tests.service.pages.conftest import Visit
from tests.service.pages.uploads import as_json, file, look_at
from tests.support.store_server import campaign

WRONG = {
    "thickness_mm": "2,5,1",
    "youngs_modulus_mpa": "abc",
    "poisson_ratio": "0.7",
    "indenter_radius_mm": "-0.05",
    "preload_n": "2 N",
    "dynamic_force_n": "-0.2",
    "sample_rate_hz": "fast",
    "recorded_at": "yesterday",
}
TWO_FORCES = "time [s];Force left [N];Force right [N];Charge [pC]\n" + "\n".join(
    f"{at / 1000:g};{1 + 0.1 * np.sin(at):.5f};{1 + 0.2 * np.sin(at):.5f};{0.7 * np.sin(at):.5f}" for at in range(400)
)


def test_alike_refusals_are_told_once(visitor: Visit) -> None:
    bad = []
    for number in range(40):
        document = campaign(f"press {number}", sensors=1, id="many")
        document["recordings"] = document["recordings"][:1]
        document["recordings"][0] |= {"id": f"press {number}", "preload_n": -1.0 - number}
        bad.append(file(f"press {number}.json", as_json(document)))
    good = file("good.json", as_json(campaign("good", id="many")))
    torn = file("torn.json", "{")
    look_at(visitor, [good, *bad, torn])
    page = visitor.page
    table = page.get_by_role("region", name="Files")
    assert table.locator("tbody tr").count() == 3
    group = table.get_by_role("row", name="40 files alike")
    assert "preload_n: must be" in group.inner_text()
    assert not group.get_by_role("link", name="press 39.json").is_visible()
    group.get_by_text("Which").click()
    group.get_by_role("link", name="press 39.json").click()
    page.get_by_role("heading", name="press 39.json").wait_for()
    assert page.get_by_role("link", name="press 39.json").get_attribute("aria-current") == "true"
    visitor.require_accessible()


def test_two_channels_for_one_field_are_pointed_out_and_refused(visitor: Visit) -> None:
    page = visitor.page
    look_at(visitor, [file("two forces.csv", TWO_FORCES)])
    assert "Force right [N] may be force as well as Force left [N]" in page.get_by_role("main").inner_text()
    page.get_by_label("What Force right [N] is").select_option("force_n")
    for field, typed in WRONG.items():
        page.locator(f"#{field}").fill(typed)
    page.get_by_role("button", name="Read it with these settings").click()
    alert = page.get_by_role("alert").inner_text()
    for field, typed in WRONG.items():  # all of them in the first round, each in its row
        wrong = page.locator(f"#{field}")
        expect(wrong).to_have_attribute("aria-invalid", "true")
        expect(wrong).to_have_accessible_description(re.compile(re.escape(typed.removesuffix("0"))))
        assert wrong.input_value() == typed
    assert page.locator("[aria-invalid]").count() == len(WRONG)
    assert "sensor radius" not in alert  # which a skin may lack
    visitor.require_accessible()
    assert "Force right" in alert
    assert "Force left [N] is force already: set one of the two to “not used”" in alert
    assert page.get_by_label("What Force right [N] is").input_value() == "force_n"
    page.get_by_label("What Force left [N] is").select_option("")
    for field in ("sample_rate_hz", "recorded_at"):
        page.locator(f"#{field}").fill("")
    page.locator("#poisson_ratio").fill("0.5")
    for label, value in (("thickness h", "2.5"), ("Young's modulus", "16"), ("sensor radius", "1.5")):
        page.get_by_label(label).fill(value)
    page.get_by_label("Layout").fill("s1, 0, 0")
    page.locator("#sensor").fill("s1")
    page.locator("#indenter_radius_mm").fill("4")
    page.locator("#preload_n").fill("1")
    page.locator("#dynamic_force_n").fill("0.2")
    page.get_by_role("button", name="Read it with these settings").click()
    page.get_by_text("1 recording understood").wait_for()
    page.get_by_text("What the channels are").click()
    assert page.get_by_label("What Force left [N] is").input_value() == ""
    assert page.get_by_label("What Force right [N] is").input_value() == "force_n"
