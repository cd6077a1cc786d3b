"""Times that no recording has and sensors at one place: told alike wherever a campaign is told of."""

import json
import subprocess
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.service.pages.forms import BROWSING, token_of
from tests.support import preloaded
from tests.support.server import Server, running
from tests.support.store_server import campaign
from underskin.recordings.campaign import parse
from underskin.recordings.plausibility import implausible

YEAR = "recording s0-1N: recorded_at is 3017-05-03T09:00:00Z, which is still to come: is the year a slip?"
PLACE = "sensors s0 and s1 lie at one place, x 0 mm, y 0 mm: is it a slip?"


def recorded(*times: str) -> dict[str, Any]:
    """A campaign whose first recordings were made at these times."""
    document = campaign("monday")
    for entry, time in zip(document["recordings"], times, strict=False):
        entry["recorded_at"] = time
    return document


def placed(*places: tuple[float, float], radius_mm: float = 1.5) -> dict[str, Any]:
    """A campaign whose sensors lie at these places."""
    sensors = [{"id": f"s{number}", "x_mm": x, "y_mm": y} for number, (x, y) in enumerate(places)]
    return campaign("monday", sensors=len(places)) | {
        "skin": {**campaign("monday")["skin"], "sensor_radius_mm": radius_mm, "sensors": sensors}
    }


def in_hours(hours: float) -> str:
    return (datetime.now(UTC) + timedelta(hours=hours)).isoformat()


BOTH = placed((0, 0), (0, 0)) | {"recordings": recorded("3017-05-03T09:00:00Z")["recordings"][:4]}
COMPRESSION: dict[str, Any] = {
    "schema": "campaign/1",
    "name": "block",
    "skin": {"poisson_ratio": 0.5},
    "recordings": [
        {
            "id": "s0-1N",
            "kind": "compression",
            "recorded_at": "3017-05-03T09:00:00Z",
            "sample_height_mm": 10,
            "sample_diameter_mm": 20,
            "displacement_mm": [0.01 * n for n in range(20)],
            "force_n": [0.5 * n for n in range(20)],
        }
    ],
}


@pytest.mark.parametrize(
    ("document", "told"),
    [
        (recorded("1990-01-01T00:00:00Z", in_hours(-1), in_hours(20)), []),
        (recorded("2017-05-03", "3017-05-03T09:00:00Z", "3017-05-03"), ["s0-2N", "still to come", "1 more recording "]),
        (recorded(in_hours(30)), ["s0-1N", "still to come"]),
        (recorded("1989-12-31T23:00:00Z"), ["s0-1N", "before 1990"]),
        (recorded("1000-01-01T00:00:00+14:00", "8999-12-31T23:59:59-14:00"), ["s0-1N", "before 1990"]),
        (placed((0, 0), (8, 0), (3, 0)), []),
        (placed((0, 0), (8, 0), (8, 0), (8, 0), (8, 0)), ["s1, s2, s3 and 1 more", "x 8 mm, y 0 mm"]),
        (placed((0, 0), (8, 0), (2.5, 0)), ["s0 and s2 of 1.5 mm radius", "2.5 mm apart: is it the diameter"]),
        (placed((0, 0), (0.008, 0)), ["s0 and s1", "given in m"]),
        (placed((0, 0), (1e6, 0), (-1e6, 8)), []),
    ],
)
def test_what_is_told_of_times_and_places(document: dict[str, Any], told: Sequence[str]) -> None:
    found = [finding.sentence for finding in implausible(parse(document))]
    assert bool(found) == bool(told)
    for words in told:
        assert any(words in finding for finding in found), (words, found)


def underskin(folder: Path, *arguments: str) -> "subprocess.CompletedProcess[str]":
    return preloaded.run(*arguments, folder=folder)


@pytest.mark.slow
@pytest.mark.parametrize(("document", "told"), [(BOTH, [YEAR, PLACE]), (COMPRESSION, [YEAR])])
def test_d33_of_a_file_tells_them(document: dict[str, Any], told: list[str], tmp_path: Path) -> None:
    (tmp_path / "monday.json").write_text(json.dumps(document))
    found = underskin(tmp_path, "d33", "monday.json")
    assert [line for line in found.stdout.splitlines() if "look at" in line] == [f"look at: {said}" for said in told]


@pytest.mark.slow
def test_a_diagnosis_tells_them_once(tmp_path: Path) -> None:
    (tmp_path / "monday.json").write_text(json.dumps(BOTH))
    underskin(tmp_path, "diagnose", "monday.json", "--output-dir", "reports")
    findings = json.loads((tmp_path / "reports" / "monday.json").read_text())["findings"]
    told = [entry for entry in findings if entry["code"] in ("unlikely_time", "impossible_geometry")]
    assert told == [
        {
            "code": "unlikely_time",
            "recording": "s0-1N",
            "field": "recorded_at",
            "statement": YEAR.removeprefix("recording s0-1N: "),
        },
        {"code": "impossible_geometry", "recording": "", "field": "skin.sensors", "statement": PLACE},
    ]


@pytest.fixture(scope="module")
def own_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that campaigns are sent to."""
    with running(tmp_path_factory.mktemp("findings"), {"UNDERSKIN_DIAGNOSIS_WORKERS": "0"}) as started:
        yield started


@pytest.mark.slow
@pytest.mark.parametrize(("document", "told"), [(BOTH, [YEAR, PLACE]), (COMPRESSION, [YEAR]), (recorded(), [])])
def test_the_service_tells_them_of_what_comes_in(document: dict[str, Any], told: list[str], own_server: Server) -> None:
    with httpx.Client(base_url=own_server.url, timeout=300) as http:
        kept = http.post("/v1/campaigns?skin=palm", json=document).json()
        assert kept["status"] == "ok"
        assert kept["findings"] == told
        assert http.get(f"/v1/campaigns/{kept['id']}/d33").json()["findings"] == told


def test_import_tells_them(own_server: Server, tmp_path: Path) -> None:
    (tmp_path / "import.json").write_text(json.dumps({**BOTH, "name": "imported"}))
    found = underskin(tmp_path, "import", "import.json", "--skin", "palm", "--url", own_server.url)
    assert found.returncode == 0
    told = [line for line in found.stdout.splitlines() if "look at" in line]
    assert told == [f"import.json: look at: {said}" for said in (YEAR, PLACE)]


@pytest.mark.slow
@pytest.mark.parametrize(("document", "told"), [(BOTH, [YEAR, PLACE]), (COMPRESSION, [YEAR])])
def test_upload_page_tells_before_anything_kept(document: dict[str, Any], told: list[str], own_server: Server) -> None:
    """The upload page tells them before anything is kept."""
    with httpx.Client(base_url=own_server.url, headers=BROWSING, timeout=300) as browser:
        form = {"form_token": token_of(browser.get("/upload").text)}
        files = {"file": ("again.json", json.dumps({**document, "name": "looked at"}).encode())}
        page = browser.post("/upload", data=form, files=files, follow_redirects=True).text
    lines = [line for line in page.splitlines() if "before you keep it" in line]
    for said in told:
        assert any(said in line for line in lines), (said, lines)
