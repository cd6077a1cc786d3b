"""Files as uploads: by their content, under limits that hold as they stream, with a rig description that is kept."""

import io
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import orjson
import pytest

from tests.support.store_server import Place, Server, campaign, running
from underskin.recordings.readers import hdf5_file

BACKEND = "postgresql"
RIG = """\
schema: rig/1
kind: indentation
skin: {poisson_ratio: 0.5}
recording: {indenter_radius_mm: 2.5}
channels:
  displacement_mm: {channel: Z (mm)}
  force_n: {channel: Load (N)}
"""
CSV = "Z (mm);Load (N)\n0,0;0,0\n0,1;0,5\n0,2;1,4\n0,3;2,6\n"


def hdf5(name: str) -> bytes:
    stream = io.BytesIO()
    hdf5_file.write_document(campaign(name), campaign(name)["recordings"], stream)
    return stream.getvalue()


def test_a_file_is_told_by_its_content(server: Server) -> None:
    answer = server.http.post("/v1/campaigns", content=hdf5("array"), headers={"Content-Type": "text/plain"})
    assert answer.status_code == 201, answer.text
    document = server.http.get(f"/v1/campaigns/{answer.json()['id']}/document").json()
    assert document["recordings"] == campaign("array")["recordings"]
    back = server.http.get(f"/v1/campaigns/{answer.json()['id']}/document?format=hdf5")
    again = server.http.post("/v1/campaigns", content=back.content).json()["id"]
    assert server.http.get(f"/v1/campaigns/{again}/document").json() == document
    lying = server.http.post("/v1/campaigns", files={"file": ("array.h5", CSV.encode(), "application/x-hdf5")})
    assert lying.status_code == 422
    assert "rig description" in lying.json()["detail"]


def test_a_rig_description_is_kept_with_the_skin_and_used_again(server: Server) -> None:
    dated = RIG.replace("2.5}", "2.5, recorded_at: 2026-05-03T12:30:00Z}")
    form = [("rig", ("bench.yaml", dated)), ("file", ("cut.csv", CSV))]
    first = server.http.post("/v1/campaigns?skin=gel", files=form)
    assert first.status_code == 201, first.text
    kept = server.http.get(f"/v1/campaigns/{first.json()['campaigns'][0]['id']}").json()
    assert kept["recorded_at"].startswith("2026-05-03T12:30")
    assert "force: 'Load (N)', in the unit of its label" in kept["notes"]
    assert server.http.get("/v1/skins/gel").json()["rig"]["channels"]["force_n"]["channel"] == "Load (N)"
    second = server.http.post("/v1/campaigns?skin=gel", files=[("file", ("next.csv", CSV))])
    assert second.status_code == 201, second.text
    name = second.json()["campaigns"][0]["id"]
    (recording,) = server.http.get(f"/v1/campaigns/{name}/document").json()["recordings"]
    assert (recording["kind"], recording["force_n"]) == ("indentation", [0.0, 0.5, 1.4, 2.6])
    assert "recorded_at" not in recording  # which was typed of the first file
    assert server.http.post("/v1/campaigns", files=[("file", ("next.csv", CSV))]).status_code == 422


def test_a_correction_is_read_with_the_rig_of_the_campaign_that_it_corrects(server: Server) -> None:
    form = [("rig", ("bench.yaml", RIG)), ("file", ("cut.csv", CSV))]
    wrong = server.http.post("/v1/campaigns?skin=gel", files=form).raise_for_status().json()["campaigns"][0]["id"]
    named = [("file", ("cut.csv", CSV.replace("2,6", "2,7")))]
    right = server.http.post("/v1/campaigns", params={"corrects": wrong, "reason": "slip"}, files=named)
    assert right.status_code == 201, right.text
    (entry,) = right.json()["campaigns"]
    assert entry["skin_id"] == "gel"
    query = {"corrects": entry["id"], "reason": "another skin", "skin": "rubber"}
    assert server.http.post("/v1/campaigns", params=query, files=named).status_code == 201
    assert server.http.get("/v1/skins/rubber").json()["rig"]["kind"] == "indentation"
    absent = server.http.post("/v1/campaigns", params={"corrects": "c-0", "reason": "slip"}, files=named)
    assert absent.status_code == 404


def test_all_that_is_wrong_with_a_rig_description_is_told_at_once(server: Server) -> None:
    bad = RIG.replace("schema: rig/1", "schema: rig/1\ntrim: {first_sample: 9, last_sample: 3}\nestimator: H7")
    answer = server.http.post("/v1/campaigns", files=[("rig", ("r.yaml", bad)), ("file", ("cut.csv", CSV))])
    assert answer.status_code == 422
    assert {error["field"] for error in answer.json()["errors"]} == {"r.yaml: trim.last_sample", "r.yaml: estimator"}


