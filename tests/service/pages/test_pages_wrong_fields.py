"""Several wrong fields of a form are told at once, in the form's words, each marked and tied to its sentence."""

import re
from html import unescape

import pytest
from playwright.sync_api import expect

from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING
from tests.support.cases import first
from tests.support.store_server import Server

LOADS = "0 0 4\n\n10 8 -4 1\n1 x 4 5"
OVERLAP = "the diameter of a sensor: they cannot overlap"
CASES = {
    "loads": (
        "/loads",
        {
            "thickness_mm": "zwei",
            "youngs_modulus_mpa": "-3",
            "poisson_ratio": "0.7",
            "columns": "2.5",
            "pitch_mm": "",
            "glue_stiffness": "-1",
            "loads": LOADS,
        },
        [
            ("thickness_mm", "thickness h [mm]: zwei – must be a number"),
            ("youngs_modulus_mpa", "Young's modulus E [MPa]: -3.0 – must be finite and greater than 0 (MPa)"),
            ("poisson_ratio", "Poisson's ratio ν: 0.7 – must be 0 to 0.5"),
            ("glue_stiffness", "glue line, κ: -1.0 – must be 0 or greater"),
            ("columns", "sensors along x: 2.5 – must be a whole number"),
            ("pitch_mm", "pitch [mm] – fill it in"),
            ("loads", "load in line 1: 0 0 4 – must be x y R F, or x y R F Fx Fy (mm, N)"),
            ("loads", "load in line 3, R: -4.0 – must be finite and greater than 0 (mm)"),
            ("loads", "load in line 4, y: x – must be a number"),
        ],
    ),
    "field": (
        "/field",
        {"thickness_mm": "zwei", "poisson_ratio": "0.7", "preload_n": ""},
        [
            ("thickness_mm", "thickness h [mm]: zwei – must be a number"),
            ("poisson_ratio", "Poisson's ratio ν: 0.7 – must be 0 to 0.5"),
            ("preload_n", "force F [N] – fill it in"),
        ],
    ),
    "d33": (
        "/d33",
        {"sensor_radius_mm": "0", "rows": "4 1 7 0.1\n\n4 x 7 0.1\n4 -1 inf -3\n4 1"},
        [
            ("sensor_radius_mm", "sensor radius rT [mm]: 0.0 – must be finite and greater than 0 (mm)"),
            ("rows", "row 3, preload F: x – must be a number"),
            ("rows", "row 4, preload F: -1.0 – must be finite and greater than 0 (N)"),
            ("rows", "row 4, FRF: inf – must be finite"),
            ("rows", "row 4, uncertainty of the FRF: -3.0 – must be 0 or greater"),
            ("rows", "row 5: 4 1 – must be R F FRF, or R F FRF and its uncertainty (mm, N, pC/N)"),
        ],
    ),
    "design": (
        "/design",
        {"thickness_mm": "zwei", "preload_n": "-1", "pitch_mm": "1", "dip_percent": "500"},
        [
            ("thickness_mm", "thickness h [mm]: zwei – must be a number"),
            ("preload_n", "force F [N]: -1.0 – must be finite and greater than 0 (N)"),
            ("pitch_mm", f"pitch of the array [mm]: 1.0 – must be at least 3 mm, {OVERLAP}"),
            ("dip_percent", "resolvable dip [%]: 500.0 – must be at most 100"),
        ],
    ),
    "search": (
        "/design/search",
        {"resolution_mm": "60", "preload_n": "-1", "thinnest_mm": "thick"},
        [
            ("resolution_mm", "two-point separation, at most [mm]: 60.0 – must be at most 50"),
            ("preload_n", "force F of each load [N]: -1.0 – must be finite and greater than 0 (N)"),
            ("thinnest_mm", "thinnest layer that can be made [mm]: thick – must be a number"),
        ],
    ),
}


@pytest.mark.parametrize(("path", "sent", "told"), CASES.values(), ids=CASES)
def test_all_that_is_wrong_is_told_at_once(
    server: Server, path: str, sent: dict[str, str], told: list[tuple[str, str]]
) -> None:
    page = server.http.get(path, params=sent, headers=BROWSING).text
    sentences = re.findall(r'<p id="wrong-\d+">(.*?)</p>', page)
    assert list(map(unescape, sentences)) == [sentence for _, sentence in told]
    marked = dict(re.findall(r'name="(\w+)"[^>]* aria-invalid="true" aria-describedby="([^"]+)"', page))
    expected: dict[str, list[str]] = {}
    for number, (field, _) in enumerate(told, 1):
        expected.setdefault(field, []).append(f"wrong-{number}")
    assert {field: ids.split() for field, ids in marked.items()} == expected


def test_a_wrong_field_is_described_by_its_sentence(visitor: Visit) -> None:
    page = visitor.page
    visitor.go("/design?thickness_mm=zwei&preload_n=-1")
    for width in first(1, (390, 1280)):
        page.set_viewport_size({"width": width, "height": 844})
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        visitor.require_accessible()
    visitor.go("/design")
    page.locator("#preload_n").fill("-1")
    with page.expect_response("**/design/answer?*"):
        page.locator("#thickness_mm").fill("zwei")
    thickness, force = page.get_by_label("thickness h [mm]"), page.get_by_label("force F [N]")
    expect(thickness).to_have_accessible_description("thickness h [mm]: zwei – must be a number")
    expect(force).to_have_accessible_description("force F [N]: -1.0 – must be finite and greater than 0 (N)")
    thickness.fill("2")
    expect(thickness).not_to_have_attribute("aria-invalid", "true")
    expect(force).to_have_attribute("aria-invalid", "true")
    force.fill("1")
    expect(force).not_to_have_attribute("aria-describedby", re.compile("."))
    expect(page.get_by_role("alert")).to_be_hidden()
