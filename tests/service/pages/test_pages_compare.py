"""Two campaigns side by side: the same colours, the difference and what of it is beyond chance."""

import csv
import re
import time
from collections.abc import Sequence
from dataclasses import replace

import pytest
from playwright.sync_api import Page

from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING
from tests.support.blocks import block
from tests.support.cases import first
from tests.support.diagnosed import sent, table
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.store_server import Server
from underskin.recordings.campaign import Campaign, FrfRecording, to_dict

BEFORE = Made(sensors=4, spheres_mm=(4.0,), preloads_n=(1.0, 2.0), lines=8, gain=0.005, repeats=3)


def weakened(made: Campaign, sensor: str, factor: float) -> Campaign:
    """The campaign with one sensor's charge times a factor, and all others' a thousandth larger, which is noise."""
    entries = []
    for entry in made.recordings:
        assert isinstance(entry, FrfRecording)
        assert entry.frf_re_pc_per_n is not None
        assert entry.frf_im_pc_per_n is not None
        by = factor if entry.sensor == sensor else 1.001
        entries.append(
            replace(entry, frf_re_pc_per_n=by * entry.frf_re_pc_per_n, frf_im_pc_per_n=by * entry.frf_im_pc_per_n)
        )
    return replace(made, name="after", recordings=tuple(entries))


def compared(visitor: Visit, skin: str, width: int, figures: int) -> Page:
    """The page that a skin's page leads to, once so many figures are drawn."""
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 800})
    visitor.go(f"/skins/{skin}")
    page.get_by_role("link", name="Compare").click()
    page.wait_for_url("**/compare?skin=*")
    visitor.drawn(figures)
    visitor.require_accessible()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    return page


def test_skin_before_after_sensor_changed(server: Server) -> None:
    """A skin before and after, one sensor of which lost 30 %: that one differs beyond chance, the others do not."""
    before = sent(server, to_dict(campaign(BEFORE, table())), "aged")
    after = sent(server, to_dict(weakened(campaign(BEFORE, table()), "s2", 0.7)), "aged")
    both = {"first": before, "second": after}
    assert "1 of 4 differ from 0 beyond chance" in server.http.get("/compare", params=both, headers=BROWSING).text
    for order, sign in ((both, -1), ({"first": after, "second": before}, 1)):
        rows = csv.DictReader(server.http.get("/compare/difference.csv", params=order).text.splitlines())
        gaps = {row["sensor"]: float(row["difference_pc_per_n"]) for row in rows}
        assert gaps["s2"] == pytest.approx(sign * 0.3 * BEFORE.d33_pc_per_n, abs=0.5)
        assert max(abs(gap) for sensor, gap in gaps.items() if sensor != "s2") < 0.05


def test_campaigns_without_a_condition_in_common(server: Server) -> None:
    """FRFs under other preloads are not laid over each other; d33 is compared all the same."""
    ids = [
        sent(server, to_dict(replace(campaign(replace(BEFORE, preloads_n=preloads), table()), name=name)), "loads")
        for name, preloads in (("light", (1.0, 2.0)), ("heavy", (1.5, 2.5)))
    ]
    shown = server.http.get("/compare", params={"first": ids[0], "second": ids[1]}, headers=BROWSING)
    assert shown.status_code == 200
    assert "figure-map-difference" in shown.text
    assert "figure-frf" not in shown.text


def test_a_sensor_that_was_dead_differs_in_charge(server: Server) -> None:
    """Of a first d33 of 0 there is no percent: the difference is told in pC/N."""
    made = campaign(BEFORE, table())
    first, second = (
        sent(server, to_dict(replace(one, name=name)), "repaired")
        for one, name in ((weakened(made, "s2", 0.0), "dead"), (made, "alive"))
    )
    text = server.http.get("/compare", params={"first": first, "second": second}, headers=BROWSING).text
    assert re.search(r"1 of 4 sensors differs beyond chance: s2 \+1\d(\.\d)? pC/N", text)
    assert "nan" not in re.findall(r'class="result lead".*?</p>', text, re.DOTALL)[0]


def test_without_choice_last_two_skin_compared(server: Server) -> None:
    """Without a choice the last two of one skin are compared and sensors elsewhere are named."""

    def of_year(year: int, skin: str, shift_mm: float = 0.0) -> str:
        made = campaign(replace(BEFORE, sensors=2), table())
        dated = tuple(replace(one, recorded_at=f"{year}-05-03T09:00:00Z") for one in made.recordings)
        document = to_dict(replace(made, name=str(year), recordings=dated))
        document["skin"]["sensors"][1]["y_mm"] += shift_mm
        for one in document["recordings"]:
            one.pop("position_mm", None)
        return sent(server, document, skin)

    alone = of_year(2042, "by itself")
    ids = [of_year(year, "thrice") for year in (2039, 2040, 2041)]
    text = server.http.get("/compare", headers=BROWSING).text
    assert re.findall(r'value="([^"]*)" selected', text) == ids[1:]
    assert re.search(r"data-day=\"2041-05-03\">2041-05-03, thrice: 2041<", text)
    assert "lie elsewhere" not in text
    of_one = server.http.get(f"/compare?first={ids[0]}", headers=BROWSING).text
    assert re.findall(r'value="([^"]*)" selected', of_one) == [ids[0], ids[2]]
    bent = of_year(2043, "bent", 6.0)
    warned = server.http.get("/compare", params={"first": alone, "second": bent}, headers=BROWSING).text
    (said,) = re.findall(r"Sensors of the same id lie elsewhere in the two campaigns: (.*?)\. Their", warned)
    assert re.sub(r"<[^>]+>|&nbsp;", "", said) == "s1 by 6.00mm"