def test_limits_hold_as_the_upload_streams(place: Place) -> None:
    with running(place, UNDERSKIN_MAX_BODY_MB="1", UNDERSKIN_MAX_UPLOAD_MB="3") as server:
        document = orjson.dumps(campaign("padded")).ljust(1_500_000)
        whole = server.http.post("/v1/campaigns", content=document, headers={"Content-Type": "application/json"})
        assert (whole.status_code, "UNDERSKIN_MAX_BODY_MB" in whole.json()["detail"]) == (413, True)
        as_file = server.http.post("/v1/campaigns", files={"file": ("a.json", document)})
        assert (as_file.status_code, "UNDERSKIN_MAX_BODY_MB" in as_file.json()["detail"]) == (413, True)

        for blanks in (b" " * 70, b"\n" * 3000):
            led = server.http.post("/v1/campaigns", content=blanks + document, headers={"Content-Type": "text/plain"})
            assert (led.status_code, "UNDERSKIN_MAX_BODY_MB" in led.json()["detail"]) == (413, True)

        streamed = server.http.post("/v1/campaigns", content=iter([b" " * 100_000] * 50))
        assert (streamed.status_code, "UNDERSKIN_MAX_UPLOAD_MB" in streamed.json()["detail"]) == (413, True)
        assert server.http.post("/v1/campaigns", json=campaign("fits")).status_code == 201
        assert not list((place.folder / "uploads").glob("*/tmp*"))


def test_a_broken_form_is_refused(server: Server) -> None:
    headers = {"Content-Type": "multipart/form-data; boundary=x"}
    for body in (b"", b"no form", b'--x\r\nContent-Disposition: form-data; name="file"; filename="a"\r\n\r\nhalf'):
        answer = server.http.post("/v1/campaigns", content=body, headers=headers)
        assert answer.status_code in (400, 422), answer.text


def test_a_request_may_bring_so_much_and_no_more(server: Server) -> None:
    many = orjson.dumps([0] * 1001)
    half = ("file", ("half.json", orjson.dumps([0] * 501)))
    recordings = orjson.dumps({**campaign("x"), "recordings": [0] * 50_001})
    answers = [server.http.post("/v1/campaigns", content=body) for body in (many, recordings)]
    answers.append(server.http.post("/v1/campaigns", files=[half, half]))
    for answer in answers:
        assert (answer.status_code, "several requests" in answer.json()["detail"]) == (413, True)
        assert len(answer.content) < 1000


def test_of_many_errors_the_first_are_told_and_all_counted(server: Server) -> None:
    document = campaign("mixed", lines=3)
    bad = [{**document["recordings"][0], "id": f"bad {number}", "preload_n": -1} for number in range(150)]
    answer = server.http.post("/v1/campaigns", json={**document, "recordings": [*bad, document["recordings"][0]]})
    assert answer.status_code == 201, answer.text
    result = answer.json()
    assert [entry["status"] for entry in result["recordings"]] == ["ok"] + ["refused"] * 150
    assert sum(len(entry["errors"]) for entry in result["recordings"]) == 100
    assert result["notes"] == ["150 recordings have 150 errors; the first 100 are listed"]
    none = server.http.post("/v1/campaigns", json={**document, "recordings": bad})
    assert (none.status_code, len(none.json()["errors"])) == (422, 100)
    alike = "recordings bad 0, bad 1, bad 2 and 97 more: preload_n = -1.0: must be finite and greater than 0 (N)"
    assert none.json()["detail"] == f"Nothing was kept: {alike}; and 50 more"


def test_what_a_killed_server_was_sent_is_cleared_away(place: Place) -> None:
    uploads = place.folder / "uploads"
    under_way = threading.Event()

    def slow() -> Iterator[bytes]:
        yield b" " * 3_000_000
        under_way.wait(240)
        yield b" "

    def send(http: httpx.Client) -> None:
        with pytest.raises(httpx.TransportError):
            http.post("/v1/campaigns", content=slow())

    with running(place) as server:
        sender = threading.Thread(target=send, args=(server.http,))
        sender.start()
        while not list(uploads.glob("*/*/0")):
            time.sleep(0.01)
        server.kill()
        under_way.set()
        sender.join()
    assert list(uploads.glob("*/*/0"))
    with running(place):
        assert not list(uploads.glob("*/*/0"))


def test_no_name_from_a_client_becomes_a_path(server: Server, tmp_path: Path) -> None:
    target = tmp_path / "planted"
    name = "/".join([".."] * 12) + str(target)
    answer = server.http.post("/v1/campaigns", files={"file": (name, orjson.dumps(campaign("x")))})
    assert answer.status_code == 201
    assert not target.exists()
    kept = {path.name for path in server.place.folder.iterdir()}
    assert kept <= {
        "underskin.sqlite3",
        "underskin.sqlite3-wal",
        "underskin.sqlite3-shm",
        "underskin.sqlite3.lock",
        "uploads",
        "migration.lock",
    }
