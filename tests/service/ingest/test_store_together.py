"""Many files, such as one a press, kept as one campaign, with one d33 of the array."""

from pathlib import Path
from typing import Any

import httpx
import orjson
import pytest

from tests.service.pages.forms import BROWSING, token_of
from tests.support.instrument_files import CHARGE, FORCE, lvm, tdms
from tests.support.store_server import Server, campaign
from underskin import Client, ServiceError

BACKEND = "sqlite"
WHOLE = campaign("whole")
RIG = """\
schema: rig/1
skin:
  {thickness_mm: 2.5, youngs_modulus_mpa: 16, poisson_ratio: 0.5, sensor_radius_mm: 1.5,
   sensors: [{id: s01, x_mm: 0, y_mm: 0}]}
recording: {sensor: s01, indenter_radius_mm: 4, preload_n: 1, dynamic_force_n: 0.1}
channels:
  force_n: {channel: force, unit: mN}
  charge_pc: {channel: amplifier, unit: V, sensitivity: 10, sensitivity_unit: mV/pC, sign: -1}
"""


def press(number: int, **changes: Any) -> bytes:
    """A file of one recording, which knows its own sensor only."""
    recording = {**WHOLE["recordings"][number], **changes}
    sensors = [sensor for sensor in WHOLE["skin"]["sensors"] if sensor["id"] == recording["sensor"]]
    skin = {**WHOLE["skin"], "sensors": sensors}
    return orjson.dumps({**WHOLE, "name": f"press {number}", "skin": skin, "recordings": [recording]})


def presses() -> list[tuple[str, bytes]]:
    return [(f"press-{number}.json", press(number)) for number in range(6)]


def post(server: Server, files: list[tuple[str, bytes]], query: str = "", **headers: str) -> httpx.Response:
    form = [("file", file) for file in files]
    return server.http.post(f"/v1/campaigns?together=palm&{query}", files=form, headers=headers)


def figures(server: Server, campaign_id: str) -> dict[str, Any]:
    told = server.http.get(f"/v1/campaigns/{campaign_id}/d33").json()
    return {name: value for name, value in told.items() if name != "campaign_id"}


def test_a_file_a_press_is_one_array(server: Server) -> None:
    whole = server.http.post("/v1/campaigns", json=WHOLE).json()
    answer = post(server, presses(), "skin=palm-3")
    assert answer.status_code == 201, answer.text
    (kept,) = answer.json()["campaigns"]
    assert (kept["skin_id"], kept["file"], kept["errors"]) == ("palm-3", None, [])
    origin, already = kept["notes"]
    assert origin == "joined from press-0.json to press-5.json, 6 files"
    assert already.startswith("these recordings are in campaign whole")
    assert figures(server, kept["id"]) == figures(server, whole["id"])
    document = server.http.get(f"/v1/campaigns/{kept['id']}/document").json()
    sent = server.http.get(f"/v1/campaigns/{whole['id']}/document").json()
    assert document == {**sent, "name": "palm", "skin": {**sent["skin"], "id": "palm-3"}}
    assert len(server.http.get("/v1/campaigns?skin=palm-3").json()["campaigns"]) == 1


def test_a_bad_file_costs_its_own_recordings(server: Server) -> None:
    files = [*presses(), ("cut.json", press(0)[:50]), ("slip.json", press(1, id="slip", preload_n=-1))]
    answer = post(server, files)
    assert answer.status_code == 201, answer.text
    (kept,) = answer.json()["campaigns"]
    refused = {entry["id"]: entry["errors"] for entry in kept["recordings"] if entry["status"] == "refused"}
    assert {name: [error["field"] for error in errors] for name, errors in refused.items()} == {
        "cut.json": ["file"],
        "slip": ["preload_n"],
    }
    assert len(kept["recordings"]) == 8
    assert len(server.http.get(f"/v1/campaigns/{kept['id']}").json()["refused"]) == 2
    strict = post(server, files, "all_or_nothing=true")
    assert strict.status_code == 422
    assert {error["field"] for error in strict.json()["errors"]} == {
        "recordings[cut.json].file",
        "recordings[slip].preload_n",
    }
    assert post(server, [("cut.json", b"{"), ("text.csv", b"no numbers")]).status_code == 422
    assert len(server.http.get("/v1/campaigns").json()["campaigns"]) == 1


def test_files_of_different_skins_are_refused(server: Server) -> None:
    other = orjson.loads(press(1))
    other["skin"]["thickness_mm"] = 3.0
    answer = post(server, [*presses()[:1], ("other.json", orjson.dumps(other))])
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert (error["field"], error["value"]) == ("skin.thickness_mm", 3.0)
    assert "in other.json; must be 2.5, as in press-0.json" in error["allowed"]
    assert server.http.get("/v1/campaigns").json()["campaigns"] == []
    for name in ("", "%20", "a%00b", "x" * 201):
        assert server.http.post(f"/v1/campaigns?together={name}", json=WHOLE).status_code == 422


