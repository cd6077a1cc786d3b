"""The commands on what the service keeps: as tables, as JSON, and each error in one line."""

import json
from pathlib import Path
from typing import Any

import orjson

from tests.support.diagnosed import diagnosed, report, resonant
from tests.support.server import free_port
from tests.support.store_server import Place, Server, campaign, running

BACKEND = "sqlite"


def told(server: Server, *arguments: str) -> str:
    """What a command prints that succeeds."""
    done = server.place.command(*arguments, "--url", str(server.http.base_url))
    assert done.returncode == 0, done.stderr
    return done.stdout


def as_json(server: Server, *arguments: str) -> Any:
    return json.loads(told(server, *arguments, "--json"))


def refused(server: Server, *arguments: str) -> str:
    """The one line on stderr of a command that fails."""
    done = server.place.command(*arguments, "--url", str(server.http.base_url))
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    return line


def sent(server: Server, name: str, skin: str, **changes: Any) -> str:
    answer = server.http.post("/v1/campaigns", params={"skin": skin}, json=campaign(name, sensors=1, **changes))
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def rows(table: str) -> list[list[str]]:
    """The rows of a table in words, without its headings."""
    _, _, body = table.partition("─")
    return [line.split() for line in body.splitlines()[1:] if line.strip()]


def test_campaigns_and_skins_are_listed(server: Server) -> None:
    first, other = sent(server, "first", "palm"), sent(server, "second", "hand")
    assert [row[0] for row in rows(told(server, "campaigns"))] == [other, first]
    assert rows(told(server, "campaigns", "--skin", "palm")) == [
        [first, "palm", "first", "2017-05-03", "09:00", "2", "in", "use"]
    ]
    listed = server.http.get("/v1/campaigns?skin=palm").json()["campaigns"]
    assert as_json(server, "campaigns", "--skin", "palm") == listed
    assert [(row[0], row[-1]) for row in rows(told(server, "skins"))] == [("hand", "1"), ("palm", "1")]
    assert as_json(server, "skins") == server.http.get("/v1/skins").json()["skins"]
    assert refused(server, "campaigns", "--skin", "plam") == "underskin: 404 Not Found: There is no skin 'plam'."


def test_a_campaign_is_shown_with_its_recordings_and_diagnoses(server: Server) -> None:
    spoilt = campaign("spoilt", sensors=2)
    spoilt["recordings"][0]["preload_n"] = -1.0
    campaign_id = server.http.post("/v1/campaigns?skin=palm", json=spoilt).json()["id"]
    diagnosis_id = server.http.post(f"/v1/campaigns/{campaign_id}/diagnosis").json()["id"]
    shown = told(server, "campaigns", campaign_id)
    for part in ("s0-2N", "s1-1N", "s1-2N", diagnosis_id, "queued"):
        assert part in shown
    assert "refused: s0-1N preload_n: must be finite and greater than 0 (N)" in shown
    document = as_json(server, "campaigns", campaign_id)
    assert [one["id"] for one in document.pop("diagnoses")] == [diagnosis_id]
    assert document == server.http.get(f"/v1/campaigns/{campaign_id}").json()


def test_a_campaign_is_withdrawn_and_a_recording_excluded_with_the_reason(server: Server) -> None:
    campaign_id = sent(server, "first", "palm")
    words = told(server, "exclude", campaign_id, "s0-1N", "--reason", "cable loose")
    assert words == f"recording s0-1N is excluded; 1 of 2 recordings are now, of campaign {campaign_id}\n"
    detail = as_json(server, "withdraw", campaign_id, "--reason", "wrong sphere")
    assert detail == server.http.get(f"/v1/campaigns/{campaign_id}").json()
    assert (detail["withdraw_reason"], detail["entries"][0]["exclude_reason"]) == ("wrong sphere", "cable loose")
    assert rows(told(server, "campaigns")) == []
    (row,) = rows(told(server, "campaigns", "--state", "all"))
    assert row[-6:] == ["2", "−", "1", "withdrawn:", "wrong", "sphere"]
    assert "wrong sphere" in refused(server, "withdraw", campaign_id, "--reason", "again")
    assert "--reason" in refused(server, "withdraw", campaign_id)


def test_a_campaign_is_corrected_once_however_often_it_is_sent(server: Server, tmp_path: Path) -> None:
    first = sent(server, "first", "palm")
    file, other = tmp_path / "right.json", tmp_path / "other.json"
    file.write_bytes(orjson.dumps(campaign("right", sensors=1)))
    other.write_bytes(orjson.dumps(campaign("other", sensors=1)))
    words = told(server, "correct", first, str(file), "--reason", "E was mistyped")
    (entry,) = server.http.get("/v1/campaigns").json()["campaigns"]
    assert (entry["corrects"], entry["correct_reason"], entry["skin_id"]) == (first, "E was mistyped", "palm")
    assert words.startswith(f"campaign {entry['id']} of skin palm, 2 recordings: d33 ")
    (again,) = as_json(server, "correct", first, str(file), "--reason", "E was mistyped")
    assert (again["id"], again["repeated"]) == (entry["id"], True)
    both = [str(file), str(other)]
    assert "several files need --together" in refused(server, "correct", entry["id"], *both, "--reason", "x")
    told(server, "correct", entry["id"], *both, "--reason", "two files", "--together", "both")
    assert [one["name"] for one in server.http.get("/v1/campaigns").json()["campaigns"]] == ["both"]
    assert "cannot be opened" in refused(server, "correct", first, str(tmp_path / "none"), "--reason", "x")


def test_the_model_of_a_diagnosis_is_adopted(server: Server) -> None:
    _, diagnosis_id = diagnosed(server, resonant("array"), report())
    assert told(server, "adopt", "palm", diagnosis_id).startswith("skin palm: version 1 of its model, by diagnosis d-")
    model = as_json(server, "adopt", "palm", diagnosis_id)
    assert model == server.http.get("/v1/skins/palm/model").json()
    assert "contact_resonance" in {entry["name"] for entry in model["mechanisms"]}
    told(server, "history", "palm", "--model", "adopted")
    assert refused(server, "adopt", "palm", "d-none").endswith("There is no diagnosis 'd-none'.")


def test_a_key_that_is_missing_or_wrong_and_a_server_that_is_not_there_are_said(tmp_path: Path) -> None:
    place = Place(tmp_path / "data")
    place.folder.mkdir()
    keys = {
        scope: place.command("key", "create", scope, "--scope", scope).stdout.strip() for scope in ("read", "write")
    }
    with running(place, key=keys["write"]) as server:
        campaign_id = sent(server, "first", "palm")
        assert as_json(server, "skins", "--key", keys["read"])[0]["id"] == "palm"
        hint = "(api_key of Client, --key or UNDERSKIN_API_KEY of the command line)"
        missing = refused(server, "skins")
        assert missing.startswith("underskin: 401 Unauthorized: A key is needed.")
        assert missing.endswith(hint)
        wrong = refused(server, "skins", "--key", "us_wrong")
        assert wrong.startswith("underskin: 401 Unauthorized: This key is not known")
        narrow = refused(server, "withdraw", campaign_id, "--reason", "x", "--key", keys["read"])
        assert "has scope read; this needs one of scope write" in narrow
    for command in (["campaigns"], ["adopt", "palm", "d"]):
        done = place.command(*command, "--url", f"http://127.0.0.1:{free_port()}")
        assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
        assert "cannot be reached" in done.stderr
