"""Curves that a machine counts negative: told at upload, turned there, and no negative modulus anywhere."""

import pytest

from tests.service.pages.conftest import Visit
from tests.service.pages.uploads import as_json, file, look_at
from tests.support.blocks import block
from tests.support.cases import first

MODULUS = "The elastomer's modulus"


@pytest.mark.parametrize("width", first(1, [390, 1280]))
def test_force_and_travel_are_flipped_on_demand(visitor: Visit, width: int) -> None:
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 844})
    look_at(visitor, [file("block.json", as_json(block("flipped", force=-1, travel=-1)))], skin=f"block-{width}")
    assert "force and displacement are counted negative" in page.get_by_role("main").inner_text()
    assert "the sign -1" not in page.get_by_role("main").inner_text()
    visitor.require_accessible()
    flip = page.get_by_role("button", name="Flip what is counted negative")
    flip.focus()
    page.keyboard.press("Enter")
    page.get_by_text("Force and displacement are turned").wait_for()
    assert "counted negative as it is pressed, where" not in page.get_by_role("main").inner_text()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.get_by_role("button", name="Keep 1 recording").click()
    page.get_by_role("heading", name=MODULUS).wait_for()
    assert "2.000\xa0MPa" in page.get_by_role("main").inner_text()


@pytest.mark.soak
def test_a_force_left_negative_gives_no_modulus(visitor: Visit) -> None:
    page = visitor.page
    look_at(visitor, [file("block.json", as_json(block("left", force=-1)))], skin="left")
    page.get_by_role("button", name="Keep 1 recording").click()
    page.wait_for_url("**/campaigns/*")
    shown = page.get_by_role("main").inner_text()
    assert MODULUS not in shown
    assert "force is counted negative" in shown
    assert "the sign -1" not in shown
    page.get_by_text("Left out of the array's d33 and of the modulus: 1").click()
    page.get_by_text("no modulus follows from a fall").wait_for()
