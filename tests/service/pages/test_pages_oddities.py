"""Campaigns that have little, or nonsense, have their pages and numbers all the same."""

import csv
import re
from collections.abc import Callable
from typing import Any

import httpx
import numpy as np
import pytest

from tests.service.conftest import emptied
from tests.service.pages.forms import said as page_text
from tests.service.pages.forms import token_of
from tests.support.repository import ROOT
from tests.support.store_server import Server, campaign

Document = dict[str, Any]
FILES = ROOT / "examples" / "campaigns"
BROWSING = {"Accept": "text/html"}


def changed(change: Callable[[int, Document], None], **given: Any) -> Document:
    document = campaign("odd", **given)
    for number, recording in enumerate(document["recordings"]):
        change(number, recording)
    return document


def no_charge(_: int, recording: Document) -> None:
    recording["frf_re_pc_per_n"] = recording["frf_im_pc_per_n"] = [0.0] * 20


def endless(_: int, recording: Document) -> None:
    recording["frf_re_pc_per_n"] = [9e8] * 20


def own_lines(number: int, recording: Document) -> None:
    recording["frequency_hz"] = [(1 + number) * line for line in recording["frequency_hz"]]


def bare(_: int, recording: Document) -> None:
    del recording["coherence"], recording["recorded_at"]


def time_series(_: int, recording: Document) -> None:
    for name in ("frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n", "coherence"):
        del recording[name]
    force = np.random.default_rng(0).normal(size=4096) / 10
    recording |= {"sample_rate_hz": 1024.0, "force_n": force.tolist(), "charge_pc": (7 * force).tolist()}


def untouched(_: int, recording: Document) -> None:
    assert recording


ODD = {
    "one line": changed(untouched, sensors=1, lines=1),
    "no charge": changed(no_charge),
    "endless": changed(endless),
    "own lines": changed(own_lines),
    "bare": changed(bare),
    "time series": changed(time_series, sensors=1),
    "many sensors": changed(untouched, sensors=60, lines=5),
    "outside the table": changed(untouched, youngs_modulus_mpa=0.01),
}


def require_pages(server: Server, kept: Document) -> None:
    campaign_page, skin_page = f"/campaigns/{kept['id']}", f"/skins/{kept['skin_id']}"
    pages = [campaign_page, f"{campaign_page}?show=s0", skin_page, f"{skin_page}?show=trend", f"{skin_page}?sensor=s0"]
    for path in [*pages, f"/design?skin={kept['skin_id']}"]:
        assert server.http.get(path, headers=BROWSING).status_code == 200, path
    files = [f"{campaign_page}/{name}.csv" for name in ("frf", "preload", "d33", "curves")]
    for path in [*files, f"{skin_page}/map.csv", f"{skin_page}/history.csv"]:
        answer = server.http.get(path)
        assert answer.headers["content-type"].startswith("text/csv"), path
        assert len({len(row) for row in csv.reader(answer.text.splitlines())}) <= 1, path


@pytest.mark.parametrize("name", ODD)
def test_odd_campaigns(server: Server, name: str) -> None:
    require_pages(server, server.http.post("/v1/campaigns", json=ODD[name]).json())


def test_the_elastomer_alone(server: Server) -> None:
    parts = [("file", FILES / "block.csv"), ("rig", FILES / "testing-machine.yaml")]
    files = [(name, (file.name, file.read_bytes())) for name, file in parts]
    answer = server.http.post("/v1/campaigns?skin=block", files=files)
    (kept,) = answer.json()["campaigns"]
    require_pages(server, kept)
    page = server.http.get(f"/campaigns/{kept['id']}", headers=BROWSING).text
    assert "Force against displacement" in page
    assert "The elastomer" in page


