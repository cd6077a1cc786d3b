"""What an upload tells of a campaign before it is kept, and what stays told of a raw file afterwards."""

from playwright.sync_api import expect

from tests.service.pages.conftest import Visit
from tests.service.pages.uploads import as_json, file, look_at
from tests.support.store_server import campaign


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