def one_sensor(number: int) -> dict[str, object]:
    made = campaign(replace(BEFORE, sensors=2), table())
    undated = tuple(replace(entry, recorded_at=None) for entry in made.recordings)
    return to_dict(replace(made, name=f"single {number}", recordings=undated))


def test_only_what_has_frfs_is_offered_and_none_with_itself(server: Server) -> None:
    first = sent(server, one_sensor(1), "mixed")
    sent(server, block("a block", recorded_at="2031-01-01T00:00:00Z"), "mixed")
    text = server.http.get("/compare?skin=mixed", headers=BROWSING).text
    assert text.count("<option ") == 2
    assert "a block" not in text
    sent(server, one_sensor(5), "another")
    both = re.findall(r'value="([^"]*)" selected', server.http.get(f"/compare?first={first}", headers=BROWSING).text)
    assert both[0] == first != both[1]
    assert f"{first}" in text
    assert "There is one campaign with FRFs of this skin: nothing to compare it with." in text
    assert 'id="figure-map-first"' not in text
    assert f">{time.strftime('%Y-%m-%d', time.gmtime())} (received), mixed: single 1<" in text


def pressed(name: str, moduli_mpa: Sequence[float], year: int) -> dict[str, object]:
    """A campaign of blocks, each of another modulus."""
    documents = [block(name, modulus_mpa=modulus) for modulus in moduli_mpa]
    dated = {"recorded_at": f"{year}-01-01T00:00:00Z"}
    recordings = [{**one["recordings"][0], **dated, "id": f"b{number}"} for number, one in enumerate(documents)]
    return {**documents[0], "recordings": recordings}


@pytest.mark.parametrize("width", first(1, [390, 1180]))
def test_curves_of_two_campaigns_and_the_difference_of_their_moduli(visitor: Visit, server: Server, width: int) -> None:
    skin = f"pressed{width}"
    ids = [sent(server, pressed("before", (2.0, 2.02, 1.98), 2030), skin)]
    ids.append(sent(server, pressed("after", (1.5, 1.52, 1.48), 2031), skin))
    page = compared(visitor, skin, width, 2)
    assert page.get_by_label("First", exact=True).input_value() == ids[0]
    told = page.get_by_role("region", name="Young's modulus of the curves").inner_text()
    assert re.search(r"First\s+3\s+2\.000", told)
    interval = re.search(r"Difference\s+–\s+-0\.5000\s+(-\S+) to (-\S+)", told.replace("−", "-"))
    assert interval is not None
    # Welch's: t(0.975; 4) = 2.776, of two standard errors of 0.02/√3
    half = 2.776 * 0.02 * (2 / 3) ** 0.5
    assert [float(one) for one in interval.groups()] == pytest.approx([-0.5 - half, -0.5 + half], abs=2e-4)
    assert page.get_by_text("the two differ beyond the scatter of their curves").is_visible()
    legend = page.locator("#figure-curves .plot").evaluate(
        "plot => plot.data.filter((one) => one.showlegend !== false).map((one) => one.name)"
    )
    assert legend == ["first", "second"]
    query = {"first": ids[0], "second": ids[1], "kind": "compression"}
    rows = list(csv.DictReader(server.http.get("/compare/moduli.csv", params=query).text.splitlines()))
    assert [row["which"] for row in rows] == ["first"] * 3 + ["second"] * 3
    assert float(rows[3]["youngs_modulus_mpa"]) == pytest.approx(1.5, rel=1e-6)


def test_single_curves_have_a_difference_without_an_interval(server: Server) -> None:
    for name, modulus, year in (("soft", 2.0, 2030), ("hard", 3.0, 2031)):
        sent(server, pressed(name, [modulus], year), "single")
    text = server.http.get("/compare?skin=single", headers=BROWSING).text
    assert "One curve does not show how far curves scatter" in text
    row = re.search(r"<tr><th scope=.row.>Difference</th>.*?</tr>", text, re.DOTALL)
    assert row is not None
    cells = [re.sub(r"<[^>]+>", "", cell) for cell in re.findall(r"<td.*?</td>", row[0])]
    assert float(cells[1]) == pytest.approx(1.0, rel=1e-3)
    assert (cells[0], cells[2]) == ("–", "–")


def test_kinds_of_which_there_are_campaigns_are_offered(server: Server) -> None:
    sent(server, one_sensor(6), "kinds")
    first = sent(server, block("alone", recorded_at="2031-01-01T00:00:00Z"), "kinds")
    text = server.http.get("/compare?skin=kinds", headers=BROWSING).text
    assert "<strong>FRFs</strong>" in text
    assert "/compare?kind=compression&amp;skin=kinds" in text
    text = server.http.get("/compare?skin=kinds&kind=compression", headers=BROWSING).text
    assert "There is one campaign with compressions of this skin" in text
    chosen = server.http.get(f"/compare?skin=kinds&first={first}", headers=BROWSING).text
    assert "<strong>compressions</strong>" in chosen
    assert server.http.get("/compare?kind=tension", headers=BROWSING).status_code == 422