def test_texts_in_csv_are_no_formulas(server: Server) -> None:
    document = campaign("formula", sensors=1)
    document["skin"]["sensors"][0]["id"] = "=1+1"
    for recording in document["recordings"]:
        recording["sensor"] = "=1+1"
    kept = server.http.post("/v1/campaigns", json=document).json()
    rows = csv.DictReader(server.http.get(f"/campaigns/{kept['id']}/d33.csv").text.splitlines())
    assert {row["sensor"] for row in rows} == {"'=1+1"}


@pytest.mark.parametrize(
    ("declared", "said", "value"),
    [
        (9.5, None, "9.5"),
        (None, "d33 {found} pC/N is that of the array in the newest, by the paper&#39;s model", "{found}"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("page", ["design", "loads"])
def test_a_view_says_which_d33_it_starts_from(
    server: Server, declared: float | None, said: str | None, value: str, page: str
) -> None:
    skin = f"{page} {declared}"
    kept = server.http.post("/v1/campaigns", json=campaign("the newest", id=skin, d33_pc_per_n=declared)).json()
    told = server.http.get(f"/v1/campaigns/{kept['id']}/d33").json()
    found = f"{told['array']['d33_pc_per_n']:.4g}"
    text = server.http.get(f"/{page}?skin={skin}", headers=BROWSING).text
    assert re.search(rf'id="d33_pc_per_n" name="d33_pc_per_n" value="{value.format(found=found)}"', text)
    assert ("the skin declares none" in text) == (said is not None)
    assert said is None or said.format(found=found) in text
    again = server.http.get(f"/{page}?skin={skin}&d33_pc_per_n=12", headers=BROWSING).text
    assert "the skin declares none" not in again


def test_sensors_in_one_place_have_their_views(server: Server) -> None:
    document = campaign("stacked", id="stacked", sensors=2)
    for sensor in document["skin"]["sensors"]:
        sensor["x_mm"] = sensor["y_mm"] = 0.0
    assert server.http.post("/v1/campaigns", json=document).status_code == 201
    for path in ("/design", "/loads", "/loads/map", "/d33"):
        answer = server.http.get(f"{path}?skin=stacked", headers=BROWSING)
        assert (path, answer.status_code) == (path, 200)
    text = server.http.get("/design?skin=stacked", headers=BROWSING).text
    assert "pitch of the array 8 mm" in text


def test_a_sensor_out_of_reach_says_so(server: Server) -> None:
    text = server.http.get("/loads?pitch_mm=100&loads=0 0 4 1", headers=BROWSING).text
    assert "out of reach: no load within" in text.partition(">s02<")[2].partition("</tr>")[0]
    assert "out of reach" not in text.partition(">s01<")[2].partition("</tr>")[0]
    assert "± of the linear model [pC]" in text
    assert "Not filled: no load is within reach." in text
    assert '<a href="/d33">d33</a>' in text  # at the top of every page


def _base(server: Server, loads: str) -> str:
    return server.http.get(f"/loads/base.csv?loads={loads}").raise_for_status().text


def test_a_load_that_no_sensor_feels_and_one_that_strains_the_layer_much_are_told(server: Server) -> None:
    text = server.http.get("/loads?loads=0 0 4 1%0A%0A500 500 4 1", headers=BROWSING).text
    (told,) = re.findall(r"<b>Check load in line 3:</b> (.*?)</p>", text)
    assert re.fullmatch(r"it lies 673.2 mm from the nearest sensor and adds nothing: sensors feel .*", told)
    assert "does not include finite strain" not in text
    wide = [float(row["x_mm"]) for row in csv.DictReader(_base(server, "0 0 4 1%0A500 500 4 1").splitlines())]
    assert max(wide) < 40  # so that the grid is fine where sensors are
    assert 'id="figure-base"' not in server.http.get("/loads?loads=500 500 4 1", headers=BROWSING).text
    text = server.http.get("/loads?loads=0 0 4 60", headers=BROWSING).text  # L = 60 N/(16 mm² × 16 MPa)
    assert "here L reaches 0.23, beyond where it is known what it adds" in text
    assert "adds nothing" not in text


@pytest.mark.parametrize(
    ("query", "said"),
    [
        ("columns=0", "sensors along x"),
        ("loads=10,5 8 4 1.2", "with decimal points or with decimal commas, not both"),
        ("loads=0 0 4 1e9", "load in line 1, F"),
        ("loads=0 0 4 1%0A%0A9 0 -4 1", "load in line 3, R: -4"),
        ("loads=0 0 4 1 0 nan", "load in line 1, Fy"),
        ("loads=%0A0 0 4 1%0A0 0 4 1", "must not overlap load in line 2"),
        ("loads=", "loads"),
        ("youngs_modulus_mpa=16000000", "Young&#39;s modulus E [MPa]"),
    ],
)
def test_loads_that_cannot_be_are_explained(server: Server, query: str, said: str) -> None:
    answer = server.http.get(f"/loads?{query}", headers=BROWSING)
    assert answer.status_code == 200
    alert = answer.text.partition('role="alert"')[2].partition("</div>")[0]
    assert said in alert
    assert not any(name in alert for name in ("contacts", "_mm", "_n", "units_checked")), alert
    assert server.http.get(f"/loads/charge.csv?{query}").status_code == 422


def test_loads_may_have_decimal_commas(server: Server) -> None:
    with_points, with_commas, listed = (
        server.http.get("/loads/charge.csv", params={"loads": loads})
        for loads in ("10.5 8 4 1.2", "10,5 8 4 1,2", "10.5, 8, 4, 1.2")
    )
    assert with_points.status_code == 200
    assert with_points.text == with_commas.text == listed.text


def test_a_band_without_lines_is_refused_by_name(server: Server) -> None:
    kept = server.http.post("/v1/campaigns", json=campaign("bands")).json()
    for query, said in (
        ("band_low_hz=900&band_high_hz=901", "band [Hz]"),
        ("band_low_hz=5", "to [Hz]"),
        ("band_low_hz=x&band_high_hz=y", "from [Hz]: x"),
    ):
        answer = server.http.get(f"/campaigns/{kept['id']}?{query}", headers=BROWSING)
        assert answer.status_code == 200
        assert re.search(rf'role="alert">{re.escape(said)}', answer.text)
        assert server.http.get(f"/campaigns/{kept['id']}/preload.csv?{query}").status_code == 422


def test_the_example_comes_back_once_all_of_it_was_withdrawn(server: Server) -> None:
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as anyone:
        form = {"form_token": token_of(anyone.get("/").text)}
        anyone.post("/example", data=form)
        loaded = _in_use(server)
        for number in loaded:
            server.http.post(f"/v1/campaigns/{number}/withdraw", json={"reason": "tried"}).raise_for_status()
        assert _in_use(server) == []
        for _ in range(2):  # once, however often it is asked for
            assert anyone.post("/example", data=form).headers["location"] == "/skins/example"
        assert len(_in_use(server)) == len(loaded)
        assert set(_in_use(server)).isdisjoint(loaded)
    emptied(server)


def _in_use(server: Server) -> list[str]:
    found = server.http.get("/v1/campaigns", params={"skin": "example", "state": "current"}).json()["campaigns"]
    return [entry["id"] for entry in found]


@pytest.mark.parametrize(
    "unusable", [{"s0-1N"}, {f"s{sensor}-{preload}N" for sensor in range(3) for preload in (1, 2)}]
)
def test_recordings_without_a_number_are_not_in_use(server: Server, unusable: set[str]) -> None:
    """Recordings whose contacts are beyond the table are said to give no d33, the others to be in use."""
    document = campaign("thorns")
    for recording in document["recordings"]:
        recording["indenter_radius_mm"] *= 0.02 if recording["id"] in unusable else 1.0
    document["units_checked"] = True
    place = "/campaigns/" + server.http.post("/v1/campaigns?skin=thorns", json=document).json()["id"]
    for recording in document["recordings"]:
        state = "gives no d33" if recording["id"] in unusable else "in use"
        assert page_text(server, place, f">{recording['id']}</a></th><td>FRF").endswith(state)