def test_instrument_files_of_two_formats_and_their_rig(server: Server) -> None:
    files = [("one.tdms", tdms(1)), ("two.tdms", tdms(2)), ("three.lvm", lvm(repeats=1).encode())]
    form = [("rig", ("bench.yaml", RIG.encode())), *(("file", file) for file in files)]
    answer = server.http.post("/v1/campaigns?skin=gel&together=Monday", files=form)
    assert answer.status_code == 201, answer.text
    (kept,) = answer.json()["campaigns"]
    assert [entry["id"] for entry in kept["recordings"]] == ["one", "two", "three"]  # few values, and no time
    recordings = server.http.get(f"/v1/campaigns/{kept['id']}/document").json()["recordings"]
    for recording in recordings:
        assert recording["force_n"] == pytest.approx(FORCE.tolist())
        assert recording["charge_pc"] == pytest.approx(CHARGE.tolist(), abs=1e-12)
    assert server.http.get("/v1/skins/gel").json()["rig"]["channels"]["force_n"]["unit"] == "mN"


def test_the_client_and_the_command(server: Server, tmp_path: Path) -> None:
    files = []
    for name, content in presses():
        (tmp_path / name).write_bytes(content)
        files.append(str(tmp_path / name))
    with Client(str(server.http.base_url)) as client:
        (kept,) = client.campaigns.post_files(files, skin="palm", together="by Python")
        assert (kept["status"], client.campaigns.load(kept["id"]).name) == ("ok", "by Python")
        with pytest.raises(ServiceError, match="together"):
            client.campaigns.post_files(files, together=" ")
    there = ["--skin", "palm", "--url", str(server.http.base_url), "--together", "by hand"]
    done = server.place.command("import", *files, *there)
    assert (done.returncode, done.stdout.count("by hand: campaign c-")) == (0, 1), done.stderr
    assert "6 recordings" in done.stdout
    Path(files[3]).write_text("{")
    done = server.place.command("import", *files, *there)
    assert (done.returncode, "5 recordings" in done.stdout, "press-3.json must be JSON" in done.stderr) == (
        2,
        True,
        True,
    )
    missing = server.place.command("import", *files, str(tmp_path / "missing.json"), *there)
    assert (missing.returncode, "missing.json cannot be opened" in missing.stderr) == (2, True)
    assert len(server.http.get("/v1/campaigns?skin=palm").json()["campaigns"]) == 3


def halves() -> list[tuple[str, tuple[str, str]]]:
    """A rig description that joins the force and the charge of a recording, and two recordings of each two files."""
    channels = "channels:\n  force_n: {channel: Force}\n  charge_pc: {channel: Charge}\njoin: {_force: _charge}\n"
    rig = RIG.partition("channels:")[0].replace("preload_n: 1", "preload_n: 1, sample_rate_hz: 1000") + channels
    written = [
        (f"{name}_{kind}.csv", "\n".join([f"Time [s];{heading}", *(f"{k / 1000};{k % 7}" for k in range(200))]))
        for name in ("a", "b")
        for kind, heading in (("charge", "Charge [pC]"), ("force", "Force [N]"))
    ]
    return [("rig", ("bench.yaml", rig)), *(("file", half) for half in written)]


def test_files_of_one_recording_are_joined(server: Server) -> None:
    """The force and the charge of one recording come in files of their own, which the rig description joins."""
    rig, *files = halves()
    answer = server.http.post("/v1/campaigns?skin=halves", files=[rig, *files])
    assert answer.status_code == 201, answer.text
    kept = answer.json()["campaigns"]
    assert [(one["file"], one["errors"]) for one in kept] == [("a_force.csv", []), ("b_force.csv", [])]
    alone = server.http.post("/v1/campaigns?skin=halves", files=[rig, files[1]])
    assert alone.status_code == 422
    assert "a_charge.csv belongs to it (join), and was not sent with it" in alone.text


def test_files_of_one_name_are_not_joined(server: Server) -> None:
    """Of two folders, whose files are called alike, none can be told to belong to another: each is to be sent alone."""
    rig, *files = halves()
    answer = server.http.post("/v1/campaigns?skin=folders", files=[rig, *files, files[0]])
    (refused, kept) = answer.json()["campaigns"]
    assert (kept["file"], kept["errors"]) == ("b_force.csv", [])
    assert "a_charge.csv was sent twice, and is to be joined (join): send the folders one by one" in str(refused)
    twice = server.http.post("/v1/campaigns?skin=folders", files=[rig, *files[:2], files[1]])
    assert twice.status_code == 422
    assert "a_force.csv was sent twice" in twice.text


def test_files_of_one_recording_are_joined_on_the_page(server: Server) -> None:
    """So they are on the page of an upload, which keeps one campaign of each pair."""
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as browser:
        token = token_of(browser.get("/upload").text)
        address = browser.post("/upload", data={"form_token": token}, files=halves()).headers["location"]
        shown = browser.get(address)
        assert shown.status_code == 200
        assert "lacks" not in shown.text
        kept = browser.post(f"{address}/keep", data={"form_token": token_of(shown.text), "skin": "pages"})
        assert kept.status_code in (200, 303), kept.text
    campaigns = server.http.get("/v1/campaigns?skin=pages").json()["campaigns"]
    assert len(campaigns) == 2
